//! Generalised Newtonian fluids: a viscosity that depends on the shear rate `g = sqrt(2 S:S)`, 1/s.
//!
//! Dynamic viscosities, Pa s:
//!
//! * power law: `K g^(n - 1)`;
//! * Bingham: `mu + tau_y (1 - exp(-m g)) / g`;
//! * Herschel-Bulkley: `K g^(n - 1) + tau_y (1 - exp(-m g)) / g`;
//! * Casson: `(sqrt(mu) + sqrt(tau_y / g) (1 - exp(-sqrt(m g))))^2`;
//! * Carreau: `mu_inf + (mu_0 - mu_inf) (1 + (l g)^2)^((n - 1) / 2)`.
//!
//! A yield stress makes the viscosity of a fluid at rest infinite. `m` regularises it (Papanastasiou 1987): below a shear
//! rate of about `3 / m` the fluid creeps with the viscosity `mu + tau_y m` instead of standing still, above it the
//! stress is Bingham's to 5 %. Between its smallest and its largest value the viscosity is as it comes; a power law with
//! `n < 1` needs the largest, one with `n > 1` the smallest.

/// How the viscosity depends on the shear rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Model {
    PowerLaw(PowerLaw),
    Bingham { plastic_viscosity_pa_s: f64, yielding: Yielding },
    HerschelBulkley { above: PowerLaw, yielding: Yielding },
    Casson { viscosity_pa_s: f64, yielding: Yielding },
    Carreau { at_rest_pa_s: f64, at_infinity_pa_s: f64, time_s: f64, exponent: f64 },
}

/// `K g^(n - 1)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerLaw {
    /// `K`, Pa s^n.
    pub consistency_pa_s_n: f64,
    /// `n`, dimensionless.
    pub exponent: f64,
}

/// A yield stress and what regularises it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Yielding {
    /// `tau_y`, Pa.
    pub yield_stress_pa: f64,
    /// `m`, seconds.
    pub regularisation_s: f64,
}

/// A fluid whose viscosity depends on its shear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rheology {
    pub model: Model,
    pub minimum_viscosity_pa_s: f64,
    pub maximum_viscosity_pa_s: f64,
    /// The one group whose particles are such a fluid; `None` where all are.
    pub group: Option<u8>,
}

impl PowerLaw {
    fn viscosity_pa_s(self, shear_rate_1_s: f64) -> f64 {
        // Exactly K where the exponent is 1, at rest too.
        if self.exponent == 1.0 {
            return self.consistency_pa_s_n;
        }
        self.consistency_pa_s_n * shear_rate_1_s.powf(self.exponent - 1.0)
    }
}

impl Yielding {
    /// `tau_y (1 - exp(-m g)) / g`, `tau_y m` at rest.
    fn viscosity_pa_s(self, shear_rate_1_s: f64) -> f64 {
        let m = self.regularisation_s;
        let per_stress =
            if shear_rate_1_s > 0.0 { -(-m * shear_rate_1_s).exp_m1() / shear_rate_1_s } else { m };
        self.yield_stress_pa * per_stress
    }

    /// `sqrt(tau_y / g) (1 - exp(-sqrt(m g)))`, `sqrt(tau_y m)` at rest.
    fn root_pa_s(self, shear_rate_1_s: f64) -> f64 {
        let m = self.regularisation_s;
        let root = (m * shear_rate_1_s).sqrt();
        let per_stress = if root > 0.0 { -(-root).exp_m1() / shear_rate_1_s.sqrt() } else { m.sqrt() };
        self.yield_stress_pa.sqrt() * per_stress
    }
}

impl Model {
    /// The dynamic viscosity at a shear rate, Pa s, before it is bounded.
    pub fn viscosity_pa_s(&self, shear_rate_1_s: f64) -> f64 {
        let g = shear_rate_1_s;
        match *self {
            Model::PowerLaw(law) => law.viscosity_pa_s(g),
            Model::Bingham { plastic_viscosity_pa_s, yielding } => {
                plastic_viscosity_pa_s + yielding.viscosity_pa_s(g)
            }
            Model::HerschelBulkley { above, yielding } => {
                above.viscosity_pa_s(g) + yielding.viscosity_pa_s(g)
            }
            Model::Casson { viscosity_pa_s, yielding: Yielding { yield_stress_pa: 0.0, .. } } => {
                viscosity_pa_s
            }
            Model::Casson { viscosity_pa_s, yielding } => {
                let root = viscosity_pa_s.sqrt() + yielding.root_pa_s(g);
                root * root
            }
            Model::Carreau { at_rest_pa_s, at_infinity_pa_s, time_s, exponent } => {
                let share = (1.0 + (time_s * g) * (time_s * g)).powf((exponent - 1.0) / 2.0);
                at_infinity_pa_s + (at_rest_pa_s - at_infinity_pa_s) * share
            }
        }
    }
}

