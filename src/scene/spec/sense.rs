//! Values that no scene can mean: mostly a unit that was taken for another one.
//!
//! The adviser says what a scene could do without; here stands what is refused. The bounds lie so far out that whoever
//! meets one has given millimetres for metres, centipoise for square metres per second or the like.

use crate::base::input::{Check, InputError};
use crate::base::vec3::{Vec3, dot};
use crate::scene::Scene;

/// Spacings of particles from a molecule's to a county's, metres.
const DISTANCES_M: [f64; 2] = [1e-9, 1e6];
/// From a rarefied gas to several times the densest metal, kg/m3.
const DENSITIES_KG_M3: [f64; 2] = [1e-4, 1e5];
/// More than peanut butter in a scene of metres, m2/s; water has 1e-6.
const THICKEST_M2_S: f64 = 0.5;
/// More than bitumen, for fluids whose viscosity is implicit in time, m2/s.
const THICKEST_IMPLICIT_M2_S: f64 = 1e5;
/// A thousand times graphite's in a scene of metres, m2/s; water has 1.4e-7.
const MOST_DIFFUSIVE_M2_S: f64 = 1.0;
/// Several times that of molten metals, N/m; water has 0.072.
const TAUTEST_N_M: f64 = 10.0;
/// A hundred times that of air, 1/Pa; water has 0.45e-9.
const SOFTEST_1_PA: f64 = 1e-3;
/// A hundred times that of gases, 1/K.
const MOST_EXPANSIVE_1_K: f64 = 1.0;
/// Five hundred times standard gravity, m/s2: centrifuges are below.
const STRONGEST_M_S2: f64 = 5000.0;
/// Steps that carry a particle, or what diffuses, a hundred times as far as any scheme bears.
const LONGEST: f64 = 100.0;
/// The weight of a particle over the tension at its size (Bond), and its inertia over it (Weber).
const MOST_OVER_TENSION: [f64; 2] = [1e3, 1e6];

impl Scene {
    /// Refuses what cannot be meant. All values are known to be finite.
    pub(super) fn check_sense(&self, check: Check<'_>) -> Result<(), InputError> {
        self.check_properties(check)?;
        self.check_accelerations(check)?;
        self.check_step(check)?;
        self.check_tension(check)
    }

    fn check_properties(&self, check: Check<'_>) -> Result<(), InputError> {
        let allowed = |key: &str, value: Option<f64>, [from, to]: [f64; 2], remedy: &str| {
            let allowed = format!("allowed are numbers from {from:e} to {to:e}: {remedy}");
            let value = value.unwrap_or(from);
            check.require((from..=to).contains(&value), key, value, allowed)
        };
        allowed("particle_distance_m", Some(self.particle_distance_m), DISTANCES_M, "give it in metres")?;
        let (fluid, effects) = (&self.fluid, &self.effects);
        let in_kg = "give it in kg/m3; water has 1000";
        allowed("fluid.density_kg_m3", Some(fluid.density_kg_m3), DENSITIES_KG_M3, in_kg)?;
        let (of_size, implicit) = (self.by_size(), effects.implicit_viscosity.as_ref());
        let explicit = [0.0, THICKEST_M2_S * of_size];
        let thickest = if implicit.is_some() { [0.0, THICKEST_IMPLICIT_M2_S * of_size] } else { explicit };
        let in_m2 = "give it in m2/s: 1 cP over 1000 kg/m3 is 1e-6 m2/s, water's; thicker fluids need \
                     `effects.implicit_viscosity`";
        let key = |effect: &str| format!("effects.{effect}.kinematic_viscosity_m2_s");
        let of_viscosity = effects.viscosity.as_ref().map(|table| table.kinematic_viscosity_m2_s);
        allowed(&key("viscosity"), of_viscosity, explicit, in_m2)?;
        let of_implicit = implicit.map(|table| table.kinematic_viscosity_m2_s);
        allowed(&key("implicit_viscosity"), of_implicit, thickest, "give it in m2/s: water has 1e-6")?;
        allowed("fluid.kinematic_viscosity_m2_s", fluid.kinematic_viscosity_m2_s, thickest, in_m2)?;
        let in_n = "give it in N/m; water has 0.072";
        for (key, value) in [
            ("fluid", fluid.surface_tension_n_m),
            ("effects.surface_tension", effects.surface_tension.as_ref().map(|t| t.surface_tension_n_m)),
            ("effects.potential_tension", effects.potential_tension.as_ref().map(|t| t.surface_tension_n_m)),
        ] {
            allowed(&format!("{key}.surface_tension_n_m"), value, [0.0, TAUTEST_N_M], in_n)?;
        }
        let softest = effects.pressure.as_ref().map(|table| table.compressibility_1_pa);
        let inverse = "give the inverse of the bulk modulus, in 1/Pa; water has 0.45e-9";
        allowed("effects.pressure.compressibility_1_pa", softest, [0.0, SOFTEST_1_PA], inverse)?;
        let expansion = effects.buoyancy.as_ref().map(|table| table.expansion_1_k);
        let range = [-MOST_EXPANSIVE_1_K, MOST_EXPANSIVE_1_K];
        allowed("effects.buoyancy.expansion_1_k", expansion, range, "give it in 1/K; air has 3.4e-3")?;
        let range = [0.0, MOST_DIFFUSIVE_M2_S * of_size];
        let diffusive = "give it in m2/s; water conducts heat with 1.4e-7";
        for (key, value) in self.diffusivities() {
            allowed(key, value, range, diffusive)?;
        }
        for (k, group) in self.group.iter().enumerate() {
            let key = |name: &str| format!("group[{k}].{name}");
            allowed(&key("density_kg_m3"), group.density_kg_m3, DENSITIES_KG_M3, in_kg)?;
            let viscosity = group.kinematic_viscosity_m2_s;
            allowed(&key("kinematic_viscosity_m2_s"), viscosity, thickest, in_m2)?;
            let conducting = group.thermal_diffusivity_m2_s;
            allowed(&key("thermal_diffusivity_m2_s"), conducting, range, diffusive)?;
            allowed(&key("diffusivity_m2_s"), group.diffusivity_m2_s, range, diffusive)?;
        }
        Ok(())
    }

