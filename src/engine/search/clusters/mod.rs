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

use crate::base::parallel::{Team, Workers};
use crate::base::simd::LANES;
use crate::base::vec3::{Vec3, dot, sub};
use crate::engine::columns::{Column, Visitor};
use crate::engine::particles::Kind;
use crate::engine::search::grid::{Buckets, Grid};
use crate::engine::search::{CandidateSearch, Lengths, NONE, Now};
use cells::Cells;
pub use lists::{CHUNK, Lists, Near, Reach};
pub use slots::{FAR, Lanes, Section, Slots};

/// How much further than the largest radius lists reach, in particle distances.
const SKIN: f64 = 0.1;

#[derive(Debug)]
pub struct Clusters {
    lengths: Lengths,
    pub slots: Slots,
    cells: [Cells; 3],
    /// Of the mobile clusters over all three sections.
    pub mobile: [Lists; 3],
    /// Of the wall clusters over dummy walls and walls, made when walls move.
    pub wall: [Lists; 2],
    /// Of the wall clusters over mobile ones.
    pub wall_mobile: Lists,
    /// Counts how often walls were sorted: what was worked out from their places holds while it stays.
    pub walls_sorted: usize,
    /// The particles of the section that is sorted.
    members: Vec<u32>,
    /// The kinds and positions that the lists were made from.
    kind: Vec<Kind>,
    built_at: Vec<Vec3>,
    /// How often lists were made; what a restored state says it was, if it differs, makes them anew.
    generation: usize,
    built: usize,
    /// The furthest that a particle has moved since, metres.
    moved_m: f64,
}

impl Clusters {
    fn reach(&self) -> Reach {
        let Lengths { particle_distance_m, small_m, large_m } = self.lengths;
        let skin_m = SKIN * particle_distance_m;
        Reach { small_m: small_m + skin_m, large_m: large_m + skin_m }
    }

    /// Whether a walk over the near parts finds all pairs within `radius_m` where particles are now.
    pub fn small_reaches(&self, radius_m: f64) -> bool {
        radius_m + 2.0 * self.moved_m <= self.reach().small_m
    }

    /// Sorts walls and dummy walls, and makes the lists among them.
    fn build_static(&mut self, positions: &[Vec3], team: Team<'_>) {
        for section in [Section::DummyWall, Section::Wall] {
            self.sort(section, positions);
        }
        let reach = self.reach();
        let [dummies, walls, _] = &self.cells;
        let [over_dummies, over_walls] = &mut self.wall;
        over_dummies.build(&self.slots, dummies, reach, team);
        over_walls.build(&self.slots, walls, reach, team);
        self.walls_sorted += 1;
    }

    fn sort(&mut self, section: Section, positions: &[Vec3]) {
        let slots = self.slots.of(section);
        // Sorted from the particles' own order, so that the order does not depend on the one before.
        let belongs = |i: &u32| section_of(self.kind[*i as usize]) == Some(section);
        self.members.clear();
        self.members.extend((0..self.kind.len() as u32).filter(belongs));
        self.cells[section as usize].sort(&self.members, positions, &mut self.slots.particle[slots]);
        self.slots.renumber(section);
        self.slots.gather(section, positions);
    }

    /// Makes all lists from the particles at `positions`.
    fn build_at(&mut self, kinds: &[Kind], positions: &[Vec3], walls_too: bool, team: Team<'_>) {
        if walls_too || self.kind != kinds {
            self.kind.clear();
            self.kind.extend_from_slice(kinds);
            let counts =
                Section::ALL.map(|s| kinds.iter().filter(|&&kind| section_of(kind) == Some(s)).count());
            self.slots.lay_out(counts, kinds.len());
            self.slots.of_particle.fill(NONE);
            self.build_static(positions, team);
        }
        self.sort(Section::Mobile, positions);
        let reach = self.reach();
        for (lists, cells) in self.mobile.iter_mut().zip(&self.cells) {
            lists.build(&self.slots, cells, reach, team);
        }
        self.wall_mobile.build(&self.slots, &self.cells[Section::Mobile as usize], reach, team);
        self.built_at.clear();
        self.built_at.extend_from_slice(positions);
        self.moved_m = 0.0;
    }

