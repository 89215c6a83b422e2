//! Cases with known answers, one file a family: what each effect is held to.

pub mod drop;
pub mod tension;

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