impl Rheology {
    /// The kinematic viscosity at a shear rate, square metres per second.
    pub fn viscosity_m2_s(&self, shear_rate_1_s: f64, density_kg_m3: f64) -> f64 {
        let viscosity_pa_s = self.model.viscosity_pa_s(shear_rate_1_s);
        // `max` and `min` pass over a value that is not a number; the walk that follows must find it.
        let bounded = match viscosity_pa_s.is_nan() {
            true => viscosity_pa_s,
            false => viscosity_pa_s.max(self.minimum_viscosity_pa_s).min(self.maximum_viscosity_pa_s),
        };
        bounded / density_kg_m3
    }

    /// Whether particles of a group are such a fluid.
    pub fn holds_for(&self, group: u8) -> bool {
        self.group.is_none_or(|own| own == group)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const YIELDING: Yielding = Yielding { yield_stress_pa: 8.0, regularisation_s: 100.0 };

    /// `model` at the shear rates 0.5 and 2, worked out by hand; far above `1 / m` nothing is left of the regularisation.
    fn check(model: Model, expected: [f64; 2]) {
        for (g, expected) in [0.5, 2.0].into_iter().zip(expected) {
            let found = model.viscosity_pa_s(g);
            assert!((found / expected - 1.0).abs() < 1e-3, "{model:?} at {g}: {found} {expected}");
        }
    }

    #[test]
    fn viscosities_are_those_worked_out_by_hand() {
        let law = PowerLaw { consistency_pa_s_n: 3.0, exponent: 0.5 };
        let root2 = 2f64.sqrt();
        check(Model::PowerLaw(law), [3.0 * root2, 3.0 / root2]);
        check(Model::PowerLaw(PowerLaw { exponent: 2.0, ..law }), [1.5, 6.0]);
        check(Model::Bingham { plastic_viscosity_pa_s: 1.0, yielding: YIELDING }, [17.0, 5.0]);
        check(
            Model::HerschelBulkley { above: law, yielding: YIELDING },
            [3.0 * root2 + 16.0, 3.0 / root2 + 4.0],
        );
        // (1 + sqrt(16))^2 and (1 + sqrt(4))^2; its regularisation fades as exp(-sqrt(m g)).
        check(
            Model::Casson { viscosity_pa_s: 1.0, yielding: Yielding { regularisation_s: 400.0, ..YIELDING } },
            [25.0, 9.0],
        );
        // 1 + 4 / sqrt(1 + (2 g)^2).
        let carreau = Model::Carreau { at_rest_pa_s: 5.0, at_infinity_pa_s: 1.0, time_s: 2.0, exponent: 0.0 };
        check(carreau, [1.0 + 4.0 / root2, 1.0 + 4.0 / 17f64.sqrt()]);
    }

    #[test]
    fn at_rest_a_yield_stress_is_as_viscous_as_its_regularisation_says() {
        let at_rest = |model: Model| [0.0, 1e-12].map(|g| model.viscosity_pa_s(g));
        let bingham = at_rest(Model::Bingham { plastic_viscosity_pa_s: 1.0, yielding: YIELDING });
        assert!(bingham.iter().all(|mu| (mu / 801.0 - 1.0).abs() < 1e-8), "{bingham:?}");
        let casson = at_rest(Model::Casson { viscosity_pa_s: 1.0, yielding: YIELDING });
        let expected = (1.0 + 800f64.sqrt()).powi(2);
        assert!(casson.iter().all(|mu| (mu / expected - 1.0).abs() < 1e-4), "{casson:?} {expected}");
    }

    #[test]
    fn bounds_hold_and_the_density_makes_it_kinematic() {
        let thinning = Model::PowerLaw(PowerLaw { consistency_pa_s_n: 3.0, exponent: 0.5 });
        let fluid = Rheology {
            model: thinning,
            minimum_viscosity_pa_s: 1.0,
            maximum_viscosity_pa_s: 50.0,
            group: Some(2),
        };
        assert_eq!(fluid.viscosity_m2_s(0.0, 1000.0), 0.05);
        assert_eq!(fluid.viscosity_m2_s(1e6, 1000.0), 0.001);
        assert_eq!(fluid.viscosity_m2_s(1.0, 1000.0), 0.003);
        assert!(fluid.viscosity_m2_s(f64::NAN, 1000.0).is_nan());
        assert!(fluid.holds_for(2) && !fluid.holds_for(0) && Rheology { group: None, ..fluid }.holds_for(0));
    }
}
