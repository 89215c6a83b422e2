//! The effects that a scene names, a table each: `[effects.gravity]` and so on. A new one is a file here and a line in the
//! list below.

mod buoyancy;
mod collision;
pub mod columns;
mod flow_boundaries;
mod frame;
mod gravity;
pub mod heat;
mod potential_tension;
mod pressure;
mod pressure_options;
mod rheology;
pub mod rigid_bodies;
pub mod scalar;
mod shifting;
mod surface_tension;
mod turbulence;
mod viscosity;
mod wall_contact;
pub mod wall_motion;

use serde::Deserialize;

use crate::base::input::{Check, InputError};
use crate::engine::parameters::Effects;
use crate::scene::Scene;
use columns::Counted;

/// The table of an effect.
pub trait EffectTable {
    /// What the engine is told.
    type Effect;

    /// Checks the table's own values; `key` is its name in errors.
    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError>;

    /// Checks what the scene says elsewhere about the effect, such as the groups.
    fn check_scene(&self, _check: Check<'_>, _scene: &Scene) -> Result<(), InputError> {
        Ok(())
    }

    /// Bytes of the columns that come with the effect and leave with it, before the first step: what later steps need by the
    /// number of neighbours and unknowns that they meet is not known by then.
    fn column_bytes(&self, _of: &Counted<'_>) -> usize {
        0
    }

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

            pub(super) fn check(&self, check: Check<'_>, scene: &Scene) -> Result<(), InputError> {
                $(if let Some(table) = &self.$name {
                    table.check(check, concat!("effects.", stringify!($name)))?;
                    table.check_scene(check, scene)?;
                })+
                self.fit_together(check)
            }

