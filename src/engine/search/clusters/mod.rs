//! Clusters of eight particles and one list for each of them, which serves all phases of a step.
//!
//! Fluid and bodies, walls and dummy walls are each sorted into flat cells; eight that follow one another make a cluster,
//! a lane of a vector each. Its list names all particles that may lie within the largest radius of any lane, and
//! a little further, so that it holds while particles move by that little: it is made where the pressure is computed and
//! still serves the viscosity of the next step. Half of a list's lanes are true neighbours; in exchange a walk is
//! sequential, branches hardly at all and computes eight pairs at once. After the cluster pair lists of molecular dynamics
//! (Pall & Hess, Computer Physics Communications 184, 2013).
//!
//! Walls do not move in most scenes: they are sorted and their lists among themselves made once.

mod cells;
mod lists;
mod slots;
#[cfg(test)]
mod tests;

use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

use crate::base::parallel::{Rows, Team, Workers};
use crate::base::simd::LANES;
use crate::base::vec3::{Vec3, ZERO, dot, sub};
use crate::engine::columns::{Column, Visitor};
use crate::engine::particles::Kind;
use crate::engine::search::grid::{self, Buckets};
use crate::engine::search::{CandidateSearch, Lengths, NONE, Now};
use cells::{Cells, Grid};
use lists::{Around, Candidates, Crossed};
pub use lists::{CHUNK, Lists, Near, Reach};
pub use slots::{FAR, Lanes, Section, Slots};

/// By how much lists reach further than the largest radius, in particle distances: as much as particles moved between the
/// making of lists and the first walk after it, lately, and a little more, but no more than what a longer list is worth.
const LEAST_SKIN: f64 = 0.05;
const MOST_SKIN: f64 = 0.4;
const MORE: f64 = 1.3;
/// How fast what was needed is forgotten, a making of lists.
const REMEMBERED: f64 = 0.95;

#[derive(Debug)]
pub struct Clusters {
    lengths: Lengths,
    pub slots: Slots,
    grid: Grid,
    cells: [Cells; 3],
    crossed: Crossed,
    around_mobile: Around,
    /// Of the mobile clusters over all three sections.
    pub mobile: [Lists; 3],
    /// Of the wall clusters over dummy walls and walls, made when walls move.
    pub wall: [Lists; 2],
    /// Of the wall clusters over mobile ones.
    pub wall_mobile: Lists,
    /// Counts how often walls were sorted: what was worked out from their places holds while it stays.
    pub walls_sorted: usize,
    /// The particles of each section.
    members: [Vec<u32>; 3],
    /// The kinds and positions that the lists were made from.
    kind: Vec<Kind>,
    built_at: Vec<Vec3>,
    /// How often lists were made; what a restored state says it was, if it differs, makes them anew.
    generation: usize,
    built: usize,
    /// The furthest that a particle has moved since, metres.
    moved_m: f64,
    /// In particle distances: the skin of the lists, the one that the first walk since they were made called for, and the
    /// one that was needed lately.
    skin: f64,
    called_for: f64,
    needed: f64,
}

impl Clusters {
    fn reach(&self) -> Reach {
        let Lengths { particle_distance_m, small_m, large_m } = self.lengths;
        let skin_m = self.skin * particle_distance_m;
        // The small lists are for walks over the places that lists were made from: density and gradient.
        Reach { small_m, large_m: large_m + skin_m }
    }

    /// Whether a walk over the small lists finds all pairs within `radius_m` where particles are now. Resting walls among
    /// themselves need no skin.
    pub fn small_reaches(&self, radius_m: f64) -> bool {
        radius_m + 2.0 * self.moved_m <= self.reach().small_m
    }

    /// Sorts walls and dummy walls, and makes the lists among them.
    fn build_static(&mut self, positions: &[Vec3], team: Team<'_>) {
        for section in [Section::DummyWall, Section::Wall] {
            self.sort(section, positions, team);
        }
        // Walls do not move towards one another.
        let Lengths { small_m, large_m, .. } = self.lengths;
        let reach = Reach { small_m, large_m };
        let mut around = Around::new(Section::Wall);
        around.find(&self.slots, &self.grid, large_m, team);
        for (lists, cells) in self.wall.iter_mut().zip(&self.cells) {
            lists.build(&self.slots, Candidates::Around(cells, &around), reach, team);
        }
        self.walls_sorted += 1;
    }

    fn sort(&mut self, section: Section, positions: &[Vec3], team: Team<'_>) {
        let slots = self.slots.of(section);
        // Sorted from the particles' own order, so that the order does not depend on the one before.
        self.cells[section as usize].sort(
            &self.grid,
            &self.members[section as usize],
            positions,
            &mut self.slots.particle[slots],
            team,
        );
        self.slots.renumber(section);
        self.slots.gather(section, positions, team);
    }

