//! Steady plane Poiseuille flow of generalised Newtonian fluids, implicit steps from rest until nothing changes.
//!
//! Half height `h`, pressure gradient `G = rho F`. The wall's shear stress is `G h` whatever the fluid.

use crate::engine::effects::gravity::Gravity;
use crate::engine::effects::rheology::{Model, PowerLaw, Rheology, Yielding};
use crate::engine::parameters::Property;
use crate::engine::viscous::{Form, Walls};
use crate::scene::validation::channel::{self, Channel, Scheme};
use crate::scene::validation::{Fidelity, Outcome};

const DENSITY_KG_M3: f64 = 1000.0;
/// `h`, metres.
const HALF_M: f64 = 0.5;
/// `F`, metres per second squared: so small that nothing moves to speak of.
const FORCE_M_S2: f64 = 1e-6;
/// `G h`, Pa.
const WALL_STRESS_PA: f64 = DENSITY_KG_M3 * FORCE_M_S2 * HALF_M;
/// Of the Newtonian part, Pa s.
const VISCOSITY_PA_S: f64 = 1000.0;
/// The wall's shear rate of a Newtonian fluid, 1/s.
const RATE_1_S: f64 = WALL_STRESS_PA / VISCOSITY_PA_S;

/// `tau_y`, Pa.
const YIELD_STRESS_PA: f64 = 0.3 * WALL_STRESS_PA;

/// `tau_y` with `m` such that `m g = exponent` at 5 % of the wall's shear rate, itself a share of [`RATE_1_S`]: there the
/// stress is to be that of the fluid with a sharp yield stress to 2 %.
fn yielding(wall_rate: f64, exponent: f64) -> Yielding {
    let regularisation_s = exponent / (0.05 * wall_rate * RATE_1_S);
    Yielding { yield_stress_pa: YIELD_STRESS_PA, regularisation_s }
}

/// A fluid, and its velocity at height `y` above mid-channel.
struct Fluid {
    case: &'static str,
    model: Model,
    exact: fn(f64) -> f64,
}

/// The consistency with which a power-law fluid has the Newtonian shear rate at the wall, Pa s^n.
fn power_law(exponent: f64) -> PowerLaw {
    PowerLaw { consistency_pa_s_n: WALL_STRESS_PA / RATE_1_S.powf(exponent), exponent }
}

fn fluids() -> Vec<Fluid> {
    vec![
        Fluid {
            case: "plane Poiseuille flow, power law n = 0.5",
            model: Model::PowerLaw(power_law(0.5)),
            exact: |y| herschel_bulkley(y, power_law(0.5), 0.0),
        },
        Fluid {
            case: "plane Poiseuille flow, power law n = 1.5",
            model: Model::PowerLaw(power_law(1.5)),
            exact: |y| herschel_bulkley(y, power_law(1.5), 0.0),
        },
        Fluid {
            case: "plane Poiseuille flow, Bingham",
            model: Model::Bingham { plastic_viscosity_pa_s: VISCOSITY_PA_S, yielding: yielding(0.7, 3.81) },
            exact: |y| herschel_bulkley(y, power_law(1.0), YIELD_STRESS_PA),
        },
        Fluid {
            case: "plane Poiseuille flow, Herschel-Bulkley n = 0.7",
            model: Model::HerschelBulkley { above: power_law(0.7), yielding: yielding(0.6, 3.67) },
            exact: |y| herschel_bulkley(y, power_law(0.7), YIELD_STRESS_PA),
        },
        Fluid {
            case: "plane Poiseuille flow, Casson",
            model: Model::Casson { viscosity_pa_s: VISCOSITY_PA_S, yielding: yielding(0.2046, 19.7) },
            exact: casson,
        },
    ]
}