            /// Bytes of the columns of all effects that are named.
            pub fn column_bytes(&self, of: &Counted<'_>) -> usize {
                [$(self.$name.as_ref().map_or(0, |table| table.column_bytes(of))),+].iter().sum()
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
    /// Buoyancy of warm fluid.
    buoyancy: buoyancy::BuoyancySpec,
    /// Viscosity of a Newtonian fluid, explicit in time.
    viscosity: viscosity::ViscositySpec,
    /// Conduction of heat.
    heat: heat::HeatSpec,
    /// A passive scalar that diffuses.
    scalar: scalar::ScalarSpec,
    /// Viscosity that limits no step, implicit in time.
    implicit_viscosity: viscosity::ImplicitViscositySpec,
    /// A viscosity that depends on the shear rate: power-law, Bingham and other generalised Newtonian fluids.
    rheology: rheology::RheologySpec,
    /// Eddy viscosity below the particle distance (Smagorinsky).
    turbulence: turbulence::TurbulenceSpec,
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
    /// The scene is seen from a tank that is shaken or turns.
    frame: frame::FrameSpec,
    /// Walls of groups with a `motion` move.
    wall_motion: wall_motion::WallMotionSpec,
    /// Fluid comes in and goes out.
    flow_boundaries: flow_boundaries::FlowBoundariesSpec,
    /// The `body` regions of a group are one rigid body, moved by the fluid.
    rigid_bodies: rigid_bodies::RigidBodiesSpec,
    /// Particles move from where they crowd to where they are sparse.
    shifting: shifting::ShiftingSpec,
}

/// An effect and those of which it cannot be without one, with the reason.
const NEEDS: [(&str, &[&str], &str); 4] = [
    ("buoyancy", &["heat"], "fluid rises by its temperature"),
    ("buoyancy", &["gravity"], "fluid rises against gravity"),
    ("rheology", &VISCOSITIES, "a shear rate makes a viscosity, and another effect its force"),
    ("turbulence", &VISCOSITIES, "eddies add to a viscosity, and another effect is its force"),
];

const VISCOSITIES: [&str; 2] = ["viscosity", "implicit_viscosity"];

/// Two effects that exclude each other, with the reason.
const EXCLUDES: [(&str, &str, &str); 2] = [
    ("viscosity", "implicit_viscosity", "viscosity is computed once, explicitly or implicitly"),
    ("potential_tension", "surface_tension", "both are the tension of the same surface"),
];

impl EffectsSpec {
    /// An effect of `named` with those that cannot be without it, in the order of the list.
    pub fn with_dependents(effect: &str, named: &[&'static str]) -> Vec<&'static str> {
        let mut gone: Vec<&str> = vec![effect];
        let lost = |gone: &mut Vec<&str>| {
            let is_left = |name: &&str| named.contains(name) && !gone.contains(name);
            let next =
                NEEDS.iter().find(|(dependent, needed, _)| is_left(dependent) && !needed.iter().any(is_left));
            next.map(|(dependent, _, _)| gone.push(dependent)).is_some()
        };
        while lost(&mut gone) {}
        named.iter().copied().filter(|name| gone.contains(name)).collect()
    }

    /// An effect of `named` with those that it needs, in the order of the list.
    pub fn with_needs(effect: &str, named: &[&'static str]) -> Vec<&'static str> {
        let mut kept: Vec<&str> = vec![effect];
        let asked = |kept: &mut Vec<&str>| {
            let is_kept = |name: &&str| kept.contains(name);
            let next =
                NEEDS.iter().find(|(dependent, needed, _)| is_kept(dependent) && !needed.iter().any(is_kept));
            let needed =
                next.and_then(|(_, needed, _)| needed.iter().copied().find(|name| named.contains(name)));
            needed.map(|name| kept.push(name)).is_some()
        };
        while asked(&mut kept) {}
        named.iter().copied().filter(|name| kept.contains(name)).collect()
    }

    /// An upper estimate of what effects with a matrix of their own take beyond `BYTES_PER_PARTICLE`, bytes a particle: as
    /// many entries as the pressure's matrix has, or three times as many.
    pub(super) fn more_bytes_per_particle(&self) -> usize {
        use viscosity::FormSpec;
        self.implicit_viscosity.as_ref().map_or(0, |viscosity| match viscosity.form {
            FormSpec::Laplacian => 2500,
            FormSpec::AngularMomentum => 7000,
        })
    }

    /// Refuses effects without what they need, and those that contradict each other.
    fn fit_together(&self, check: Check<'_>) -> Result<(), InputError> {
        let named = self.named();
        let is_named = |name: &str| named.contains(&name);
        for (effect, needed, why) in NEEDS {
            let tables =
                needed.iter().map(|name| format!("`effects.{name}`")).collect::<Vec<_>>().join(" or ");
            let allowed = format!("{why}: name {tables} as well, or leave this one out");
            let any = needed.iter().any(|name| is_named(name));
            check.require(!is_named(effect) || any, &format!("effects.{effect}"), "named alone", allowed)?;
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
        let excluded = EXCLUDES.iter().flat_map(|(one, other, _)| [*one, *other]);
        let needed = NEEDS.iter().flat_map(|(effect, needed, _)| needed.iter().copied().chain([*effect]));
        for name in excluded.chain(needed) {
            assert!(EffectsSpec::NAMES.contains(&name), "{name}");
        }
    }

    #[test]
    fn effects_leave_with_what_they_need_and_come_with_it() {
        let named = ["gravity", "buoyancy", "viscosity", "heat", "rheology"];
        assert_eq!(EffectsSpec::with_dependents("heat", &named), ["buoyancy", "heat"]);
        assert_eq!(EffectsSpec::with_dependents("viscosity", &named), ["viscosity", "rheology"]);
        assert_eq!(EffectsSpec::with_dependents("buoyancy", &named), ["buoyancy"]);
        assert_eq!(EffectsSpec::with_needs("buoyancy", &named), ["gravity", "buoyancy", "heat"]);
        assert_eq!(EffectsSpec::with_needs("rheology", &named), ["viscosity", "rheology"]);
    }
}