    /// Whether the same particles are walls and dummy walls as when lists were made.
    fn walls_are_those_of(&self, kinds: &[Kind]) -> bool {
        let wall = |kind: &Kind| section_of(*kind).filter(|&section| section != Section::Mobile);
        self.kind.iter().map(wall).eq(kinds.iter().map(wall))
    }

    /// Makes all lists from the particles at `positions`; those among walls, if `walls_too`.
    fn build_at(&mut self, kinds: &[Kind], positions: &[Vec3], walls_too: bool, team: Team<'_>) {
        let anew = walls_too || self.kind != kinds;
        if anew {
            self.kind.clear();
            self.kind.extend_from_slice(kinds);
            self.members.iter_mut().for_each(Vec::clear);
            for (i, &kind) in (0..).zip(kinds) {
                if let Some(section) = section_of(kind) {
                    self.members[section as usize].push(i);
                }
            }
            self.slots.lay_out(self.members.each_ref().map(Vec::len), kinds.len());
            for (slot, &kind) in self.slots.of_particle.iter_mut().zip(kinds) {
                if section_of(kind).is_none() {
                    *slot = NONE;
                }
            }
        }
        if walls_too {
            self.build_static(positions, team);
        }
        self.sort(Section::Mobile, positions, team);
        let reach = self.reach();
        self.around_mobile.find(&self.slots, &self.grid, reach.large_m, team);
        for (lists, cells) in self.mobile.iter_mut().zip(&self.cells) {
            lists.build(&self.slots, Candidates::Around(cells, &self.around_mobile), reach, team);
        }
        self.crossed.find(&self.mobile[Section::Wall as usize], &self.slots);
        self.wall_mobile.build(&self.slots, Candidates::Crossed(&self.crossed), reach, team);
        self.built_at.resize(positions.len(), ZERO);
        team.evenly().fill(Rows::new(&mut self.built_at), |range, built_at| {
            built_at.copy_from_slice(&positions[range]);
        });
        self.moved_m = 0.0;
    }

    /// Calls `stop_at` for the particles within `radius` of particle `i` until it returns true. Compiled once, with a virtual
    /// call a neighbour: what an effect computes for a pair would otherwise be compiled into every loop here.
    fn any_listed(
        &self,
        positions: &[Vec3],
        i: usize,
        radius: f64,
        stop_at: &mut dyn FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        let (here, radius2) = (positions[i], radius * radius);
        let mut is_hit = |slot: usize| {
            let j = self.slots.particle[slot] as usize;
            let r = sub(positions[j], here);
            dot(r, r) < radius2 && stop_at(j, &positions[j])
        };
        let cluster = self.slots.of_particle[i] as usize / LANES;
        let lists: [Option<&Lists>; 3] = match section_of(self.kind[i]) {
            Some(Section::Mobile) => self.mobile.each_ref().map(Some),
            Some(Section::Wall) => [Some(&self.wall[0]), Some(&self.wall[1]), Some(&self.wall_mobile)],
            Some(Section::DummyWall) => return self.any_around(here, is_hit),
            None => return false,
        };
        lists
            .into_iter()
            .flatten()
            .any(|lists| lists.of(cluster).all.iter().any(|&slot| is_hit(slot as usize)))
    }

    /// Looks at all particles around a place that has no list.
    fn any_around(&self, place: Vec3, mut is_hit: impl FnMut(usize) -> bool) -> bool {
        let mut runs = Vec::new();
        self.grid.runs(place, place, self.reach().large_m, &mut runs);
        Section::ALL.into_iter().zip(&self.cells).any(|(section, cells)| {
            let first = self.slots.of(section).start;
            runs.iter().any(|&run| cells.in_run(run).any(|k| is_hit(first + k)))
        })
    }

    /// The furthest that a particle of fluid or a body is from where the lists were made.
    fn furthest(&self, positions: &[Vec3], team: Team<'_>) -> f64 {
        let mobile = &self.members[Section::Mobile as usize];
        let square = |&i: &u32| {
            let moved = sub(positions[i as usize], self.built_at[i as usize]);
            dot(moved, moved)
        };
        // Of numbers that are not negative the bits are in the numbers' order.
        let furthest = AtomicU64::new(0);
        team.evenly().run(mobile.len(), |range| {
            let of_range = mobile[range].iter().map(square).fold(0.0, f64::max);
            furthest.fetch_max(of_range.to_bits(), Relaxed);
        });
        f64::from_bits(furthest.into_inner()).sqrt()
    }
}

/// What short lists get beyond their share.
const SPARE: usize = 16;

/// Makes a list at least so long. What grows from step to step gets an eighth more than it needs and some, instead of twice as much.
pub fn make_room<T: Copy>(list: &mut Vec<T>, length: usize, filling: T) {
    if list.len() < length {
        if list.capacity() < length {
            list.reserve_exact(length + length / 8 + SPARE - list.len());
        }
        list.resize(length, filling);
    }
}

