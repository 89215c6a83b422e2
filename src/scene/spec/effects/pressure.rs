//! `[effects.pressure]`

use serde::Deserialize;

use super::EffectTable;
use super::columns::{Counted, INDEX, SCALAR, VECTOR};
use super::pressure_options::{
    ClampSpec, EnclosedSpec, GradientSpec, PressureWallsSpec, SourceSpec, SurfaceSpec,
};
use crate::base::input::{Check, InputError};
use crate::engine::parameters::Property;
use crate::engine::pressure::Pressure;
use crate::scene::Scene;

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct PressureSpec {
    pub surface_threshold: f64,
    pub source_relaxation: f64,
    pub compressibility_1_pa: f64,
    /// In particle distances.
    pub kernel_floor: Option<f64>,
    /// Where the source comes from: `"density"`, or `{ kind = "divergence", density_feedback_s = ... }`.
    #[serde(default)]
    pub source: SourceSpec,
    #[serde(default)]
    pub gradient: GradientSpec,
    #[serde(default)]
    pub surface: SurfaceSpec,
    #[serde(default)]
    pub clamp: ClampSpec,
    #[serde(default)]
    pub enclosed: EnclosedSpec,
    #[serde(default)]
    pub walls: PressureWallsSpec,
}

impl EffectTable for PressureSpec {
    type Effect = Pressure;

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        let shares =
            [("surface_threshold", self.surface_threshold), ("source_relaxation", self.source_relaxation)];
        for (name, value) in shares {
            let (key, allowed) = (format!("{key}.{name}"), "allowed are numbers above 0 up to 1");
            check.require(value > 0.0 && value <= 1.0, &key, value, allowed)?;
        }
        check.not_negative(&format!("{key}.compressibility_1_pa"), self.compressibility_1_pa)?;
        if let Some(floor) = self.kernel_floor {
            let allowed = "allowed are numbers above 0 up to 1; without the key there is no floor";
            check.require(floor > 0.0 && floor <= 1.0, &format!("{key}.kernel_floor"), floor, allowed)?;
        }
        if let SourceSpec::Divergence(divergence) = &self.source {
            check.positive(&format!("{key}.source.density_feedback_s"), divergence.density_feedback_s)?;
        }
        if self.walls == PressureWallsSpec::Mirrored {
            let fits =
                matches!(self.source, SourceSpec::Divergence(_)) && self.gradient == GradientSpec::Consistent;
            let allowed = "allowed is \"mirrored\" beside the source of kind \"divergence\" and gradient = \"consistent\"";
            check.require(fits, &format!("{key}.walls"), "mirrored", allowed)?;
        }
        Ok(())
    }

    fn column_bytes(&self, of: &Counted<'_>) -> usize {
        // Pressure, number density and minimum; the row of a particle and the particle of a row; label and reach. A flag a
        // bucket.
        let asymmetry = if self.surface == SurfaceSpec::Density { 0 } else { SCALAR };
        // A moment matrix.
        let moments = if self.gradient == GradientSpec::Transposed { 3 * VECTOR } else { 0 };
        // A wall's face and normal, whether there is one, and its pressure.
        let mirrors = if self.walls == PressureWallsSpec::Mirrored { 2 * VECTOR + 1 + SCALAR } else { 0 };
        of.particles * (3 * SCALAR + 2 * INDEX + 2 + asymmetry + moments + mirrors) + of.buckets
    }

    fn effect(&self, scene: &Scene) -> Pressure {
        let density = scene.property(scene.fluid.density_kg_m3, |group| group.density_kg_m3);
        Pressure {
            surface_threshold: self.surface_threshold,
            source_relaxation: self.source_relaxation,
            compressibility_1_pa: self.compressibility_1_pa,
            kernel_floor: self.kernel_floor,
            source: self.source.to_engine(),
            gradient: self.gradient.to_engine(),
            surface: self.surface.to_engine(),
            clamp: self.clamp.to_engine(),
            enclosed: self.enclosed.to_engine(),
            walls: self.walls.to_engine(),
            density_by_group_kg_m3: match density {
                Property::Uniform(_) => None,
                Property::ByGroup(by_group) => Some(by_group),
            },
        }
    }
}
