//! How a simulation is computed, as opposed to what: the presets and the options that a preset sets.

use std::fmt;
use std::num::NonZeroUsize;
use std::str::FromStr;

use crate::base::schedule::Schedule;
use crate::engine::pressure::conjugate_gradient::CgParams;
use crate::engine::pressure::matrix::Storage;
use crate::engine::pressure::preconditioner::Preconditioning;
use crate::engine::pressure::values::MatrixValues;

/// A neighbour search by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Search {
    LinkedList,
    AosRelocation,
    BruteForce,
    Clusters,
    CellList,
    SortedParticles,
    NeighborList,
    Soa,
    Aosoa,
}

impl Search {
    /// Whether taking roots before the distance test is compiled for it: the paper's two.
    pub fn takes_roots_first(self) -> bool {
        matches!(self, Search::LinkedList | Search::AosRelocation)
    }
}

/// How distances are compared, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Test {
    Sqrt,
    Squared,
}

/// Everything that may change the time of a simulation. The answer depends on `cg.tolerance`, `cg.preconditioner` and
/// `matrix_values` and, since it decides the order of summation, on `buckets_per_radius`; on nothing else, to the last bit,
/// but for two rarities: brute force sums in an order of its own, and the two distance tests may round a pair that lies
/// exactly on a radius to different sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    pub search: Search,
    pub distance_test: Test,
    /// How many buckets side by side are as long as the largest influence radius.
    pub buckets_per_radius: NonZeroUsize,
    pub storage: Storage,
    /// Of the pressure's matrix.
    pub matrix_values: MatrixValues,
    pub schedule: Schedule,
    pub cg: CgParams,
    pub pair_terms: PairTerms,
    pub dry_walls: DryWalls,
}

/// How often the pairs of one radius are walked for the explicit forces and rates of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PairTerms {
    /// Once for each effect, as the textbook's separate passes are.
    Separate,
    /// Once for all effects of that radius, where there are two or more.
    Shared,
    /// As `Shared`, by a step composed for every effect, even where a scene names the textbook's alone: with relocation and
    /// against `Separate` it shows what effects cost that are compiled in but not named.
    Joined,
}

/// What walls that no fluid comes near are in the pressure's equations of clusters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DryWalls {
    /// Unknowns like all others.
    Solved,
    /// Known pressures, worked out once for walls without any fluid. The answer changes by less than the solver's tolerance.
    Known,
}

/// The most buckets that a radius may reach across: a walk then visits 729.
pub const MAX_BUCKETS_PER_RADIUS: usize = 4;

/// The searches by preset name. The paper's two differ in this one field, and so do those from `general` on, which are for
/// scenes of other effects.
const PRESETS: [(&str, Search); 11] = [
    ("paper-linked-list", Search::LinkedList),
    ("paper-aos-relocation", Search::AosRelocation),
    ("brute-force", Search::BruteForce),
    ("general", Search::AosRelocation),
    ("cell-list", Search::CellList),
    ("sorted-particles", Search::SortedParticles),
    ("neighbor-list", Search::NeighborList),
    ("soa", Search::Soa),
    ("aosoa", Search::Aosoa),
    ("fast", Search::Clusters),
    ("fast-all-walls", Search::Clusters),
];

/// A named set of options.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Preset(usize);

impl Preset {
    pub const PAPER_LINKED_LIST: Preset = Preset(0);
    pub const PAPER_AOS_RELOCATION: Preset = Preset(1);
    /// Relocation with squared distances, packed rows and one walk for all explicit pair terms of a radius.
    pub const GENERAL: Preset = Preset(3);
    /// Clusters with one list for all phases, and the list as the matrix.
    pub const FAST: Preset = Preset(9);
    /// The same with unknowns in walls that no fluid comes near.
    pub const FAST_ALL_WALLS: Preset = Preset(10);
    /// The two that the paper compares.
    pub const PAPER: [Preset; 2] = [Preset::PAPER_LINKED_LIST, Preset::PAPER_AOS_RELOCATION];

    pub fn all() -> impl Iterator<Item = Preset> {
        (0..PRESETS.len()).map(Preset)
    }

    pub fn name(self) -> &'static str {
        PRESETS[self.0].0
    }

    /// The preset's options: what the paper states or, where it is silent, what ARCHITECTURE.md says.
    pub fn options(self) -> Options {
        let (general, fast) = (self.0 >= Preset::GENERAL.0, self.0 >= Preset::FAST.0);
        Options {
            search: PRESETS[self.0].1,
            distance_test: if general { Test::Squared } else { Test::Sqrt },
            buckets_per_radius: NonZeroUsize::MIN,
            storage: if general { Storage::Csr } else { Storage::Ell },
            matrix_values: if fast { MatrixValues::F32 } else { MatrixValues::F64 },
            schedule: Schedule::Dynamic(const { std::num::NonZeroUsize::new(64).unwrap() }),
            cg: CgParams {
                preconditioner: if fast { Preconditioning::TwoLevel } else { Preconditioning::None },
                ..CgParams::default()
            },
            pair_terms: if general { PairTerms::Shared } else { PairTerms::Separate },
            dry_walls: if self == Preset::FAST { DryWalls::Known } else { DryWalls::Solved },
        }
    }
}

impl fmt::Display for DryWalls {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            DryWalls::Solved => "solved",
            DryWalls::Known => "known",
        })
    }
}

impl FromStr for DryWalls {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "solved" => Ok(DryWalls::Solved),
            "known" => Ok(DryWalls::Known),
            _ => Err(format!("`{text}` is nothing that dry walls can be: allowed are `solved` or `known`")),
        }
    }
}

impl fmt::Display for PairTerms {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            PairTerms::Separate => "separate",
            PairTerms::Shared => "shared",
            PairTerms::Joined => "joined",
        })
    }
}

impl FromStr for PairTerms {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "separate" => Ok(PairTerms::Separate),
            "shared" => Ok(PairTerms::Shared),
            "joined" => Ok(PairTerms::Joined),
            _ => Err(format!("`{text}` is no way to walk: allowed are `separate`, `shared` or `joined`")),
        }
    }
}

impl fmt::Display for Preset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Preset {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Preset::all().find(|preset| preset.name() == text).ok_or_else(|| {
            let names: Vec<&str> = Preset::all().map(Preset::name).collect();
            format!("`{text}` is no preset: allowed are {}", names.join(", "))
        })
    }
}

impl fmt::Display for Test {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Test::Sqrt => "sqrt",
            Test::Squared => "squared",
        })
    }
}

impl FromStr for Test {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "sqrt" => Ok(Test::Sqrt),
            "squared" => Ok(Test::Squared),
            _ => Err(format!("`{text}` is no distance test: allowed are `sqrt` or `squared`")),
        }
    }
}
