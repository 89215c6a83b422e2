//! One rule an effect: its dimensionless numbers, and the estimated change that leaving it out makes.

use super::{Advice, Scales, Verdict};

type Rule = fn(&Scales, &[&str]) -> Advice;

/// In the order in which people read them. A new effect is one function and one line.
pub const RULES: [Rule; 8] =
    [gravity, viscosity, surface_tension, heat, buoyancy, rheology, turbulence, compressibility];

fn advice(
    effect: &'static str,
    named: bool,
    numbers: Vec<(&'static str, f64)>,
    error: Option<f64>,
    why: impl Into<String>,
) -> Advice {
    let error = error.map(|error| error.clamp(0.0, 1.0));
    Advice { effect, named, numbers, error, verdict: Verdict::of(named, error), why: why.into() }
}

/// `g L / U^2`, the inverse square of the Froude number.
fn gravity(scales: &Scales, named: &[&str]) -> Advice {
    let is_named = named.contains(&"gravity") || named.contains(&"frame");
    let (g, place) = if scales.gravity_m_s2 > 0.0 { (scales.gravity_m_s2, "") } else { (9.8, " on Earth") };
    let froude = scales.speed_m_s / (g * scales.length_m).sqrt();
    advice(
        "gravity",
        is_named,
        vec![("Fr", froude)],
        Some(1.0 / (froude * froude)),
        format!("gravity over inertia is Fr^-2 = g L / U^2{place}"),
    )
}

/// The layer that a wall slows down in the simulated time, `sqrt(nu T)`, over the length.
fn viscosity(scales: &Scales, named: &[&str]) -> Advice {
    let is_named = named.contains(&"viscosity") || named.contains(&"implicit_viscosity");
    let Some(nu) = scales.viscosity_m2_s else {
        return advice("viscosity", is_named, Vec::new(), None, missing("fluid.kinematic_viscosity_m2_s"));
    };
    let layer = (nu * scales.time_s).sqrt() / scales.length_m;
    let (l0, dt) = (scales.particle_distance_m, scales.time_step_s);
    advice(
        "viscosity",
        is_named,
        vec![("Re", scales.speed_m_s * scales.length_m / nu), ("nu dt / l0^2", nu * dt / (l0 * l0))],
        Some(layer),
        "walls slow a layer of sqrt(nu T) down, given over L",
    )
}

/// Capillary pressure `sigma / L` over the larger of `rho U^2` and `rho g L`.
fn surface_tension(scales: &Scales, named: &[&str]) -> Advice {
    let is_named = named.contains(&"surface_tension") || named.contains(&"potential_tension");
    let Some(sigma) = scales.surface_tension_n_m else {
        let key = "fluid.surface_tension_n_m";
        return advice("surface_tension", is_named, Vec::new(), None, missing(key));
    };
    let Scales { length_m: l, speed_m_s: u, density_kg_m3: rho, gravity_m_s2: g, .. } = *scales;
    let (weber, bond) = (rho * u * u * l / sigma, rho * g * l * l / sigma);
    let ruling = weber.max(bond);
    advice(
        "surface_tension",
        is_named,
        vec![("We", weber), ("Bo", bond)],
        Some(if ruling > 0.0 { 1.0 / ruling } else { 1.0 }),
        "capillary pressure over the larger of inertia and weight is 1 / max(We, Bo)",
    )
}

/// The temperature is needed by whoever asks for it; without a difference there is nothing to conduct.
fn heat(scales: &Scales, named: &[&str]) -> Advice {
    let is_named = named.contains(&"heat");
    if !is_named && scales.temperature_difference_k.is_none() {
        return advice("heat", false, Vec::new(), Some(0.0), "no temperatures: nothing to conduct");
    }
    let Some(diffusivity) = scales.thermal_diffusivity_m2_s.filter(|a| *a > 0.0) else {
        let key = "fluid.thermal_diffusivity_m2_s";
        return advice("heat", is_named, Vec::new(), None, missing(key));
    };
    let numbers = vec![
        ("Pe", scales.speed_m_s * scales.length_m / diffusivity),
        ("Fo", diffusivity * scales.time_s / (scales.length_m * scales.length_m)),
    ];
    let differs = scales.temperature_difference_k.unwrap_or(0.0) != 0.0;
    let why = match differs {
        true => "temperatures differ: whoever asks for them needs their transport",
        false => "all temperatures are the same, and stay so",
    };
    advice("heat", is_named, numbers, Some(f64::from(u8::from(differs))), why)
}

/// `g beta dT L / U^2`, the Richardson number; nothing moves below a Rayleigh number of order one.
fn buoyancy(scales: &Scales, named: &[&str]) -> Advice {
    let is_named = named.contains(&"buoyancy");
    let (Some(expansion), Some(difference)) = (scales.thermal_expansion_1_k, scales.temperature_difference_k)
    else {
        let why = match scales.temperature_difference_k {
            None => "no temperatures: the scene names no `heat`".to_string(),
            Some(_) => missing("fluid.thermal_expansion_1_k"),
        };
        let error = scales.temperature_difference_k.is_none().then_some(0.0);
        return advice("buoyancy", is_named, Vec::new(), error, why);
    };
    let Scales { length_m: l, speed_m_s: u, gravity_m_s2: g, .. } = *scales;
    let drive = g * expansion * difference.abs();
    let richardson = drive * l / (u * u);
    let mut numbers = Vec::new();
    let mut error = richardson;
    if let (Some(nu), Some(a)) = (scales.viscosity_m2_s, scales.thermal_diffusivity_m2_s) {
        let rayleigh = drive * l * l * l / (nu * a);
        numbers.push(("Ra", rayleigh));
        error = if rayleigh < 1.0 { 0.0 } else { richardson };
    }
    numbers.push(("Ri", richardson));
    advice(
        "buoyancy",
        is_named,
        numbers,
        Some(error),
        "buoyancy over inertia is Ri; below Ra = 1 nothing moves",
    )
}

/// `Bm / (1 + Bm)` with the Bingham number `tau_y L / (mu U)`: the share of the stress that is the yield stress.
fn rheology(scales: &Scales, named: &[&str]) -> Advice {
    let is_named = named.contains(&"rheology");
    let (Some(stress), Some(nu)) = (scales.yield_stress_pa, scales.viscosity_m2_s) else {
        let (error, why) = match is_named {
            true => (None, "the model has no yield stress: nothing to compare".to_string()),
            false => (Some(0.0), "the fluid is taken to be Newtonian".to_string()),
        };
        return advice("rheology", is_named, Vec::new(), error, why);
    };
    let mu = nu * scales.density_kg_m3;
    let bingham = stress * scales.length_m / (mu * scales.speed_m_s);
    let share = if bingham.is_finite() { bingham / (1.0 + bingham) } else { 1.0 };
    advice(
        "rheology",
        is_named,
        vec![("Bm", bingham)],
        Some(share),
        "the yield stress's share of the stress is Bm / (1 + Bm)",
    )
}

/// What eddies below the particle distance carry, `nu_t = (0.15 l0)^2 U / L`, over `U L`; nothing where the flow is laminar.
fn turbulence(scales: &Scales, named: &[&str]) -> Advice {
    let is_named = named.contains(&"turbulence");
    let Some(nu) = scales.viscosity_m2_s.filter(|nu| *nu > 0.0) else {
        let key = "fluid.kinematic_viscosity_m2_s";
        return advice("turbulence", is_named, Vec::new(), None, missing(key));
    };
    let reynolds = scales.speed_m_s * scales.length_m / nu;
    let eddy = (0.15 * scales.particle_distance_m).powi(2) * scales.speed_m_s / scales.length_m;
    let error = if reynolds < 2000.0 { 0.0 } else { eddy / (scales.speed_m_s * scales.length_m) };
    advice(
        "turbulence",
        is_named,
        vec![("Re", reynolds), ("nu_t / nu", eddy / nu)],
        Some(error),
        "stress of eddies below the particle distance over inertia is nu_t / (U L); none below Re = 2000",
    )
}

/// The scheme's fluid gives way a little: density changes by `Ma^2 / 2`.
fn compressibility(scales: &Scales, named: &[&str]) -> Advice {
    let mach = scales.speed_m_s * (scales.density_kg_m3 * scales.compressibility_1_pa).sqrt();
    let error = 0.5 * mach * mach;
    let mut advice = advice(
        "pressure",
        named.contains(&"pressure"),
        vec![("Ma of the scheme", mach), ("Courant", scales.courant())],
        Some(1.0),
        format!("incompressible: the scheme's own compressibility changes density by Ma^2 / 2 = {error:.1e}"),
    );
    if !advice.named {
        advice.verdict = Verdict::Missing;
        advice.why =
            "without pressure nothing keeps the fluid's volume; right only where nothing compresses it"
                .to_string();
    }
    advice
}

fn missing(key: &str) -> String {
    format!("give `{key}` to know")
}
