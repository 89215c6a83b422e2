//! Cases with known answers, one file a family: what each effect is held to.

pub mod bodies;
pub mod flow_boundaries;
pub mod frame;
pub mod general;
pub mod hydrostatics;
pub mod plane;
pub mod standing_wave;
pub mod taylor_green;
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
    /// The largest error that passes.
    pub gate: f64,
    /// Where the reference is from.
    pub source: &'static str,
}

/// A case by name. Coarse runs take seconds, full ones minutes.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    pub name: &'static str,
    pub run: fn(Fidelity) -> Result<Vec<Outcome>, String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fidelity {
    Coarse,
    Full,
}

/// All cases.
pub const CASES: &[Case] = &[
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
    Case { name: "still water", run: hydrostatics::still },
    Case { name: "full box", run: hydrostatics::closed },
    Case { name: "pools side by side", run: hydrostatics::pools },
    Case { name: "Taylor-Green", run: taylor_green::regular },
    Case { name: "Taylor-Green, jittered", run: taylor_green::jittered },
    Case { name: "standing wave", run: standing_wave::first_mode },
];