fn section_of(kind: Kind) -> Option<Section> {
    match kind {
        Kind::Fluid | Kind::Body => Some(Section::Mobile),
        Kind::Wall => Some(Section::Wall),
        Kind::DummyWall => Some(Section::DummyWall),
        Kind::Ghost => None,
    }
}

impl CandidateSearch for Clusters {
    fn new(grid: &grid::Grid, lengths: Lengths, _count: usize) -> Self {
        let grid = Grid::new(grid.domain(), lengths.particle_distance_m);
        let cells = || Cells::new(&grid);
        Clusters {
            lengths,
            slots: Slots::default(),
            cells: [cells(), cells(), cells()],
            grid,
            crossed: Crossed::default(),
            around_mobile: Around::new(Section::Mobile),
            mobile: Section::ALL.map(|over| Lists::new(Section::Mobile, over)),
            wall: [Section::DummyWall, Section::Wall].map(|over| Lists::new(Section::Wall, over)),
            wall_mobile: Lists::new(Section::Wall, Section::Mobile),
            walls_sorted: 0,
            members: Default::default(),
            kind: Vec::new(),
            built_at: Vec::new(),
            generation: 0,
            built: usize::MAX,
            moved_m: f64::INFINITY,
            skin: LEAST_SKIN,
            called_for: f64::INFINITY,
            needed: 0.0,
        }
    }

    fn build(&mut self, _buckets: &Buckets, now: Now<'_>, workers: &Workers) {
        let team = workers.scheduled_over(CHUNK * LANES);
        if self.built != self.generation && !self.built_at.is_empty() {
            // A state was put back: the lists are made as they were in it.
            let (kind, built_at) = (std::mem::take(&mut self.kind), std::mem::take(&mut self.built_at));
            self.build_at(&kind, &built_at, true, team);
            self.built = self.generation;
        }
        let same_kinds = self.kind == now.kind;
        let walls_rest = self.built == self.generation
            && !now.walls_moved
            && (same_kinds || self.walls_are_those_of(now.kind));
        self.built = self.generation;
        if walls_rest && same_kinds {
            self.moved_m = self.furthest(now.position, team);
            if now.radius_m == self.lengths.large_m && self.called_for == f64::INFINITY {
                self.called_for = 2.0 * self.moved_m / self.lengths.particle_distance_m;
                if MORE * self.called_for <= MOST_SKIN {
                    self.needed = self.called_for.max(REMEMBERED * self.needed);
                }
            }
            if self.reaches(now.radius_m) {
                self.slots.gather(Section::Mobile, now.position, team);
                return;
            }
        }
        self.skin = (MORE * self.needed).max(LEAST_SKIN);
        self.called_for = f64::INFINITY;
        self.generation += 1;
        self.built = self.generation;
        self.build_at(now.kind, now.position, !walls_rest, team);
    }

    fn reaches(&self, radius_m: f64) -> bool {
        radius_m + 2.0 * self.moved_m <= self.reach().large_m
    }

    const RELOCATES: bool = false;

    fn any_in_bucket(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        bucket: usize,
        mut stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        let inside = |&i: &usize| buckets.of_particle[i] as usize == bucket;
        (0..positions.len()).filter(inside).any(|i| stop_at(i, &positions[i]))
    }

    #[inline]
    fn any_candidate(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        i: usize,
        enter: impl Fn(usize) -> bool,
        mut stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        let bucket = &buckets.of_particle;
        self.any_listed(positions, i, f64::INFINITY, &mut |j, x| enter(bucket[j] as usize) && stop_at(j, x))
    }

    #[inline]
    fn any_candidate_near(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        i: usize,
        radius: f64,
        enter: impl Fn(usize) -> bool,
        mut stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        let bucket = &buckets.of_particle;
        self.any_listed(positions, i, radius, &mut |j, x| enter(bucket[j] as usize) && stop_at(j, x))
    }

    fn visit(&mut self, visitor: &mut Visitor<'_>) {
        visitor("list_generation", Column::Count(&mut self.generation));
        visitor("list_skin", Column::Number(&mut self.skin));
        visitor("list_skin_called_for", Column::Number(&mut self.called_for));
        visitor("list_skin_needed", Column::Number(&mut self.needed));
        visitor("list_kind", Column::Kinds(&mut self.kind));
        visitor("list_position", Column::Vectors(&mut self.built_at));
    }

    fn bytes(&self) -> usize {
        let lists = self.mobile.iter().chain(&self.wall).chain([&self.wall_mobile]);
        self.slots.bytes()
            + self.members.iter().map(Vec::capacity).sum::<usize>() * size_of::<u32>()
            + self.cells.iter().map(Cells::bytes).sum::<usize>()
            + self.crossed.bytes()
            + self.around_mobile.bytes()
            + lists.map(Lists::bytes).sum::<usize>()
            + self.kind.capacity()
            + self.built_at.capacity() * size_of::<Vec3>()
    }
}
