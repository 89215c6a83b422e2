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
//!
//! Across the ends of periodic axes lists name [`images`], which have slots of their own: a walk knows nothing of periods.

mod cells;
mod images;
mod lists;
mod slots;
#[cfg(test)]
mod tests;

use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

use crate::base::parallel::{Rows, Team, Workers};
use crate::base::simd::LANES;
use crate::base::vec3::{Vec3, ZERO, add, dot, sub};
use crate::engine::columns::{Column, Visitor};
use crate::engine::particles::Kind;
use crate::engine::search::grid::{self, Buckets};
use crate::engine::search::{CandidateSearch, Lengths, NONE, Now};
use cells::{Cells, Grid};
use images::Images;
use lists::{Around, Candidates, Crossed};
pub use lists::{CHUNK, Lists, Near, Reach, with_pressure};
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
    /// By section; empty where there are no images.
    cells: [Cells; 6],
    crossed: Crossed,
    around_mobile: Around,
    /// Found where there are images.
    around_wall: Around,
    /// `None` where no axis is periodic.
    images: Option<Images>,
    /// Of the mobile clusters over all sections, in their order; over images, where there are such.
    pub mobile: Vec<Lists>,
    /// Of the wall clusters over what rests, made when walls move.
    pub wall: Vec<Lists>,
    /// Of the wall clusters over what moves.
    pub wall_mobile: Vec<Lists>,
    /// Counts how often walls were sorted: what was worked out from their places holds while it stays.
    pub walls_sorted: usize,
    /// The particles of each section.
    members: [Vec<u32>; 6],
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
            self.sort_images(section, team);
        }
        // Walls do not move towards one another.
        let Lengths { small_m, large_m, .. } = self.lengths;
        let reach = Reach { small_m, large_m };
        let mut around = Around::new(Section::Wall);
        around.find(&self.slots, &self.grid, large_m, team);
        for lists in &mut self.wall {
            let candidates = Candidates::Around(&self.cells[lists.over() as usize], &around);
            lists.build(&self.slots, candidates, reach, team);
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

    fn sort_images(&mut self, of: Section, team: Team<'_>) {
        let section = of.images();
        if let Some(images) = &mut self.images {
            images.sort(section, &mut self.cells[section as usize], &self.grid, &mut self.slots, team);
        }
    }

    /// Finds the images of what moves, and of walls, if `walls_too`.
    fn find_images(&mut self, positions: &[Vec3], walls_too: bool) {
        let reach_m = self.reach().large_m;
        let Some(images) = &mut self.images else { return };
        for of in Section::HOMES {
            // Those of walls serve lists with any skin.
            let reach_m = if of.are_mobile() { reach_m } else { longest_m(self.lengths) };
            if walls_too || of.are_mobile() {
                images.find(of.images(), &self.members[of as usize], positions, reach_m);
            }
        }
    }

    /// How many particles and images each section has.
    fn counts(&self) -> [usize; 6] {
        Section::ALL.map(|section| match &self.images {
            Some(images) if section.are_images() => images.count(section),
            _ => self.members[section as usize].len(),
        })
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
        }
        self.find_images(positions, walls_too);
        if anew || self.images.is_some() {
            self.slots.lay_out(self.counts(), kinds.len());
        }
        if anew {
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
        self.sort_images(Section::Mobile, team);
        self.build_moving(team);
        self.built_at.resize(positions.len(), ZERO);
        team.evenly().fill(Rows::new(&mut self.built_at), |range, built_at| {
            built_at.copy_from_slice(&positions[range]);
        });
        self.moved_m = 0.0;
    }

    /// Makes the lists that name or belong to what moves.
    fn build_moving(&mut self, team: Team<'_>) {
        let (slots, reach) = (&self.slots, self.reach());
        self.around_mobile.find(slots, &self.grid, reach.large_m, team);
        for lists in &mut self.mobile {
            let candidates = Candidates::Around(&self.cells[lists.over() as usize], &self.around_mobile);
            lists.build(slots, candidates, reach, team);
        }
        let over_walls = self.mobile.iter().find(|lists| lists.over() == Section::Wall);
        self.crossed.find(over_walls.expect("lists over each section"), slots);
        if self.images.is_some() {
            self.around_wall.find(slots, &self.grid, reach.large_m, team);
        }
        for lists in &mut self.wall_mobile {
            let candidates = match lists.over() {
                Section::Mobile => Candidates::Crossed(&self.crossed),
                images => Candidates::Around(&self.cells[images as usize], &self.around_wall),
            };
            lists.build(slots, candidates, reach, team);
        }
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
        let Some(section) = section_of(self.kind[i]) else { return false };
        let (slot, here, radius2) = (self.slots.of_particle[i] as usize, positions[i], radius * radius);
        let of_slot = &self.slots.particle;
        let mut is_hit = |slot: usize, there: Vec3| {
            let r = sub(there, here);
            dot(r, r) < radius2 && stop_at(of_slot[slot] as usize, &there)
        };
        if self.images.is_none() {
            return self
                .any_slot(section, slot, here, |slot| is_hit(slot, positions[of_slot[slot] as usize]));
        }
        // A particle that crossed an end has its slot still beyond it, and so have those around it.
        let place = self.slots.place(slot);
        let crossed = sub(here, place);
        self.any_slot(section, slot, place, |slot| is_hit(slot, add(self.slots.place(slot), crossed)))
    }

    /// Calls `stop_at` for the slots that the list of a slot at `place` names.
    fn any_slot(
        &self,
        section: Section,
        slot: usize,
        place: Vec3,
        mut stop_at: impl FnMut(usize) -> bool,
    ) -> bool {
        let lists: [&[Lists]; 2] = match section {
            Section::Mobile => [&self.mobile, &[]],
            Section::Wall => [&self.wall, &self.wall_mobile],
            _ => return self.any_around(place, stop_at),
        };
        let cluster = slot / LANES;
        lists
            .into_iter()
            .flatten()
            .any(|lists| lists.of(cluster).all.iter().any(|&slot| stop_at(slot as usize)))
    }

    /// Looks at all particles around a place that has no list.
    fn any_around(&self, place: Vec3, mut is_hit: impl FnMut(usize) -> bool) -> bool {
        let mut runs = Vec::new();
        self.grid.runs(place, place, self.reach().large_m, &mut runs);
        self.mobile.iter().any(|lists| {
            let (first, cells) = (self.slots.of(lists.over()).start, &self.cells[lists.over() as usize]);
            runs.iter().any(|&run| cells.in_run(run).any(|k| is_hit(first + k)))
        })
    }

    /// The furthest that a particle of fluid or a body is from where the lists were made.
    fn furthest(&self, positions: &[Vec3], team: Team<'_>) -> f64 {
        let mobile = &self.members[Section::Mobile as usize];
        let square = |&i: &u32| {
            let (x, built_at) = (positions[i as usize], self.built_at[i as usize]);
            let x = self.images.as_ref().map_or(x, |images| images.nearest(x, built_at));
            let moved = sub(x, built_at);
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

/// The farthest that lists with any skin reach, metres.
fn longest_m(lengths: Lengths) -> f64 {
    lengths.large_m + MOST_SKIN * lengths.particle_distance_m
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
        let images = Images::of(grid.domain());
        let grid =
            Grid::new(&Images::with_ends(grid.domain(), longest_m(lengths)), lengths.particle_distance_m);
        let is_there = |section: &Section| images.is_some() || !section.are_images();
        let sections: Vec<Section> = Section::ALL.into_iter().filter(is_there).collect();
        let cells = |section: Section| if is_there(&section) { Cells::new(&grid) } else { Cells::default() };
        let (moving, resting): (Vec<Section>, _) = sections.iter().partition(|section| section.are_mobile());
        let lists = |of: Section, over: &[Section]| over.iter().map(|&over| Lists::new(of, over)).collect();
        Clusters {
            lengths,
            slots: Slots::default(),
            cells: Section::ALL.map(cells),
            crossed: Crossed::default(),
            around_mobile: Around::new(Section::Mobile),
            around_wall: Around::new(Section::Wall),
            mobile: lists(Section::Mobile, &sections),
            wall: lists(Section::Wall, &resting),
            wall_mobile: lists(Section::Wall, &moving),
            grid,
            images,
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
                if let Some(images) = &self.images {
                    images.follow(&mut self.slots, now.position, &self.built_at);
                }
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
        let lists = self.mobile.iter().chain(&self.wall).chain(&self.wall_mobile);
        self.slots.bytes()
            + self.members.iter().map(Vec::capacity).sum::<usize>() * size_of::<u32>()
            + self.cells.iter().map(Cells::bytes).sum::<usize>()
            + self.crossed.bytes()
            + self.around_mobile.bytes()
            + self.around_wall.bytes()
            + self.images.as_ref().map_or(0, Images::bytes)
            + lists.map(Lists::bytes).sum::<usize>()
            + self.kind.capacity()
            + self.built_at.capacity() * size_of::<Vec3>()
    }
}
