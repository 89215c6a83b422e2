//! `[effects.flow_boundaries]`

use serde::Deserialize;

use super::EffectTable;
use super::columns::{Counted, INDEX, VECTOR};
use crate::base::input::{Check, InputError};
use crate::base::vec3::Vec3;
use crate::engine::effects::flow_boundaries::{FlowBoundaries, Inflow, LAYERS, Outflow};
use crate::engine::kernel::Dimensions;
use crate::scene::Scene;

/// Fluid comes in and goes out.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct FlowBoundariesSpec {
    /// Particles that wait to be let in at the start: four layers an inflow, and as many as the fluid may grow by.
    pub reserve: usize,
    #[serde(default)]
    pub inflow: Vec<InflowSpec>,
    #[serde(default)]
    pub outflow: Vec<OutflowSpec>,
}

/// A rectangle through which fluid comes in.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct InflowSpec {
    /// Lower corner. Particles lie half a particle distance from the edges.
    pub from_m: Vec3,
    /// Upper corner: as the lower one along the velocity; in a plane, z is 0.
    pub to_m: Vec3,
    /// Along one axis.
    pub velocity_m_s: Vec3,
    /// The group of what comes in; by default none.
    pub group: Option<String>,
    /// Of what comes in, in a scene with heat.
    #[serde(default)]
    pub temperature: f64,
    /// Of what comes in, in a scene with a passive scalar.
    #[serde(default)]
    pub concentration: f64,
}

/// A box that takes out the fluid in it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct OutflowSpec {
    /// Lower corner; `-inf` opens a side.
    pub from_m: Vec3,
    /// Upper corner; `inf` opens a side.
    pub to_m: Vec3,
}

impl InflowSpec {
    fn axis(&self) -> usize {
        self.velocity_m_s.iter().position(|&u| u != 0.0).unwrap_or(0)
    }

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        for (name, vector) in
            [("from_m", self.from_m), ("to_m", self.to_m), ("velocity_m_s", self.velocity_m_s)]
        {
            check.finite_vector(&format!("{key}.{name}"), vector)?;
        }
        let along = self.velocity_m_s.iter().filter(|&&u| u != 0.0).count();
        let (name, found) = (format!("{key}.velocity_m_s"), format!("{:?}", self.velocity_m_s));
        check.require(along == 1, &name, found, "allowed are velocities along x, y or z")?;
        let (axis, found) = (self.axis(), format!("{:?}", self.to_m));
        let rectangle = (0..3).all(|d| match self.to_m[d] - self.from_m[d] {
            extent if d == axis => extent == 0.0,
            extent if d == 2 => extent >= 0.0,
            extent => extent > 0.0,
        });
        let allowed = "allowed are corners above `from_m`, and equal to it along the velocity";
        check.require(rectangle, &format!("{key}.to_m"), found, allowed)?;
        for (name, value) in [("temperature", self.temperature), ("concentration", self.concentration)] {
            check.finite(&format!("{key}.{name}"), value)?;
        }
        Ok(())
    }

    fn to_engine(&self, groups: &[String]) -> Inflow {
        let named = |group: &String| groups.iter().position(|name| name == group);
        Inflow {
            low_m: self.from_m,
            high_m: self.to_m,
            axis: self.axis(),
            speed_m_s: self.velocity_m_s[self.axis()],
            group: self.group.as_ref().and_then(named).unwrap_or(0) as u8,
            temperature: self.temperature,
            concentration: self.concentration,
        }
    }
}

impl FlowBoundariesSpec {
    /// What can be checked only beside the rest of the scene: groups, and whether the reserve fills the layers.
    pub(in crate::scene::spec) fn check_beside(
        &self,
        check: Check<'_>,
        groups: &[String],
        l0: f64,
        dimensions: Dimensions,
    ) -> Result<(), InputError> {
        let mut needed = 0;
        for (k, inflow) in self.inflow.iter().enumerate() {
            let key = format!("effects.flow_boundaries.inflow[{k}]");
            if let Some(group) = &inflow.group {
                let allowed = "allowed are groups that a region names";
                check.require(
                    groups.contains(group),
                    &format!("{key}.group"),
                    format!("`{group}`"),
                    allowed,
                )?;
            }
            let layer = inflow.to_engine(groups).places(l0, dimensions).len();
            let allowed = "each side must be as long as half a particle distance at least, z too in space";
            check.require(layer > 0, &format!("{key}.to_m"), format!("{:?}", inflow.to_m), allowed)?;
            needed += LAYERS * layer;
        }
        let (key, allowed) = (
            "effects.flow_boundaries.reserve",
            format!("{needed} stand in the layers of the inflows: raise it"),
        );
        check.require(self.reserve >= needed, key, self.reserve, allowed)
    }

    /// Where the layers of the inflows may stand: corners, metres.
    pub(in crate::scene::spec) fn bounds(&self, l0: f64) -> Vec<Vec3> {
        let corners = |inflow: &InflowSpec| {
            let (axis, mut behind) = (inflow.axis(), inflow.from_m);
            behind[axis] -= inflow.velocity_m_s[axis].signum() * LAYERS as f64 * l0;
            [inflow.from_m, inflow.to_m, behind]
        };
        self.inflow.iter().flat_map(corners).collect()
    }
}

impl EffectTable for FlowBoundariesSpec {
    type Effect = FlowBoundaries;

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        let allowed = format!("allowed are up to {}", u32::MAX / 4);
        let few = self.reserve <= (u32::MAX / 4) as usize;
        check.require(few, &format!("{key}.reserve"), self.reserve, allowed)?;
        for (k, inflow) in self.inflow.iter().enumerate() {
            inflow.check(check, &format!("{key}.inflow[{k}]"))?;
        }
        for (k, outflow) in self.outflow.iter().enumerate() {
            let box_ = (0..3).all(|d| outflow.from_m[d] <= outflow.to_m[d]);
            let allowed = "allowed are numbers no smaller than those of `from_m`; `inf` opens a side";
            let key = format!("{key}.outflow[{k}].to_m");
            check.require(box_, &key, format!("{:?}", outflow.to_m), allowed)?;
        }
        Ok(())
    }

    fn column_bytes(&self, of: &Counted<'_>) -> usize {
        let (l0, dimensions) = (of.scene.particle_distance_m, of.scene.engine_dimensions());
        let places = |inflow: &InflowSpec| inflow.to_engine(&[]).places(l0, dimensions).len();
        let places: usize = self.inflow.iter().map(places).sum();
        places * (VECTOR + LAYERS * INDEX) + of.particles * INDEX
    }

    fn effect(&self, scene: &Scene) -> FlowBoundaries {
        let groups = scene.group_names();
        let outflow = |box_: &OutflowSpec| Outflow { low_m: box_.from_m, high_m: box_.to_m };
        FlowBoundaries {
            inflows: self.inflow.iter().map(|inflow| inflow.to_engine(&groups)).collect(),
            outflows: self.outflow.iter().map(outflow).collect(),
        }
    }
}
