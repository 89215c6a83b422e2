//! `[fluid]`, and what the scene as a whole says about its fluid: by an effect that it names or, where none does, here.

use std::f64::consts::TAU;

use serde::Deserialize;

use super::Scene;
use super::effects::wall_motion::MotionSpec;
use crate::base::input::{Check, InputError};
use crate::base::vec3::{Vec3, dot};

/// What the fluid is like. The optional numbers are what the adviser judges absent effects by; nothing is simulated
/// because of them.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Fluid {
    pub density_kg_m3: f64,
    /// For the adviser, where no effect gives a viscosity.
    pub kinematic_viscosity_m2_s: Option<f64>,
    /// For the adviser, where no effect gives a surface tension.
    pub surface_tension_n_m: Option<f64>,
    /// For the adviser, where no effect gives a thermal diffusivity.
    pub thermal_diffusivity_m2_s: Option<f64>,
    /// For the adviser, where no effect gives a thermal expansion.
    pub thermal_expansion_1_k: Option<f64>,
}

impl Fluid {
    pub(super) fn check(&self, check: Check<'_>) -> Result<(), InputError> {
        check.positive("fluid.density_kg_m3", self.density_kg_m3)?;
        for (key, value) in [
            ("fluid.kinematic_viscosity_m2_s", self.kinematic_viscosity_m2_s),
            ("fluid.surface_tension_n_m", self.surface_tension_n_m),
            ("fluid.thermal_diffusivity_m2_s", self.thermal_diffusivity_m2_s),
            ("fluid.thermal_expansion_1_k", self.thermal_expansion_1_k),
        ] {
            value.map_or(Ok(()), |value| check.not_negative(key, value))?;
        }
        Ok(())
    }
}

/// What is known of the fluid; `None` where nobody says.
impl Scene {
    pub fn kinematic_viscosity_m2_s(&self) -> Option<f64> {
        let explicit = self.effects.viscosity.as_ref().map(|table| table.kinematic_viscosity_m2_s);
        let implicit = self.effects.implicit_viscosity.as_ref().map(|table| table.kinematic_viscosity_m2_s);
        let plastic = self.effects.rheology.as_ref().and_then(|table| table.plastic_viscosity_pa_s);
        let plastic = plastic.map(|viscosity| viscosity / self.fluid.density_kg_m3);
        plastic.or(explicit).or(implicit).or(self.fluid.kinematic_viscosity_m2_s)
    }

    pub fn surface_tension_n_m(&self) -> Option<f64> {
        let curvature = self.effects.surface_tension.as_ref().map(|table| table.surface_tension_n_m);
        let potential = self.effects.potential_tension.as_ref().map(|table| table.surface_tension_n_m);
        curvature.or(potential).or(self.fluid.surface_tension_n_m)
    }

    pub fn thermal_diffusivity_m2_s(&self) -> Option<f64> {
        let conducted = self.effects.heat.as_ref().and_then(|heat| {
            let (k, c) = (heat.conductivity_w_m_k?, heat.heat_capacity_j_kg_k?);
            Some(k / (self.fluid.density_kg_m3 * c))
        });
        let given = self.effects.heat.as_ref().and_then(|heat| heat.thermal_diffusivity_m2_s);
        given.or(conducted).or(self.fluid.thermal_diffusivity_m2_s)
    }

    pub fn thermal_expansion_1_k(&self) -> Option<f64> {
        self.effects.buoyancy.as_ref().map(|table| table.expansion_1_k).or(self.fluid.thermal_expansion_1_k)
    }

    pub fn yield_stress_pa(&self) -> Option<f64> {
        self.effects.rheology.as_ref().and_then(|table| table.yield_stress_pa)
    }

    /// The fastest that walls, inflows or the frame drive the fluid, an order of magnitude, metres per second.
    pub fn driven_speed_m_s(&self) -> f64 {
        let size = self.geometry.lattice.extent_m.into_iter().fold(0.0, f64::max);
        let length = |v: Vec3| dot(v, v).sqrt();
        let wall = |motion: &MotionSpec| match motion {
            MotionSpec::Oscillation(motion) => length(motion.amplitude_m) * TAU * motion.frequency_hz,
            MotionSpec::Rocking(motion) => motion.amplitude_rad.abs() * TAU * motion.frequency_hz * size,
            MotionSpec::Turning(motion) => motion.rate_rad_s.abs() * size,
            // A table's speeds are not looked at.
            MotionSpec::Table(_) => 0.0,
        };
        let walls = self.group.iter().filter_map(|group| group.motion.as_ref()).map(wall);
        let inflows = self.effects.flow_boundaries.iter().flat_map(|table| &table.inflow);
        let inflows = inflows.map(|inflow| length(inflow.velocity_m_s));
        let frames = self.effects.frame.iter().map(|frame| length(frame.angular_velocity_rad_s) * size);
        walls.chain(inflows).chain(frames).fold(0.0, f64::max)
    }
}
