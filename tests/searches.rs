//! Every search against brute force, on random particles.

use proptest::prelude::*;
use repro::base::parallel::{Schedule, Team, Workers};
use repro::engine::parameters::Domain;
use repro::engine::particles::Kind;
use repro::engine::search::aos_relocation::AosRelocation;
use repro::engine::search::brute_force::BruteForce;
use repro::engine::search::grid::{Buckets, Grid};
use repro::engine::search::linked_list::LinkedList;
use repro::engine::search::{CandidateSearch, DistanceTest, NONE, Neighborhood, RootFirst, SquaredFirst};

const LARGEST_RADIUS: f64 = 0.31;

/// Neighbours of every particle as `C` and `T` find them, in their order.
fn neighbors<C: CandidateSearch, T: DistanceTest>(
    positions: &[[f64; 3]],
    radius: f64,
    reach: usize,
    workers: &Workers,
) -> Vec<Vec<usize>> {
    let grid = Grid::new(Domain::new([-1.0; 3], [1.0; 3]), LARGEST_RADIUS, reach).unwrap();
    let mut candidates = C::new(&grid, positions.len());
    let mut buckets = Buckets { grid, of_particle: vec![NONE; positions.len()] };
    buckets.assign(&vec![Kind::Fluid; positions.len()], positions, Team::SERIAL);
    candidates.build(&buckets, workers);
    candidates.relocate(positions, Team::SERIAL);
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

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn all_searches_find_what_brute_force_finds(positions in positions(), radius in 0.01..LARGEST_RADIUS, reach in 1..4usize) {
        let workers = Workers::new(2, Schedule::Static, &[]).unwrap();
        let truth = neighbors::<BruteForce, SquaredFirst>(&positions, radius, reach, &workers);
        let list = neighbors::<LinkedList, SquaredFirst>(&positions, radius, reach, &workers);
        let relocated = neighbors::<AosRelocation, RootFirst>(&positions, radius, reach, &workers);
        prop_assert_eq!(&list, &relocated, "both must visit neighbours in the same order");
        prop_assert_eq!(sorted(list), truth);
    }
}
