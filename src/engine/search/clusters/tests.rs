//! Lists against a search through all pairs.

use super::*;
use crate::engine::parameters::Domain;
use crate::engine::search::{Neighborhood, SquaredFirst};

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
        let [dummies_of_mobile, walls_of_mobile, mobile_of_mobile] = &clusters.mobile[..] else { panic!() };
        let all = [
            (dummies_of_mobile, mobile, Section::DummyWall, clusters.reach()),
            (walls_of_mobile, mobile, walls, clusters.reach()),
            (mobile_of_mobile, mobile, mobile, clusters.reach()),
            (&clusters.wall[0], walls, Section::DummyWall, resting),
            (&clusters.wall[1], walls, walls, resting),
            (&clusters.wall_mobile[0], walls, mobile, clusters.reach()),
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

/// The same crowd with ends along x and, in space, along z, where the period is shorter than two radii; some move out.
fn endless(plane: bool) -> (Domain, Vec<Kind>, Vec<Vec3>) {
    let (mut domain, mut kind, mut position) = crowd(plane);
    domain.periodic = [true, false, !plane];
    domain.high[2] *= 0.45;
    for (k, x) in position.iter_mut().enumerate() {
        x[2] *= 0.45;
        if k % 100 == 0 && x[1] < 0.85 {
            x[0] = 1.2 - 5e-7 * (k + 1) as f64;
            kind[k] = Kind::Fluid;
        }
    }
    (domain, kind, position)
}

fn built(domain: Domain, kind: &[Kind], position: &[Vec3]) -> (Clusters, Buckets, Workers) {
    let grid = grid::Grid::new(domain, LENGTHS.large_m, 1).unwrap();
    let mut clusters = Clusters::new(&grid, LENGTHS, kind.len());
    let buckets = Buckets { grid, of_particle: vec![0; kind.len()] };
    let workers = Workers::new(2, "dynamic:1".parse().unwrap(), &[]).unwrap();
    take_up(&mut clusters, &buckets, kind, position, &workers);
    (clusters, buckets, workers)
}

fn take_up(clusters: &mut Clusters, buckets: &Buckets, kind: &[Kind], position: &[Vec3], workers: &Workers) {
    let now = Now { kind, position, radius_m: LENGTHS.large_m, walls_moved: false };
    workers.install(|| clusters.build(buckets, now, workers));
}

/// Places of `j` to tenths of a nanometre, in which images that are one period apart differ and rounding does not.
fn named(j: u32, x: Vec3) -> (u32, [i64; 3]) {
    (j, x.map(|x| (x * 1e10).round() as i64))
}

/// All particles of a section and their images.
fn everyone(domain: &Domain, kind: &[Kind], position: &[Vec3], section: Section) -> Vec<(u32, Vec3)> {
    let steps = domain.periodic.map(|periodic| if periodic { -2..=2 } else { 0..=0 });
    let mut all = Vec::new();
    for (i, x) in (0..).zip(position).filter(|&(i, _)| section_of(kind[i as usize]) == Some(section)) {
        for a in steps[0].clone() {
            for c in steps[2].clone() {
                let shift = [
                    f64::from(a) * (domain.high[0] - domain.low[0]),
                    0.0,
                    f64::from(c) * (domain.high[2] - domain.low[2]),
                ];
                all.push((i, add(*x, shift)));
            }
        }
    }
    all
}

#[test]
fn lists_name_everyone_across_the_ends_once() {
    for plane in [false, true] {
        let (domain, kind, position) = endless(plane);
        let (clusters, _, _) = built(domain, &kind, &position);
        let slots = &clusters.slots;
        let resting = Reach { small_m: LENGTHS.small_m, large_m: LENGTHS.large_m };
        let all = [
            (Section::Mobile, &clusters.mobile, clusters.reach()),
            (Section::Wall, &clusters.wall, resting),
            (Section::Wall, &clusters.wall_mobile, clusters.reach()),
        ];
        for (of, lists, reach) in all {
            for pair in lists.chunks(2) {
                let over =
                    Section::HOMES.into_iter().find(|home| home.images() == pair[0].over().images()).unwrap();
                let there = everyone(&domain, &kind, &position, over);
                for cluster in slots.clusters(of) {
                    let lanes = cluster * LANES..cluster * LANES + slots.filled_lanes(of, cluster);
                    for (reach_m, small) in [(reach.small_m, true), (reach.large_m, false)] {
                        let near = |x: Vec3| {
                            lanes.clone().any(|lane| {
                                let r = sub(x, slots.place(lane));
                                dot(r, r) < reach_m * reach_m
                            })
                        };
                        let mut expected: Vec<_> =
                            there.iter().filter(|&&(_, x)| near(x)).map(|&(j, x)| named(j, x)).collect();
                        let listed = pair.iter().flat_map(|lists| lists.of(cluster).reaching(small));
                        let mut found: Vec<_> = listed
                            .map(|&slot| named(slots.particle[slot as usize], slots.place(slot as usize)))
                            .collect();
                        expected.sort_unstable();
                        found.sort_unstable();
                        assert_eq!(found, expected, "{of:?} {over:?} {small}");
                    }
                }
            }
        }
    }
}

/// What has crossed an end since lists were made has all its neighbours still, from the same lists.
#[test]
fn who_crosses_an_end_keeps_its_lists() {
    for plane in [false, true] {
        let (domain, kind, mut position) = endless(plane);
        let (mut clusters, buckets, workers) = built(domain, &kind, &position);
        let mut crossed = 0;
        for (x, _) in position.iter_mut().zip(&kind).filter(|(_, kind)| kind.moves()) {
            x[0] += 0.02 * L0;
            x[1] += 0.01 * L0;
            if x[0] >= 1.2 {
                x[0] -= 1.2;
                crossed += 1;
            }
        }
        take_up(&mut clusters, &buckets, &kind, &position, &workers);
        assert!(clusters.generation == 1 && crossed > 5, "{} {crossed}", clusters.generation);
        let there = Section::HOMES.map(|section| everyone(&domain, &kind, &position, section)).concat();
        let near = Neighborhood { candidates: &clusters, buckets: &buckets, positions: &position };
        for i in (0..kind.len()).filter(|&i| kind[i] != Kind::Ghost) {
            let within = |r: Vec3| dot(r, r) < LENGTHS.large_m * LENGTHS.large_m;
            let mut expected: Vec<_> = there
                .iter()
                .map(|&(j, x)| (j, sub(x, position[i])))
                .filter(|&(j, r)| j as usize != i && within(r))
                .map(|(j, r)| named(j, r))
                .collect();
            let mut found = Vec::new();
            near.for_each_neighbor::<SquaredFirst>(i, LENGTHS.large_m, |j, r, _| {
                found.push(named(j as u32, r));
            });
            expected.sort_unstable();
            found.sort_unstable();
            assert_eq!(found, expected, "{i} {:?}", kind[i]);
        }
    }
}
