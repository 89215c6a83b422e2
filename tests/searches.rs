//! Every search against brute force, on random particles.

use proptest::prelude::*;
use repro::base::parallel::{Team, Workers};
use repro::engine::parameters::Domain;
use repro::engine::particles::Kind;
use repro::engine::search::aos_relocation::AosRelocation;
use repro::engine::search::aosoa::Aosoa;
use repro::engine::search::brute_force::BruteForce;
use repro::engine::search::cell_list::CellList;
use repro::engine::search::clusters::Clusters;
use repro::engine::search::grid::{Buckets, Grid};
use repro::engine::search::linked_list::LinkedList;
use repro::engine::search::neighbor_list::{Moved, NeighborList};
use repro::engine::search::periodic::Periodic;
use repro::engine::search::soa::Soa;
use repro::engine::search::sorted_particles::SortedParticles;
use repro::engine::search::{
    CandidateSearch, DistanceTest, Lengths, NONE, Neighborhood, Now, RootFirst, SquaredFirst,
};

const LARGEST_RADIUS: f64 = 0.31;

/// Neighbours of every particle as `C` and `T` find them, in their order.
fn neighbors<C: CandidateSearch, T: DistanceTest>(
    positions: &[[f64; 3]],
    radius: f64,
    reach: usize,
    workers: &Workers,
) -> Vec<Vec<usize>> {
    neighbors_in::<C, T>(Domain::new([-1.0; 3], [1.0; 3]), positions, radius, reach, workers)
}

fn neighbors_in<C: CandidateSearch, T: DistanceTest>(
    domain: Domain,
    positions: &[[f64; 3]],
    radius: f64,
    reach: usize,
    workers: &Workers,
) -> Vec<Vec<usize>> {
    let grid = Grid::new(domain, LARGEST_RADIUS, reach).unwrap();
    let lengths = Lengths { particle_distance_m: 0.1, small_m: 0.21, large_m: LARGEST_RADIUS };
    let mut candidates = C::new(&grid, lengths, positions.len());
    let mut buckets = Buckets { grid, of_particle: vec![NONE; positions.len()] };
    buckets.assign(&vec![Kind::Fluid; positions.len()], positions, true, Team::SERIAL);
    let kind = |&bucket: &u32| if bucket == NONE { Kind::Ghost } else { Kind::Fluid };
    let kind: Vec<Kind> = buckets.of_particle.iter().map(kind).collect();
    let now = Now { kind: &kind, position: positions, radius_m: LARGEST_RADIUS, walls_moved: false };
    candidates.build(&buckets, now, workers);
    candidates.relocate(&buckets, positions, workers.scheduled());
    let near = Neighborhood { candidates: &candidates, buckets: &buckets, positions };
    (0..positions.len())
        .map(|i| {
            let mut found = Vec::new();
            if buckets.of_particle[i] != NONE {
                near.for_each_neighbor::<T>(i, radius, |j, _, _| found.push(j));
            }
            found
        })
        .collect()
}

fn sorted(mut lists: Vec<Vec<usize>>) -> Vec<Vec<usize>> {
    lists.iter_mut().for_each(|list| list.sort_unstable());
    lists
}

/// Positions inside the domain and a few outside, some of them crowded into one bucket.
fn positions() -> impl Strategy<Value = Vec<[f64; 3]>> {
    let anywhere = prop::array::uniform3(-1.2..1.2f64);
    let crowded = prop::array::uniform3(0.0..0.1f64);
    prop::collection::vec(prop_oneof![anywhere, crowded], 1..120)
}

const PERIODS: [f64; 3] = [0.4, 1.0, 0.5];

fn inside_of_periods() -> impl Strategy<Value = Vec<[f64; 3]>> {
    let place = prop::array::uniform3(0.0..1.0f64).prop_map(|x| [0, 1, 2].map(|d| x[d] * PERIODS[d]));
    prop::collection::vec(place, 1..80)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn all_searches_find_what_brute_force_finds(positions in positions(), radius in 0.01..LARGEST_RADIUS, reach in 1..4usize) {
        let workers = Workers::new(2, "dynamic:7".parse().unwrap(), &[]).unwrap();
        let truth = neighbors::<BruteForce, SquaredFirst>(&positions, radius, reach, &workers);
        let list = neighbors::<LinkedList, SquaredFirst>(&positions, radius, reach, &workers);
        let others = [
            ("relocation", neighbors::<AosRelocation, RootFirst>(&positions, radius, reach, &workers)),
            ("cell list", neighbors::<CellList, SquaredFirst>(&positions, radius, reach, &workers)),
            ("sorted particles", neighbors::<SortedParticles, SquaredFirst>(&positions, radius, reach, &workers)),
            ("neighbour list", neighbors::<NeighborList<u32>, SquaredFirst>(&positions, radius, reach, &workers)),
            ("structure of arrays", neighbors::<Soa, SquaredFirst>(&positions, radius, reach, &workers)),
            ("blocks", neighbors::<Aosoa, RootFirst>(&positions, radius, reach, &workers)),
        ];
        for (name, found) in others {
            prop_assert_eq!(&list, &found, "{} must visit neighbours in the same order", name);
        }
        prop_assert_eq!(&sorted(list), &truth);
        // In an order of their own.
        let clusters = neighbors::<Clusters, SquaredFirst>(&positions, radius, reach, &workers);
        prop_assert_eq!(sorted(clusters), truth);
    }

    /// Periods so short that a particle meets some others twice, and from both sides.
    #[test]
    fn all_searches_see_the_same_images(positions in inside_of_periods(), radius in 0.01..LARGEST_RADIUS, reach in 1..4usize) {
        let workers = Workers::new(2, "dynamic:7".parse().unwrap(), &[]).unwrap();
        let domain = Domain { periodic: [true, false, true], ..Domain::new([0.0; 3], PERIODS) };
        let list = neighbors_in::<Periodic<LinkedList>, SquaredFirst>(domain, &positions, radius, reach, &workers);
        let others = [
            ("cell list", neighbors_in::<Periodic<CellList>, SquaredFirst>(domain, &positions, radius, reach, &workers)),
            ("sorted particles", neighbors_in::<Periodic<SortedParticles>, SquaredFirst>(domain, &positions, radius, reach, &workers)),
            ("neighbour list", neighbors_in::<NeighborList<Moved>, SquaredFirst>(domain, &positions, radius, reach, &workers)),
            ("structure of arrays", neighbors_in::<Periodic<Soa>, SquaredFirst>(domain, &positions, radius, reach, &workers)),
            ("blocks", neighbors_in::<Periodic<Aosoa>, SquaredFirst>(domain, &positions, radius, reach, &workers)),
        ];
        for (name, found) in others {
            prop_assert_eq!(&list, &found, "{} must visit neighbours in the same order", name);
        }
        // In an order of their own.
        let clusters = neighbors_in::<Clusters, SquaredFirst>(domain, &positions, radius, reach, &workers);
        prop_assert_eq!(sorted(clusters), sorted(list));
    }
}
