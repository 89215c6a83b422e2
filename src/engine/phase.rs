//! The phases of a step by name, and who listens to them.

use std::fmt;

/// Makes the list of phases: a line a phase with its name in every table and file, and `walks` where it walks the
/// neighbouring buckets.
macro_rules! phases {
    ($($phase:ident $name:literal $($walks:ident)?,)+) => {
        /// A phase of a step.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Phase {
            $($phase,)+
        }

        impl Phase {
            /// All phases, in the order in which a step first meets them.
            pub const ALL: [Phase; [$($name),+].len()] = [$(Phase::$phase),+];

            /// The name in every table and file.
            pub fn name(self) -> &'static str {
                match self {
                    $(Phase::$phase => $name,)+
                }
            }

            /// Whether it walks the neighbouring buckets: the paper's "neighbour search".
            pub fn walks_neighbors(self) -> bool {
                match self {
                    $(Phase::$phase => phases!(@walks $($walks)?),)+
                }
            }
        }
    };
    (@walks walks) => {
        true
    };
    (@walks) => {
        false
    };
}

phases! {
    FlowBoundaries "flow_boundaries",
    WallMotion "wall_motion",
    Gravity "gravity",
    Buoyancy "buoyancy",
    Frame "frame",
    WallMirror "wall_mirror" walks,
    StrainRate "strain_rate" walks,
    Viscosity "viscosity" walks,
    Heat "heat" walks,
    Scalar "scalar" walks,
    PotentialTension "potential_tension" walks,
    PairTerms "pair_terms" walks,
    ImplicitViscosity "implicit_viscosity",
    Move "move",
    Collision "collision" walks,
    WallContact "wall_contact" walks,
    BucketBuild "bucket_build",
    Relocation "relocation",
    NumberDensity "number_density" walks,
    BoundaryCondition "boundary_condition",
    SurfaceTension "surface_tension" walks,
    Source "source",
    Matrix "matrix" walks,
    Connectivity "connectivity" walks,
    Cg "cg",
    Clamp "clamp",
    MinimumPressure "minimum_pressure" walks,
    PressureGradient "pressure_gradient" walks,
    Correction "correction",
    RigidBodies "rigid_bodies",
    Shifting "shifting" walks,
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
