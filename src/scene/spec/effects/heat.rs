//! `[effects.heat]`, and what groups have of it

use serde::Deserialize;

use super::EffectTable;
use super::columns::{Counted, SCALAR};
use crate::base::input::{Check, InputError};
use crate::engine::effects::diffusion::{Diffusion, Laplacian, WallCondition};
use crate::engine::parameters::Property;
use crate::scene::Scene;
use crate::scene::spec::GroupSpec;

/// Either `thermal_diffusivity_m2_s`, or `conductivity_w_m_k` and `heat_capacity_j_kg_k`, for the fluid and all groups.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct HeatSpec {
    pub conductivity_w_m_k: Option<f64>,
    pub heat_capacity_j_kg_k: Option<f64>,
    /// Conductivity over density and heat capacity.
    pub thermal_diffusivity_m2_s: Option<f64>,
    /// Of all particles whose group has no temperature of its own.
    pub initial_k: f64,
    #[serde(default)]
    pub laplacian: LaplacianSpec,
}

/// How the Laplacian is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum LaplacianSpec {
    /// The model of the lattice: conserves.
    #[default]
    Lattice,
    /// Fitted to each neighbourhood: converges on disordered particles.
    Corrected,
}

impl LaplacianSpec {
    pub fn to_engine(self) -> Laplacian {
        match self {
            LaplacianSpec::Lattice => Laplacian::Lattice,
            LaplacianSpec::Corrected => Laplacian::Corrected,
        }
    }
}

impl HeatSpec {
    fn by_diffusivity(&self) -> bool {
        self.thermal_diffusivity_m2_s.is_some()
    }

    /// Checks what the groups say about heat.
    fn check_groups(&self, check: Check<'_>, groups: &[GroupSpec]) -> Result<(), InputError> {
        let wrong = if self.by_diffusivity() {
            "`effects.heat` gives a thermal diffusivity: give `thermal_diffusivity_m2_s` and no flux here, or a conductivity \
             and a heat capacity there"
        } else {
            "`effects.heat` gives a conductivity and a heat capacity: give those here"
        };
        for (k, group) in groups.iter().enumerate() {
            let properties = [
                ("conductivity_w_m_k", group.conductivity_w_m_k, self.by_diffusivity()),
                ("heat_capacity_j_kg_k", group.heat_capacity_j_kg_k, self.by_diffusivity()),
                ("thermal_diffusivity_m2_s", group.thermal_diffusivity_m2_s, !self.by_diffusivity()),
            ];
            for (name, value, refused) in properties {
                let key = format!("group[{k}].{name}");
                if let Some(value) = value {
                    check.positive(&key, value)?;
                    check.require(!refused, &key, value, wrong)?;
                }
            }
            if let Some(flux) = group.heat_flux_w_m2 {
                let key = format!("group[{k}].heat_flux_w_m2");
                check.require(flux.is_finite(), &key, flux, "allowed are finite numbers")?;
                check.require(flux == 0.0 || !self.by_diffusivity(), &key, flux, wrong)?;
                let allowed = "a wall holds a temperature or lets a flux through: leave one of them out";
                check.require(group.temperature_k.is_none(), &key, flux, allowed)?;
            }
        }
        Ok(())
    }
}

impl EffectTable for HeatSpec {
    type Effect = Diffusion;

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        let HeatSpec { conductivity_w_m_k: k, heat_capacity_j_kg_k: c, thermal_diffusivity_m2_s: a, .. } =
            *self;
        let one_way = matches!((k, c, a), (Some(_), Some(_), None) | (None, None, Some(_)));
        let found = format!(
            "conductivity {}, heat capacity {}, diffusivity {}",
            named(k.is_some()),
            named(c.is_some()),
            named(a.is_some())
        );
        let allowed = "allowed are `conductivity_w_m_k` with `heat_capacity_j_kg_k`, or `thermal_diffusivity_m2_s` alone";
        check.require(one_way, key, found, allowed)?;
        for (name, value) in [("conductivity_w_m_k", k), ("thermal_diffusivity_m2_s", a)] {
            if let Some(value) = value {
                check.not_negative(&format!("{key}.{name}"), value)?;
            }
        }
        if let Some(value) = c {
            check.positive(&format!("{key}.heat_capacity_j_kg_k"), value)?;
        }
        check.finite(&format!("{key}.initial_k"), self.initial_k)
    }

    fn check_scene(&self, check: Check<'_>, scene: &Scene) -> Result<(), InputError> {
        self.check_groups(check, &scene.group)
    }

    fn column_bytes(&self, of: &Counted<'_>) -> usize {
        of.particles * 2 * SCALAR
    }

    fn effect(&self, scene: &Scene) -> Diffusion {
        let wall = |group: Option<&GroupSpec>| {
            let temperature = group.and_then(|group| group.temperature_k);
            let flux = group.and_then(|group| group.heat_flux_w_m2).unwrap_or(0.0);
            temperature.map_or(WallCondition::Flux(flux), WallCondition::Value)
        };
        let (conductivity, capacity) = match self.thermal_diffusivity_m2_s {
            Some(diffusivity) => {
                let by_group = |group: &GroupSpec| group.thermal_diffusivity_m2_s;
                (scene.property(diffusivity, by_group), Property::Uniform(1.0))
            }
            None => {
                let (k, c) =
                    (self.conductivity_w_m_k.unwrap_or(0.0), self.heat_capacity_j_kg_k.unwrap_or(1.0));
                let density = scene.fluid.density_kg_m3;
                let capacity = scene.property(density * c, |group| {
                    let own = group.density_kg_m3.is_some() || group.heat_capacity_j_kg_k.is_some();
                    let of = group.density_kg_m3.unwrap_or(density) * group.heat_capacity_j_kg_k.unwrap_or(c);
                    own.then_some(of)
                });
                (scene.property(k, |group| group.conductivity_w_m_k), capacity)
            }
        };
        Diffusion {
            conductivity,
            capacity,
            walls: scene.by_group(wall),
            laplacian: self.laplacian.to_engine(),
        }
    }
}

fn named(is_there: bool) -> &'static str {
    if is_there { "given" } else { "missing" }
}
