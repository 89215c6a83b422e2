//! Cases with known answers, one file a family: what each effect is held to.

pub mod bodies;
mod carried;
pub mod channel;
pub mod conduction;
pub mod couette;
pub mod decay;
pub mod drop;
pub mod flow_boundaries;
pub mod frame;
pub mod general;
pub mod hydrostatics;
pub mod natural_convection;
pub mod plane;
pub mod poiseuille;
pub mod rheology;
pub mod rotation;
pub mod scalar;
pub mod sessile;
pub mod sphere;
pub mod standing_wave;
pub mod startup;
pub mod taylor_green;
pub mod tension;
pub mod turbulence;
pub mod waves;

/// What a case found.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The effect that the case holds to account.
    pub effect: &'static str,
    /// What was simulated, in a few words.
    pub case: &'static str,
    /// What was compared, with its unit.
    pub quantity: &'static str,
    pub value: f64,
    pub reference: f64,
    /// Relative to the reference unless the quantity says otherwise.
    pub error: f64,
    /// The largest error that passes; infinite for what is only reported.
    pub gate: f64,
    /// Where the reference is from.
    pub source: &'static str,
}

impl Outcome {
    /// Whether the error is within the gate.
    pub fn passes(&self) -> bool {
        self.error.abs() <= self.gate
    }
}

/// A case by name. Coarse runs take seconds, full ones minutes.
#[derive(Debug, Clone, Copy)]
/// A case by name. Coarse runs take seconds, full ones minutes.
pub struct Case {
    pub name: &'static str,
    pub run: fn(Fidelity) -> Result<Vec<Outcome>, String>,
}

/// How finely a case is computed. Coarse runs take seconds, full ones minutes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fidelity {
    Coarse,
    Full,
}

/// All cases.
pub const CASES: &[Case] = &[
    Case { name: "slab-cooling", run: conduction::slab },
    Case { name: "slab-cooling-jittered", run: conduction::jittered_slab },
    Case { name: "bodies-in-contact", run: conduction::contact },
    Case { name: "half-space", run: conduction::half_space },
    Case { name: "heat-flux-wall", run: conduction::flux_wall },
    Case { name: "spreading-dye", run: scalar::spreading },
    Case { name: "spreading-dye-jittered", run: scalar::jittered_spreading },
    Case { name: "natural-convection-1e3", run: natural_convection::rayleigh_1e3 },
    Case { name: "natural-convection-1e4", run: natural_convection::rayleigh_1e4 },
    Case { name: "frame-spiral", run: frame::spiral },
    Case { name: "rotating-cup", run: frame::rotating_cup },
    Case { name: "wavemaker", run: waves::wavemaker },
    Case { name: "tank-period", run: waves::natural_period },
    Case { name: "sway-two-frames", run: waves::two_frames },
    Case { name: "channel-flow", run: flow_boundaries::channel_flow },
    Case { name: "filling-mould", run: flow_boundaries::filling },
    Case { name: "body-free-flight", run: bodies::free_flight },
    Case { name: "floating-box", run: bodies::floating_box },
    Case { name: "heave", run: bodies::heave },
    Case { name: "sinking-box", run: bodies::sinking_box },
    Case { name: "couette", run: couette::run },
    Case { name: "poiseuille", run: poiseuille::run },
    Case { name: "sine-decay", run: decay::run },
    Case { name: "rheology", run: rheology::run },
    Case { name: "rotation", run: rotation::run },
    Case { name: "turbulence", run: turbulence::run },
    Case { name: "still-water", run: hydrostatics::still },
    Case { name: "full-box", run: hydrostatics::closed },
    Case { name: "pools-side-by-side", run: hydrostatics::pools },
    Case { name: "two-layers", run: hydrostatics::two_layers },
    Case { name: "taylor-green", run: taylor_green::regular },
    Case { name: "taylor-green-jittered", run: taylor_green::jittered },
    Case { name: "standing-wave", run: standing_wave::first_mode },
    Case { name: "laplace-jump", run: tension::laplace },
    Case { name: "drop-period", run: tension::rayleigh },
    Case { name: "square-drop", run: tension::rounding },
    Case { name: "laplace-jump-3d", run: sphere::laplace },
    Case { name: "contact-angle", run: sessile::angles },
];
