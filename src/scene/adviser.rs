//! Which effects a scene calls for: its dimensionless numbers, and what leaving an effect out would change.
//!
//! Every judgement rests on an estimate: the size of the term over the largest other one, from the scene's own length,
//! speed and time. It is an order of magnitude, good enough to tell a thousandth from a tenth, and it says so.

mod rules;
mod scales;

use serde::Serialize;

pub use scales::Scales;

/// Below this estimated change of the flow an effect is negligible.
pub const THRESHOLD: f64 = 0.01;

/// What is said about one effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Advice {
    /// Its key in the scene.
    pub effect: &'static str,
    pub named: bool,
    /// The numbers behind it, each with its symbol.
    pub numbers: Vec<(&'static str, f64)>,
    /// The change of the flow that leaving it out makes, of the order of this share; `None` where it is not known.
    pub error: Option<f64>,
    pub verdict: Verdict,
    /// Why, or what is missing to know.
    pub why: String,
}

impl Advice {
    /// Whether it is about the effect of that name: several effects may be models of one.
    pub fn judges(&self, name: &str) -> bool {
        let also = [
            ("implicit_viscosity", "viscosity"),
            ("potential_tension", "surface_tension"),
            ("frame", "gravity"),
        ];
        self.effect == name || also.contains(&(name, self.effect))
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Named, and the scene calls for it.
    Needed,
    /// Named, and hardly changes anything.
    Negligible,
    /// Not named, and it would change the flow.
    Missing,
    /// Not named, and would hardly change anything.
    NotNeeded,
    /// What the fluid is like is not known.
    Unknown,
}

impl Verdict {
    pub fn in_words(self) -> &'static str {
        match self {
            Verdict::Needed => "named and called for",
            Verdict::Negligible => "named but negligible",
            Verdict::Missing => "absent but not negligible",
            Verdict::NotNeeded => "absent and negligible",
            Verdict::Unknown => "not known",
        }
    }

    fn of(named: bool, error: Option<f64>) -> Verdict {
        match (named, error) {
            (_, None) => Verdict::Unknown,
            (true, Some(error)) if error >= THRESHOLD => Verdict::Needed,
            (true, Some(_)) => Verdict::Negligible,
            (false, Some(error)) if error >= THRESHOLD => Verdict::Missing,
            (false, Some(_)) => Verdict::NotNeeded,
        }
    }
}

/// What there is to say about all effects that can be judged from a scene's scales, in the order of [`rules`].
pub fn advise(scales: &Scales, named: &[&str]) -> Vec<Advice> {
    rules::RULES.iter().map(|rule| rule(scales, named)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Water in a tank of a metre.
    fn tank() -> Scales {
        Scales {
            length_m: 1.0,
            speed_m_s: 4.4,
            time_s: 2.0,
            particle_distance_m: 0.02,
            time_step_s: 1e-3,
            density_kg_m3: 1000.0,
            gravity_m_s2: 9.8,
            viscosity_m2_s: Some(1e-6),
            surface_tension_n_m: Some(0.072),
            ..Scales::default()
        }
    }

    fn verdict(scales: &Scales, named: &[&str], effect: &str) -> (Verdict, Advice) {
        let advice = advise(scales, named).into_iter().find(|advice| advice.effect == effect).unwrap();
        (advice.verdict, advice)
    }

    #[test]
    fn a_tank_of_water_calls_for_gravity_and_for_neither_viscosity_nor_surface_tension() {
        let named = ["gravity", "viscosity"];
        assert_eq!(verdict(&tank(), &named, "gravity").0, Verdict::Needed);
        let (found, viscosity) = verdict(&tank(), &named, "viscosity");
        // sqrt(1e-6 m2/s x 2 s) over 1 m, and 4.4 m/s x 1 m / 1e-6 m2/s.
        assert_eq!(found, Verdict::Negligible);
        assert!((viscosity.error.unwrap() - 2e-6_f64.sqrt()).abs() < 1e-12);
        assert!((viscosity.numbers[0].1 - 4.4e6).abs() < 1e-3);
        let (found, tension) = verdict(&tank(), &named, "surface_tension");
        // Bo = 1000 x 9.8 / 0.072.
        assert_eq!(found, Verdict::NotNeeded);
        assert!((tension.numbers[1].1 - 136_111.1).abs() < 1.0, "{tension:?}");
    }

    #[test]
    fn a_drop_of_a_millimetre_calls_for_surface_tension() {
        let drop = Scales { length_m: 1e-3, speed_m_s: 0.1, time_s: 0.01, ..tank() };
        assert_eq!(verdict(&drop, &["gravity"], "surface_tension").0, Verdict::Missing);
        assert_eq!(verdict(&drop, &["surface_tension"], "surface_tension").0, Verdict::Needed);
    }

    #[test]
    fn honey_calls_for_viscosity_and_what_is_not_known_is_said() {
        let honey = Scales { viscosity_m2_s: Some(7e-3), ..tank() };
        assert_eq!(verdict(&honey, &[], "viscosity").0, Verdict::Missing);
        let (found, advice) = verdict(&Scales { viscosity_m2_s: None, ..tank() }, &[], "viscosity");
        assert_eq!(found, Verdict::Unknown);
        assert!(advice.why.contains("fluid.kinematic_viscosity_m2_s"), "{}", advice.why);
    }

    /// Air between plates of a centimetre, 10 K apart: Ra = 9.8 x 3.4e-3 x 10 x 1e-6 / (1.5e-5 x 2.1e-5) = 1058.
    #[test]
    fn warm_air_calls_for_buoyancy() {
        let air = Scales {
            length_m: 0.01,
            speed_m_s: (9.8f64 * 3.4e-3 * 10.0 * 0.01).sqrt(),
            viscosity_m2_s: Some(1.5e-5),
            thermal_diffusivity_m2_s: Some(2.1e-5),
            thermal_expansion_1_k: Some(3.4e-3),
            temperature_difference_k: Some(10.0),
            ..tank()
        };
        let (found, advice) = verdict(&air, &["gravity", "heat"], "buoyancy");
        assert_eq!(found, Verdict::Missing);
        assert!((advice.numbers[0].1 - 1057.8).abs() < 1.0, "{advice:?}");
        let still = Scales { temperature_difference_k: Some(0.0), ..air };
        assert_eq!(verdict(&still, &["gravity", "heat", "buoyancy"], "buoyancy").0, Verdict::Negligible);
    }
}
