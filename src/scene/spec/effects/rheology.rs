//! `[effects.rheology]`

use serde::Deserialize;

use super::EffectTable;
use super::columns::{Counted, SCALAR};
use crate::base::input::{Check, InputError};
use crate::engine::effects::rheology::{Model, PowerLaw, Rheology, Yielding};
use crate::scene::Scene;

/// A model and the parameters that it needs; it is named with all of its own and none of another's.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct RheologySpec {
    pub model: ModelSpec,
    /// The group whose particles are such a fluid; without the key all are.
    pub group: Option<String>,
    /// The least viscosity at any shear rate.
    pub minimum_viscosity_pa_s: f64,
    /// The greatest viscosity at any shear rate.
    pub maximum_viscosity_pa_s: f64,
    /// `K` of `power_law` and `herschel_bulkley`.
    pub consistency_pa_s_n: Option<f64>,
    /// `n` of `power_law`, `herschel_bulkley` and `carreau`.
    pub exponent: Option<f64>,
    /// `tau_y` of `bingham`, `herschel_bulkley` and `casson`.
    pub yield_stress_pa: Option<f64>,
    /// `m` of `bingham`, `herschel_bulkley` and `casson`: below a shear rate of about `3 / m` the fluid creeps.
    pub regularisation_s: Option<f64>,
    /// `mu` of `bingham` and `casson`, far above the yield stress.
    pub plastic_viscosity_pa_s: Option<f64>,
    /// `mu_0` of `carreau`.
    pub viscosity_at_rest_pa_s: Option<f64>,
    /// `mu_inf` of `carreau`.
    pub viscosity_at_infinity_pa_s: Option<f64>,
    /// `l` of `carreau`.
    pub relaxation_time_s: Option<f64>,
}

/// How the viscosity depends on the shear rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum ModelSpec {
    PowerLaw,
    Bingham,
    HerschelBulkley,
    Casson,
    Carreau,
}

const CONSISTENCY: &str = "consistency_pa_s_n";
const EXPONENT: &str = "exponent";
const YIELD_STRESS: &str = "yield_stress_pa";
const REGULARISATION: &str = "regularisation_s";
const PLASTIC: &str = "plastic_viscosity_pa_s";
const AT_REST: &str = "viscosity_at_rest_pa_s";
const AT_INFINITY: &str = "viscosity_at_infinity_pa_s";
const RELAXATION: &str = "relaxation_time_s";

impl ModelSpec {
    /// The keys that the model needs.
    fn needs(self) -> &'static [&'static str] {
        match self {
            ModelSpec::PowerLaw => &[CONSISTENCY, EXPONENT],
            ModelSpec::Bingham | ModelSpec::Casson => &[YIELD_STRESS, REGULARISATION, PLASTIC],
            ModelSpec::HerschelBulkley => &[CONSISTENCY, EXPONENT, YIELD_STRESS, REGULARISATION],
            ModelSpec::Carreau => &[AT_REST, AT_INFINITY, RELAXATION, EXPONENT],
        }
    }
}

impl RheologySpec {
    fn parameters(&self) -> [(&'static str, Option<f64>); 8] {
        [
            (CONSISTENCY, self.consistency_pa_s_n),
            (EXPONENT, self.exponent),
            (YIELD_STRESS, self.yield_stress_pa),
            (REGULARISATION, self.regularisation_s),
            (PLASTIC, self.plastic_viscosity_pa_s),
            (AT_REST, self.viscosity_at_rest_pa_s),
            (AT_INFINITY, self.viscosity_at_infinity_pa_s),
            (RELAXATION, self.relaxation_time_s),
        ]
    }

    fn model(&self) -> Model {
        // Every key that the model needs is there, or the scene was refused.
        let value = |value: Option<f64>| value.unwrap_or(0.0);
        let yielding = Yielding {
            yield_stress_pa: value(self.yield_stress_pa),
            regularisation_s: value(self.regularisation_s),
        };
        let law =
            PowerLaw { consistency_pa_s_n: value(self.consistency_pa_s_n), exponent: value(self.exponent) };
        let plastic = value(self.plastic_viscosity_pa_s);
        match self.model {
            ModelSpec::PowerLaw => Model::PowerLaw(law),
            ModelSpec::Bingham => Model::Bingham { plastic_viscosity_pa_s: plastic, yielding },
            ModelSpec::HerschelBulkley => Model::HerschelBulkley { above: law, yielding },
            ModelSpec::Casson => Model::Casson { viscosity_pa_s: plastic, yielding },
            ModelSpec::Carreau => Model::Carreau {
                at_rest_pa_s: value(self.viscosity_at_rest_pa_s),
                at_infinity_pa_s: value(self.viscosity_at_infinity_pa_s),
                time_s: value(self.relaxation_time_s),
                exponent: value(self.exponent),
            },
        }
    }
}

impl EffectTable for RheologySpec {
    type Effect = Rheology;

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        let needed = self.model.needs();
        for (name, value) in self.parameters() {
            let key = format!("{key}.{name}");
            match (value, needed.contains(&name)) {
                (None, false) => {}
                (None, true) => {
                    let allowed = format!("this model needs {}", needed.join(", "));
                    check.require(false, &key, "missing", allowed)?;
                }
                (Some(value), false) => {
                    let allowed = format!("this model has no such key: it needs {}", needed.join(", "));
                    check.require(false, &key, value, allowed)?;
                }
                (Some(value), true) if name == YIELD_STRESS => check.not_negative(&key, value)?,
                (Some(value), true) => check.positive(&key, value)?,
            }
        }
        let (least, most) = (self.minimum_viscosity_pa_s, self.maximum_viscosity_pa_s);
        check.not_negative(&format!("{key}.minimum_viscosity_pa_s"), least)?;
        let (key, allowed) = (
            format!("{key}.maximum_viscosity_pa_s"),
            format!("allowed are finite numbers above 0, at least `minimum_viscosity_pa_s`, {least}"),
        );
        check.require(most.is_finite() && most > 0.0 && most >= least, &key, most, allowed)
    }

    fn column_bytes(&self, of: &Counted<'_>) -> usize {
        of.particles * SCALAR
    }

    fn effect(&self, scene: &Scene) -> Rheology {
        // A group that no region names has no particles, and no number.
        let number = |name: &String| scene.group_number(name).unwrap_or(u8::MAX);
        Rheology {
            model: self.model(),
            minimum_viscosity_pa_s: self.minimum_viscosity_pa_s,
            maximum_viscosity_pa_s: self.maximum_viscosity_pa_s,
            group: self.group.as_ref().map(number),
        }
    }
}
