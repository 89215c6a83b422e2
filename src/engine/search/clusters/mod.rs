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
use crate::engine::search::grid::{self, Buckets};
use crate::engine::search::{CandidateSearch, Lengths, NONE, Now};
use cells::{Cells, Grid};
use lists::Around;
pub use lists::{CHUNK, Lists, Near, Reach};
pub use slots::{FAR, Lanes, Section, Slots};

/// By how much lists reach further than the largest radius, in particle distances: as much as particles moved between the
/// last making of lists and the first walk after it, and a little more, but no more than what a longer list is worth.
const LEAST_SKIN: f64 = 0.05;
const MOST_SKIN: f64 = 0.4;
const MORE: f64 = 1.3;

#[derive(Debug)]
pub struct Clusters {
    lengths: Lengths,
    pub slots: Slots,
    grid: Grid,
    cells: [Cells; 3],
    around_walls: Around,
    around_mobile: Around,
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
    /// The skin of the lists, and the one that the first walk since they were made called for, in particle distances.
    skin: f64,
    called_for: f64,
}

impl Clusters {
    fn reach(&self) -> Reach {
        let Lengths { particle_distance_m, small_m, large_m } = self.lengths;
        let skin_m = self.skin * particle_distance_m;
        Reach { small_m: small_m + skin_m, large_m: large_m + skin_m }
    }

    /// Whether a walk over the near parts finds all pairs within `radius_m` where particles are now. Resting walls among
    /// themselves need no skin.
    pub fn small_reaches(&self, radius_m: f64) -> bool {
        radius_m + 2.0 * self.moved_m <= self.reach().small_m
    }

    /// Sorts walls and dummy walls, and makes the lists among them.
    fn build_static(&mut self, positions: &[Vec3], team: Team<'_>) {
        for section in [Section::DummyWall, Section::Wall] {
            self.sort(section, positions);
        }
        let Lengths { particle_distance_m, small_m, large_m } = self.lengths;
        // Particles of fluid may be looked for with any skin.
        let furthest_m = large_m + MOST_SKIN * particle_distance_m;
        self.around_walls.find(&self.slots, &self.grid, furthest_m, team);
        // Walls do not move towards one another.
        let (reach, around) = (Reach { small_m, large_m }, &self.around_walls);
        for (lists, cells) in self.wall.iter_mut().zip(&self.cells) {
            lists.build(&self.slots, cells, around, reach, team);
        }
        self.walls_sorted += 1;
    }

    fn sort(&mut self, section: Section, positions: &[Vec3]) {
        let slots = self.slots.of(section);
        // Sorted from the particles' own order, so that the order does not depend on the one before.
        let belongs = |i: &u32| section_of(self.kind[*i as usize]) == Some(section);
        self.members.clear();
        self.members.extend((0..self.kind.len() as u32).filter(belongs));
        self.cells[section as usize].sort(
            &self.grid,
            &self.members,
            positions,
            &mut self.slots.particle[slots],
        );
        self.slots.renumber(section);
        self.slots.gather(section, positions);
    }

    /// Whether the same particles are walls and dummy walls as when lists were made.
    fn walls_are_those_of(&self, kinds: &[Kind]) -> bool {
        let wall = |kind: &Kind| section_of(*kind).filter(|&section| section != Section::Mobile);
        self.kind.iter().map(wall).eq(kinds.iter().map(wall))
    }

    /// Makes all lists from the particles at `positions`; those among walls, if `walls_too`.
    fn build_at(&mut self, kinds: &[Kind], positions: &[Vec3], walls_too: bool, team: Team<'_>) {
        if walls_too || self.kind != kinds {
            self.kind.clear();
            self.kind.extend_from_slice(kinds);
            let counts =
                Section::ALL.map(|s| kinds.iter().filter(|&&kind| section_of(kind) == Some(s)).count());
            self.slots.lay_out(counts, kinds.len());
            for (slot, &kind) in self.slots.of_particle.iter_mut().zip(kinds) {
                if section_of(kind).is_none() {
                    *slot = NONE;
                }
            }
        }
        if walls_too {
            self.build_static(positions, team);
        }
        self.sort(Section::Mobile, positions);
        let reach = self.reach();
        self.around_mobile.find(&self.slots, &self.grid, reach.large_m, team);
        for (lists, cells) in self.mobile.iter_mut().zip(&self.cells) {
            lists.build(&self.slots, cells, &self.around_mobile, reach, team);
        }
        let mobile = &self.cells[Section::Mobile as usize];
        self.wall_mobile.build(&self.slots, mobile, &self.around_walls, reach, team);
        self.built_at.clear();
        self.built_at.extend_from_slice(positions);
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
            .any(|lists| lists.of(cluster).all().iter().any(|&slot| is_hit(slot as usize)))
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
    fn new(grid: &grid::Grid, lengths: Lengths, _count: usize) -> Self {
        let grid = Grid::new(grid.domain(), lengths.particle_distance_m);
        let cells = || Cells::new(&grid);
        Clusters {
            lengths,
            slots: Slots::default(),
            cells: [cells(), cells(), cells()],
            grid,
            around_walls: Around::new(Section::Wall),
            around_mobile: Around::new(Section::Mobile),
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
            skin: LEAST_SKIN,
            called_for: f64::INFINITY,
        }
    }

    fn build(&mut self, _buckets: &Buckets, now: Now<'_>, workers: &Workers) {
        let team = workers.scheduled();
        if self.built != self.generation && !self.built_at.is_empty() {
            // A state was put back: the lists are made as they were in it.
            let (kind, built_at) = (std::mem::take(&mut self.kind), std::mem::take(&mut self.built_at));
            self.build_at(&kind, &built_at, true, team);
            self.built = self.generation;
        }
        let walls_rest =
            self.built == self.generation && !now.walls_moved && self.walls_are_those_of(now.kind);
        self.built = self.generation;
        if walls_rest && self.kind == now.kind {
            self.moved_m = self.furthest(now.position);
            if now.radius_m == self.lengths.large_m {
                self.called_for = self.called_for.min(2.0 * self.moved_m / self.lengths.particle_distance_m);
            }
            if now.radius_m + 2.0 * self.moved_m <= self.reach().large_m {
                self.slots.gather(Section::Mobile, now.position);
                return;
            }
        }
        let skin = MORE * self.called_for;
        self.skin = if skin > MOST_SKIN { LEAST_SKIN } else { skin.max(LEAST_SKIN) };
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
        visitor("list_kind", Column::Kinds(&mut self.kind));
        visitor("list_position", Column::Vectors(&mut self.built_at));
    }

    fn bytes(&self) -> usize {
        let lists = self.mobile.iter().chain(&self.wall).chain([&self.wall_mobile]);
        self.slots.bytes()
            + self.members.capacity() * size_of::<u32>()
            + self.cells.iter().map(Cells::bytes).sum::<usize>()
            + self.around_walls.bytes()
            + self.around_mobile.bytes()
            + lists.map(Lists::bytes).sum::<usize>()
            + self.kind.capacity()
            + self.built_at.capacity() * size_of::<Vec3>()
    }
}
