//! Orders of particles in memory: the same physical state, laid out in other ways.

use std::cmp::Ordering;
use std::str::FromStr;

use crate::engine::parameters::Parameters;
use crate::engine::particles::InitialParticle;
use crate::engine::search::grid::{BadDomain, Grid};

/// How particles follow one another in every column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MemoryOrder {
    /// As the run left them: the lattice's order at the start, less and less so as particles mix.
    AsAged,
    /// By lattice site, x outermost, z innermost: what a generator would make of the present positions.
    Lattice,
    /// By bucket, and within a bucket as they were.
    CellSorted,
    /// At random.
    Shuffled,
}

/// The seed of the shuffled order: the same in every trial.
const SHUFFLE_SEED: u64 = 1;

impl MemoryOrder {
    const ALL: [MemoryOrder; 4] =
        [MemoryOrder::AsAged, MemoryOrder::Lattice, MemoryOrder::CellSorted, MemoryOrder::Shuffled];

    pub fn name(self) -> &'static str {
        match self {
            MemoryOrder::AsAged => "as-aged",
            MemoryOrder::Lattice => "lattice",
            MemoryOrder::CellSorted => "cell-sorted",
            MemoryOrder::Shuffled => "shuffled",
        }
    }

    /// The particles in this order.
    pub fn arrange(
        self,
        particles: &[InitialParticle],
        parameters: &Parameters,
    ) -> Result<Vec<InitialParticle>, BadDomain> {
        let mut arranged = particles.to_vec();
        match self {
            MemoryOrder::AsAged => {}
            MemoryOrder::Lattice => arranged.sort_by(|a, b| {
                let site =
                    |p: &InitialParticle| p.position.map(|x| (x / parameters.particle_distance_m).round());
                let (a, b) = (site(a), site(b));
                (0..3).map(|d| a[d].total_cmp(&b[d])).find(|o| o.is_ne()).unwrap_or(Ordering::Equal)
            }),
            MemoryOrder::CellSorted => {
                let grid = Grid::new(parameters.domain, parameters.largest_radius_m(), 1)?;
                arranged.sort_by_key(|particle| grid.bucket_at(particle.position));
            }
            MemoryOrder::Shuffled => fastrand::Rng::with_seed(SHUFFLE_SEED).shuffle(&mut arranged),
        }
        Ok(arranged)
    }
}

impl FromStr for MemoryOrder {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        MemoryOrder::ALL.into_iter().find(|order| order.name() == text).ok_or_else(|| {
            let names = MemoryOrder::ALL.map(MemoryOrder::name);
            format!("`{text}` is no memory order: allowed are {}", names.join(", "))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::particles::Kind;
    use crate::scene::library;

    #[test]
    fn every_order_holds_the_same_particles() {
        let scene = library::load("dam-break", &["particle_distance_m=0.075".to_string()]).unwrap();
        let mut particles = scene.particles("test").unwrap();
        let parameters = scene.parameters(&particles);
        let lattice = particles.clone();
        fastrand::Rng::with_seed(7).shuffle(&mut particles);
        for order in MemoryOrder::ALL {
            let arranged = order.arrange(&particles, &parameters).unwrap();
            let count = |kind: Kind| arranged.iter().filter(|p| p.kind == kind).count();
            assert_eq!((arranged.len(), count(Kind::Fluid)), (2680, 72), "{}", order.name());
        }
        assert_eq!(MemoryOrder::Lattice.arrange(&particles, &parameters).unwrap(), lattice);
        assert_eq!(MemoryOrder::AsAged.arrange(&particles, &parameters).unwrap(), particles);
    }
}