    /// Looks at all particles around a place that has no list.
    fn any_around(&self, place: Vec3, mut is_hit: impl FnMut(usize) -> bool) -> bool {
        let mut hit = false;
        for (section, cells) in Section::ALL.into_iter().zip(&self.cells) {
            let first = self.slots.of(section).start;
            for range in cells.ranges(place, place, self.reach().large_m) {
                hit = hit || range.into_iter().any(|k| is_hit(first + k));
            }
        }
        hit
    }

    /// The furthest that a particle of fluid or a body is from where the lists were made.
    fn furthest(&self, positions: &[Vec3]) -> f64 {
        let slots = &self.slots.particle[self.slots.of(Section::Mobile)];
        let square = |&i: &u32| {
            let moved = sub(positions[i as usize], self.built_at[i as usize]);
            dot(moved, moved)
        };
        slots.iter().map(square).fold(0.0, f64::max).sqrt()
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
    fn new(grid: &Grid, lengths: Lengths, _count: usize) -> Self {
        let cells = || Cells::new(grid.domain(), lengths.particle_distance_m);
        Clusters {
            lengths,
            slots: Slots::default(),
            cells: [cells(), cells(), cells()],
            mobile: Section::ALL.map(|over| Lists::new(Section::Mobile, over)),
            wall: [Section::DummyWall, Section::Wall].map(|over| Lists::new(Section::Wall, over)),
            wall_mobile: Lists::new(Section::Wall, Section::Mobile),
            walls_sorted: 0,
            members: Vec::new(),
            kind: Vec::new(),
            built_at: Vec::new(),
            generation: 0,
            built: usize::MAX,
            moved_m: f64::INFINITY,
        }
    }

    fn build(&mut self, _buckets: &Buckets, now: Now<'_>, workers: &Workers) {
        let team = workers.scheduled();
        if self.built != self.generation && !self.built_at.is_empty() {
            // A state was put back: the lists are made as they were in it.
            let (kind, built_at) = (std::mem::take(&mut self.kind), std::mem::take(&mut self.built_at));
            self.build_at(&kind.clone(), &built_at, true, team);
        }
        let same = self.built == self.generation && self.kind == now.kind && !now.walls_moved;
        self.built = self.generation;
        if same {
            self.moved_m = self.furthest(now.position);
            if now.radius_m + 2.0 * self.moved_m <= self.reach().large_m {
                self.slots.gather(Section::Mobile, now.position);
                return;
            }
        }
        self.generation += 1;
        self.built = self.generation;
        self.build_at(now.kind, now.position, !same, team);
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

    #[inline(always)]
    fn any_candidate(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        i: usize,
        enter: impl Fn(usize) -> bool,
        mut stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        let slot = self.slots.of_particle[i] as usize;
        let cluster = slot / LANES;
        let mut is_hit = |slot: usize| {
            let j = self.slots.particle[slot] as usize;
            enter(buckets.of_particle[j] as usize) && stop_at(j, &positions[j])
        };
        let mut look = |slots: &[u32]| slots.iter().any(|&slot| is_hit(slot as usize));
        match section_of(self.kind[i]) {
            Some(Section::Mobile) => self.mobile.iter().any(|lists| look(lists.of(cluster).all())),
            Some(Section::Wall) => {
                self.wall.iter().any(|lists| look(lists.of(cluster).all()))
                    || look(self.wall_mobile.of(cluster).all())
            }
            Some(Section::DummyWall) => self.any_around(positions[i], is_hit),
            None => false,
        }
    }

    fn visit(&mut self, visitor: &mut Visitor<'_>) {
        visitor("list_generation", Column::Count(&mut self.generation));
        visitor("list_kind", Column::Kinds(&mut self.kind));
        visitor("list_position", Column::Vectors(&mut self.built_at));
    }

    fn bytes(&self) -> usize {
        let lists = self.mobile.iter().chain(&self.wall).chain([&self.wall_mobile]);
        self.slots.bytes()
            + self.members.capacity() * size_of::<u32>()
            + self.cells.iter().map(Cells::bytes).sum::<usize>()
            + lists.map(Lists::bytes).sum::<usize>()
            + self.kind.capacity()
            + self.built_at.capacity() * size_of::<Vec3>()
    }
}
