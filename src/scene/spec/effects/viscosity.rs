//! `[effects.viscosity]` and `[effects.implicit_viscosity]`, whose keys are the same

use serde::Deserialize;

use super::EffectTable;
use super::columns::{Counted, SCALAR};
use crate::base::input::{Check, InputError};
use crate::engine::effects::implicit_viscosity::ImplicitViscosity;
use crate::engine::effects::viscosity::Viscosity;
use crate::engine::parameters::Property;
use crate::engine::viscous;
use crate::scene::Scene;

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ViscositySpec {
    /// Of the fluid; `[[group]]` tables may name others for their particles.
    pub kinematic_viscosity_m2_s: f64,
    #[serde(default)]
    pub walls: WallsSpec,
    #[serde(default)]
    pub form: FormSpec,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ImplicitViscositySpec {
    /// Of the fluid; `[[group]]` tables may name others for their particles.
    pub kinematic_viscosity_m2_s: f64,
    #[serde(default)]
    pub walls: WallsSpec,
    #[serde(default)]
    pub form: FormSpec,
}

/// What the fluid meets at walls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum WallsSpec {
    /// Wall particles with the velocity at which they move.
    #[default]
    Resting,
    /// Velocities behind the surface such that the fluid has the wall's velocity half a particle distance above its first
    /// layer.
    Mirrored,
}

/// The force of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum FormSpec {
    /// Along the difference of the velocities.
    #[default]
    Laplacian,
    /// Along the line between the particles: a body that turns rigidly goes on turning.
    AngularMomentum,
}

impl WallsSpec {
    fn to_engine(self) -> viscous::Walls {
        match self {
            WallsSpec::Resting => viscous::Walls::Resting,
            WallsSpec::Mirrored => viscous::Walls::Mirrored,
        }
    }
}

impl FormSpec {
    fn to_engine(self) -> viscous::Form {
        match self {
            FormSpec::Laplacian => viscous::Form::Laplacian,
            FormSpec::AngularMomentum => viscous::Form::AngularMomentum,
        }
    }
}

fn of_groups(of_fluid: f64, scene: &Scene) -> Property {
    scene.property(of_fluid, |group| group.kinematic_viscosity_m2_s)
}

/// A viscosity that differs between groups is a column; one that follows the flow is its effect's.
fn varying(of_fluid: f64, of: &Counted<'_>) -> usize {
    let effects = &of.scene.effects;
    let follows_the_flow = effects.rheology.is_some() || effects.turbulence.is_some();
    let uniform = of_groups(of_fluid, of.scene).uniform().is_some();
    if uniform || follows_the_flow { 0 } else { of.particles * SCALAR }
}

impl EffectTable for ViscositySpec {
    type Effect = Viscosity;

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        check.not_negative(&format!("{key}.kinematic_viscosity_m2_s"), self.kinematic_viscosity_m2_s)
    }

    fn column_bytes(&self, of: &Counted<'_>) -> usize {
        varying(self.kinematic_viscosity_m2_s, of)
    }

    fn effect(&self, scene: &Scene) -> Viscosity {
        Viscosity {
            kinematic_viscosity_m2_s: of_groups(self.kinematic_viscosity_m2_s, scene),
            walls: self.walls.to_engine(),
            form: self.form.to_engine(),
        }
    }
}

impl EffectTable for ImplicitViscositySpec {
    type Effect = ImplicitViscosity;

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        check.not_negative(&format!("{key}.kinematic_viscosity_m2_s"), self.kinematic_viscosity_m2_s)
    }

    fn column_bytes(&self, of: &Counted<'_>) -> usize {
        varying(self.kinematic_viscosity_m2_s, of)
    }

    fn effect(&self, scene: &Scene) -> ImplicitViscosity {
        ImplicitViscosity {
            kinematic_viscosity_m2_s: of_groups(self.kinematic_viscosity_m2_s, scene),
            walls: self.walls.to_engine(),
            form: self.form.to_engine(),
        }
    }
}