/// `n / (n + 1) / G K^(-1/n) ((G h - tau_y)^((n + 1) / n) - (G |y| - tau_y)^((n + 1) / n))`, the plug flat: Bingham's
/// where `n = 1`, a power law's where `tau_y = 0`.
fn herschel_bulkley(y: f64, law: PowerLaw, yield_stress_pa: f64) -> f64 {
    let (n, gradient) = (law.exponent, DENSITY_KG_M3 * FORCE_M_S2);
    let power = |stress: f64| stress.max(0.0).powf((n + 1.0) / n);
    let [wall, here] = [HALF_M, y.abs()].map(|y| power(gradient * y - yield_stress_pa));
    n / (n + 1.0) / gradient * law.consistency_pa_s_n.powf(-1.0 / n) * (wall - here)
}

/// `(G (h^2 - y^2) / 2 - 4/3 sqrt(G tau_y) (h^(3/2) - y^(3/2)) + tau_y (h - y)) / mu`, the plug flat.
fn casson(y: f64) -> f64 {
    let (gradient, yield_stress) = (DENSITY_KG_M3 * FORCE_M_S2, YIELD_STRESS_PA);
    let y = y.abs().max(yield_stress / gradient);
    let square = gradient * (HALF_M * HALF_M - y * y) / 2.0;
    let root = 4.0 / 3.0 * (gradient * yield_stress).sqrt() * (HALF_M.powf(1.5) - y.powf(1.5));
    (square - root + yield_stress * (HALF_M - y)) / VISCOSITY_PA_S
}

/// The centre's velocity at the end and the L2 error of the profile.
fn flow(across: usize, fluid: &Fluid, form: Form) -> Result<(f64, f64), String> {
    let channel = Channel { across, width_m: 2.0 * HALF_M, upper_wall_m_s: 0.0 };
    let scheme = Scheme { name: "implicit", implicit: true, form };
    let mut effects = scheme.effects(Property::Uniform(0.0), Walls::Mirrored);
    effects.gravity = Some(Gravity { acceleration_m_s2: [FORCE_M_S2, 0.0, 0.0] });
    effects.rheology = Some(Rheology {
        model: fluid.model,
        minimum_viscosity_pa_s: 0.01 * VISCOSITY_PA_S,
        maximum_viscosity_pa_s: 1000.0 * VISCOSITY_PA_S,
        group: None,
    });
    let mut simulation = channel::build(&channel.parameters(0.1, effects), &channel.at_rest())?;
    let mut before = f64::INFINITY;
    for _ in 0..100 {
        channel::advance(simulation.as_mut(), 5)?;
        let profile = channel.profile(simulation.particles());
        let centre = profile[across / 2].1;
        if (centre - before).abs() < 1e-5 * centre {
            let error = channel::relative_l2(&profile, |y| (fluid.exact)(y - HALF_M));
            return Ok((centre, error));
        }
        before = centre;
    }
    Err(format!("{}: no steady state", fluid.case))
}

/// All fluids at 40 particles across; 80 in full.
pub fn run(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    run_at(if fidelity == Fidelity::Full { 80 } else { 40 })
}

/// The velocities at mid-channel, and the profiles, at a resolution. Bingham's fluid in both forms.
pub fn run_at(across: usize) -> Result<Vec<Outcome>, String> {
    let mut outcomes = Vec::new();
    for fluid in fluids() {
        outcomes.extend(compared(across, &fluid, Form::Laplacian)?);
    }
    let bingham =
        Fluid { case: "plane Poiseuille flow, Bingham, angular-momentum form", ..fluids().swap_remove(2) };
    outcomes.extend(compared(across, &bingham, Form::AngularMomentum)?);
    Ok(outcomes)
}

fn compared(across: usize, fluid: &Fluid, form: Form) -> Result<[Outcome; 2], String> {
    let (value, error) = flow(across, fluid, form)?;
    // The middle layer lies half a particle distance beside mid-channel.
    let reference = (fluid.exact)(HALF_M / across as f64);
    let centre = Outcome {
        effect: "rheology",
        case: fluid.case,
        quantity: "velocity at mid-channel, m/s",
        value,
        reference,
        error: (value / reference - 1.0).abs(),
        gate: 0.03,
        source: "closed form of a sharp yield stress, accuracy.md, section 13",
    };
    let quantity = "velocity at mid-channel, m/s; error: L2 of the profile";
    Ok([centre.clone(), Outcome { quantity, error, ..centre }])
}
