//! The phases of a step by name, and who listens to them.

use std::fmt;

/// A phase of a step. Its name is the same in every table and file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Phase {
    Gravity,
    Viscosity,
    PotentialTension,
    SurfaceTension,
    PairTerms,
    Move,
    Collision,
    WallContact,
    BucketBuild,
    Relocation,
    NumberDensity,
    BoundaryCondition,
    Source,
    Matrix,
    Connectivity,
    Cg,
    Clamp,
    MinimumPressure,
    PressureGradient,
    Correction,
}

impl Phase {
    /// All phases, in the order in which a step of the paper's scene first meets them.
    pub const ALL: [Phase; 20] = [
        Phase::Gravity,
        Phase::Viscosity,
        Phase::PotentialTension,
        Phase::SurfaceTension,
        Phase::PairTerms,
        Phase::Move,
        Phase::Collision,
        Phase::WallContact,
        Phase::BucketBuild,
        Phase::Relocation,
        Phase::NumberDensity,
        Phase::BoundaryCondition,
        Phase::Source,
        Phase::Matrix,
        Phase::Connectivity,
        Phase::Cg,
        Phase::Clamp,
        Phase::MinimumPressure,
        Phase::PressureGradient,
        Phase::Correction,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Phase::Gravity => "gravity",
            Phase::Viscosity => "viscosity",
            Phase::PotentialTension => "potential_tension",
            Phase::SurfaceTension => "surface_tension",
            Phase::PairTerms => "pair_terms",
            Phase::Move => "move",
            Phase::Collision => "collision",
            Phase::WallContact => "wall_contact",
            Phase::BucketBuild => "bucket_build",
            Phase::Relocation => "relocation",
            Phase::NumberDensity => "number_density",
            Phase::BoundaryCondition => "boundary_condition",
            Phase::Source => "source",
            Phase::Matrix => "matrix",
            Phase::Connectivity => "connectivity",
            Phase::Cg => "cg",
            Phase::Clamp => "clamp",
            Phase::MinimumPressure => "minimum_pressure",
            Phase::PressureGradient => "pressure_gradient",
            Phase::Correction => "correction",
        }
    }

    /// The phases that walk the neighbouring buckets: the paper's "neighbour search".
    pub fn walks_neighbors(self) -> bool {
        matches!(
            self,
            Phase::Viscosity
                | Phase::PotentialTension
                | Phase::SurfaceTension
                | Phase::PairTerms
                | Phase::Collision
                | Phase::WallContact
                | Phase::NumberDensity
                | Phase::Matrix
                | Phase::Connectivity
                | Phase::MinimumPressure
                | Phase::PressureGradient
        )
    }
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Told when a phase begins and ends. The engine has no clock of its own: who wants times hands one in.
pub trait Probe: Send {
    fn begin(&mut self, phase: Phase);
    fn end(&mut self, phase: Phase);
}

/// Listens to nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoProbe;

impl Probe for NoProbe {
    fn begin(&mut self, _: Phase) {}
    fn end(&mut self, _: Phase) {}
}

/// Runs `work` as `phase`.
pub fn within<R>(probe: &mut dyn Probe, phase: Phase, work: impl FnOnce() -> R) -> R {
    probe.begin(phase);
    let result = work();
    probe.end(phase);
    result
}
