//! Lists against a search through all pairs.

use super::*;
use crate::engine::parameters::Domain;

const L0: f64 = 0.05;
const LENGTHS: Lengths = Lengths { particle_distance_m: L0, small_m: 2.1 * L0, large_m: 3.1 * L0 };

/// Fluid in the middle of a disordered crowd, walls around it and dummy walls outside, in space or in a plane.
fn crowd(plane: bool) -> (Domain, Vec<Kind>, Vec<Vec3>) {
    let mut random = fastrand::Rng::with_seed(11);
    let depth = if plane { 0.0 } else { 0.5 };
    let domain = Domain::new([0.0; 3], [1.2, 0.9, depth]);
    let positions: Vec<Vec3> =
        (0..1500).map(|_| [1.2 * random.f64(), 0.9 * random.f64(), depth * random.f64()]).collect();
    let kind = |x: &Vec3| match x[0].min(1.2 - x[0]).min(x[1]) {
        outside if outside < 0.1 => Kind::DummyWall,
        outside if outside < 0.2 => Kind::Wall,
        _ if x[1] > 0.85 => Kind::Ghost,
        _ => Kind::Fluid,
    };
    (domain, positions.iter().map(kind).collect(), positions)
}

/// The slots of `over` within `reach_m` of a lane of the cluster, ascending.
fn reached(clusters: &Clusters, of: Section, over: Section, cluster: usize, reach_m: f64) -> Vec<u32> {
    let points = &clusters.slots.points;
    let lanes = cluster * LANES..cluster * LANES + clusters.slots.filled_lanes(of, cluster);
    let distance2 = |a: &[f64; 4], b: &[f64; 4]| (0..3).map(|d| (a[d] - b[d]) * (a[d] - b[d])).sum::<f64>();
    let near =
        |slot: &usize| lanes.clone().any(|lane| distance2(&points[lane], &points[*slot]) < reach_m * reach_m);
    clusters.slots.of(over).filter(near).map(|slot| slot as u32).collect()
}

fn ascending(slots: &[u32]) -> Vec<u32> {
    let mut slots = slots.to_vec();
    slots.sort_unstable();
    slots
}

#[test]
fn lists_name_everyone_within_reach_once() {
    for plane in [false, true] {
        let (domain, kind, position) = crowd(plane);
        let grid = grid::Grid::new(domain, LENGTHS.large_m, 1).unwrap();
        let mut clusters = Clusters::new(&grid, LENGTHS, kind.len());
        let buckets = Buckets { grid, of_particle: Vec::new() };
        let workers = Workers::new(2, "dynamic:1".parse().unwrap(), &[]).unwrap();
        let now = Now { kind: &kind, position: &position, radius_m: LENGTHS.large_m, walls_moved: false };
        workers.install(|| clusters.build(&buckets, now, &workers));
        let [walls, mobile] = [Section::Wall, Section::Mobile];
        let resting = Reach { small_m: LENGTHS.small_m, large_m: LENGTHS.large_m };
        let [dummies_of_mobile, walls_of_mobile, mobile_of_mobile] = &clusters.mobile;
        let all = [
            (dummies_of_mobile, mobile, Section::DummyWall, clusters.reach()),
            (walls_of_mobile, mobile, walls, clusters.reach()),
            (mobile_of_mobile, mobile, mobile, clusters.reach()),
            (&clusters.wall[0], walls, Section::DummyWall, resting),
            (&clusters.wall[1], walls, walls, resting),
            (&clusters.wall_mobile, walls, mobile, clusters.reach()),
        ];
        for (lists, of, over, reach) in all {
            let mut listed = 0;
            for cluster in clusters.slots.clusters(of) {
                let Near { small, all, own } = lists.of(cluster);
                assert_eq!(
                    ascending(small),
                    reached(&clusters, of, over, cluster, reach.small_m),
                    "{of:?} {over:?}"
                );
                assert_eq!(
                    ascending(all),
                    reached(&clusters, of, over, cluster, reach.large_m),
                    "{of:?} {over:?}"
                );
                let first = (cluster * LANES) as u32;
                let lanes = if of == over { clusters.slots.filled_lanes(of, cluster) } else { 0 };
                assert_eq!(all[..own], (first..first + lanes as u32).collect::<Vec<_>>());
                listed += all.len();
            }
            assert!(listed > 100, "{of:?} over {over:?}: {listed}");
        }
    }
}
