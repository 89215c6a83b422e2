//! Cases with known answers, one file a family: what each effect is held to.

pub mod general;
pub mod hydrostatics;
pub mod standing_wave;
pub mod taylor_green;

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
    Case { name: "still water", run: hydrostatics::still },
    Case { name: "full box", run: hydrostatics::closed },
    Case { name: "pools side by side", run: hydrostatics::pools },
    Case { name: "Taylor-Green", run: taylor_green::regular },
    Case { name: "Taylor-Green, jittered", run: taylor_green::jittered },
    Case { name: "standing wave", run: standing_wave::first_mode },
];
