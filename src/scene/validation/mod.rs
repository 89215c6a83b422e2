//! Cases with known answers, one file a family: what each effect is held to.

mod carried;
pub mod conduction;
pub mod scalar;

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
    Case { name: "slab cooling", run: conduction::slab },
    Case { name: "slab cooling, jittered", run: conduction::jittered_slab },
    Case { name: "bodies in contact", run: conduction::contact },
    Case { name: "half space", run: conduction::half_space },
    Case { name: "heat flux wall", run: conduction::flux_wall },
    Case { name: "spreading dye", run: scalar::spreading },
    Case { name: "spreading dye, jittered", run: scalar::jittered_spreading },
];
