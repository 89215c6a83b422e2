//! The effects that a scene names, a table each: `[effects.gravity]` and so on. A new one is a file here and a line in the
//! list below.

mod collision;
mod gravity;
mod potential_tension;
mod pressure;
mod pressure_options;
mod surface_tension;
mod viscosity;
mod wall_contact;

use serde::Deserialize;

use crate::base::input::{Check, InputError};
use crate::engine::parameters::Effects;
use crate::scene::Scene;

/// The table of an effect.
pub trait EffectTable {
    /// What the engine is told.
    type Effect;

    /// Checks the table's own values; `key` is its name in errors.
    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError>;

    fn effect(&self, scene: &Scene) -> Self::Effect;
}

/// Makes the struct of all tables, and what goes through all of them.
macro_rules! effects {
    ($($(#[doc = $doc:literal])* $name:ident: $table:ty,)+) => {
        /// The effects that the scene names. One that is not named has no stage, no phase, no column and no time.
        #[derive(Debug, Clone, PartialEq, Default, Deserialize)]
        #[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
        #[serde(deny_unknown_fields)]
        pub struct EffectsSpec {
            $($(#[doc = $doc])* pub $name: Option<$table>,)+
        }

        impl EffectsSpec {
            /// The keys of the tables: what a scene may name, and switch off.
            pub const NAMES: &'static [&'static str] = &[$(stringify!($name)),+];

            /// The effects that the scene names, in the order of the list.
            pub fn named(&self) -> Vec<&'static str> {
                let mut named = Vec::new();
                $(if self.$name.is_some() {
                    named.push(stringify!($name));
                })+
                named
            }

            pub(super) fn check(&self, check: Check<'_>) -> Result<(), InputError> {
                $(if let Some(table) = &self.$name {
                    table.check(check, concat!("effects.", stringify!($name)))?;
                })+
                self.fit_together(check)
            }

            pub(super) fn to_engine(&self, scene: &Scene) -> Effects {
                Effects { $($name: self.$name.as_ref().map(|table| table.effect(scene)),)+ }
            }
        }
    };
}

effects! {
    /// A constant acceleration of the fluid.
    gravity: gravity::GravitySpec,
    /// Viscosity of a Newtonian fluid, explicit in time.
    viscosity: viscosity::ViscositySpec,
    /// Surface tension by attraction between particles.
    potential_tension: potential_tension::PotentialTensionSpec,
    /// Particles that come too close collide.
    collision: collision::CollisionSpec,
    /// Fluid does not pass the plane of a wall's surface.
    wall_contact: wall_contact::WallContactSpec,
    /// Surface tension by what particles lack at the free surface.
    surface_tension: surface_tension::SurfaceTensionSpec,
    /// Incompressibility.
    pressure: pressure::PressureSpec,
}

/// An effect and one that it cannot be without, with the reason.
const NEEDS: [(&str, &str, &str); 0] = [];

/// Two effects that exclude each other, with the reason.
const EXCLUDES: [(&str, &str, &str); 1] =
    [("potential_tension", "surface_tension", "both are the tension of the same surface")];

impl EffectsSpec {
    /// Refuses effects without what they need, and those that contradict each other.
    fn fit_together(&self, check: Check<'_>) -> Result<(), InputError> {
        let named = self.named();
        let is_named = |name: &str| named.contains(&name);
        for (effect, needed, why) in NEEDS {
            let allowed = format!("{why}: name `effects.{needed}` as well, or leave this one out");
            let key = format!("effects.{effect}");
            check.require(!is_named(effect) || is_named(needed), &key, "named alone", allowed)?;
        }
        for (one, other, why) in EXCLUDES {
            let allowed = format!("{why}: leave one of them out");
            let found = format!("named beside `effects.{other}`");
            check.require(!(is_named(one) && is_named(other)), &format!("effects.{one}"), found, allowed)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prerequisites_and_contradictions_name_effects() {
        for (one, other, _) in NEEDS.iter().chain(&EXCLUDES) {
            assert!(EffectsSpec::NAMES.contains(one) && EffectsSpec::NAMES.contains(other), "{one}, {other}");
        }
    }
}