    /// How fast heat and a scalar spread, with the keys that say so.
    fn diffusivities(&self) -> [(&'static str, Option<f64>); 3] {
        let heat = self.effects.heat.as_ref().and_then(|_| self.thermal_diffusivity_m2_s());
        let conducts = self.effects.heat.as_ref().is_some_and(|heat| heat.conductivity_w_m_k.is_some());
        let key = match conducts {
            true => "effects.heat.conductivity_w_m_k over density and heat capacity",
            false => "effects.heat.thermal_diffusivity_m2_s",
        };
        [
            (key, heat),
            ("effects.scalar.diffusivity_m2_s", self.effects.scalar.as_ref().map(|s| s.diffusivity_m2_s)),
            ("fluid.thermal_diffusivity_m2_s", self.fluid.thermal_diffusivity_m2_s),
        ]
    }

    fn check_accelerations(&self, check: Check<'_>) -> Result<(), InputError> {
        let allowed = format!("allowed are up to {STRONGEST_M_S2} m/s2: give it in m/s2, on Earth 9.8");
        let require = |key: &str, size: f64| check.require(size <= STRONGEST_M_S2, key, size, &allowed);
        require("effects.gravity.acceleration_m_s2", length(self.gravity_m_s2()))?;
        for (k, shaking) in self.effects.frame.iter().flat_map(|frame| &frame.harmonic).enumerate() {
            require(&format!("effects.frame.harmonic[{k}].amplitude_m_s2"), shaking.amplitude_m_s2.abs())?;
        }
        Ok(())
    }

    /// Refuses steps that are hundreds of times too long, and adaptive ones that may not become shorter.
    fn check_step(&self, check: Check<'_>) -> Result<(), InputError> {
        let (key, step_s) = match &self.adaptive_time_step {
            Some(adaptive) => ("adaptive_time_step.shortest_s", adaptive.shortest_s),
            None => ("time_step_s", self.time_step_s),
        };
        let l0 = self.particle_distance_m;
        let diffusive = |diffusivity_m2_s: f64| l0 * l0 / diffusivity_m2_s;
        let explicit = self.effects.viscosity.as_ref().map_or(0.0, |v| v.kinematic_viscosity_m2_s);
        let sigma = self.named_tension().map_or(0.0, |(_, sigma)| sigma);
        let [heat, scalar, _] = self.diffusivities().map(|(_, value)| value.unwrap_or(0.0));
        let limits = [
            (l0 / self.fastest_m_s(), "the fastest particle moves its own distance", "velocities"),
            ((l0 / length(self.gravity_m_s2())).sqrt(), "a particle falls its own distance", "gravity"),
            (diffusive(explicit), "viscosity spreads over a particle distance", "`effects.viscosity`"),
            (diffusive(heat), "heat spreads over a particle distance", "`effects.heat`"),
            (diffusive(scalar), "the scalar spreads over a particle distance", "`effects.scalar`"),
            (
                (self.fluid.density_kg_m3 * l0 * l0 * l0 / sigma).sqrt(),
                "a wave of tension runs over a particle distance",
                "the surface tension",
            ),
        ];
        for (longest_s, what, whose) in limits {
            let most_s = LONGEST * longest_s;
            let allowed = format!(
                "allowed are steps up to {most_s:.1e} s, {LONGEST} times the one in which {what}: lower it, or check the \
                 units of `particle_distance_m` and {whose}"
            );
            check.require(step_s <= most_s, key, step_s, allowed)?;
        }
        Ok(())
    }

    /// Refuses a surface tension that cannot be seen: one of millimetres in a scene whose lengths are read as metres.
    fn check_tension(&self, check: Check<'_>) -> Result<(), InputError> {
        let Some((effect, sigma)) = self.named_tension() else { return Ok(()) };
        let (rho, l0, u) = (self.fluid.density_kg_m3, self.particle_distance_m, self.fastest_m_s());
        let bond = rho * length(self.gravity_m_s2()) * l0 * l0 / sigma;
        let weber = rho * u * u * l0 / sigma;
        for (name, what, number, most) in [
            ("Bond", "weight", bond, MOST_OVER_TENSION[0]),
            ("Weber", "inertia", weber, MOST_OVER_TENSION[1]),
        ] {
            let key = format!("effects.{effect}.surface_tension_n_m");
            let allowed = format!(
                "the {what} of one particle is {number:.1e} times its tension ({name} number), allowed are {most:e}: check \
                 the units of `particle_distance_m` and `geometry`, which are metres, or leave the effect out"
            );
            check.require(number <= most, &key, sigma, allowed)?;
        }
        Ok(())
    }

    /// The tension that acts, if any does, with its effect.
    fn named_tension(&self) -> Option<(&'static str, f64)> {
        let surface =
            self.effects.surface_tension.as_ref().map(|t| ("surface_tension", t.surface_tension_n_m));
        let potential =
            self.effects.potential_tension.as_ref().map(|t| ("potential_tension", t.surface_tension_n_m));
        surface.or(potential).filter(|(_, sigma)| *sigma > 0.0)
    }

    fn gravity_m_s2(&self) -> Vec3 {
        self.effects.gravity.as_ref().map_or([0.0; 3], |gravity| gravity.acceleration_m_s2)
    }

    /// An upper estimate of the speed at the start, of what drives the fluid, and of a fall through all of the lattice.
    fn fastest_m_s(&self) -> f64 {
        let (gravity, extent) = (self.gravity_m_s2(), self.geometry.lattice.extent_m);
        let fall = (0..3).map(|d| 2.0 * gravity[d].abs() * extent[d]).sum::<f64>().sqrt();
        let fields = self.geometry.region.iter().filter_map(|region| region.velocity_field.as_ref());
        let turning = fields.map(|field| {
            let rate = length(field.rotation_rad_s) + field.gradient_1_s.map(length).iter().sum::<f64>();
            rate * length(extent)
        });
        let regions = self.geometry.region.iter().filter_map(|region| region.velocity_m_s);
        let single = self.geometry.particle.iter().map(|particle| particle.velocity_m_s);
        let speeds = regions.chain(single).map(length);
        speeds.chain(turning).fold(fall.max(self.driven_speed_m_s()), f64::max)
    }

    /// By how much a scene of more than ten metres may be more viscous: as in a model at the scale of Froude.
    fn by_size(&self) -> f64 {
        (length(self.geometry.lattice.extent_m) / 10.0).max(1.0).powf(1.5)
    }
}

fn length(vector: Vec3) -> f64 {
    dot(vector, vector).sqrt()
}
