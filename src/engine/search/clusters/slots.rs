//! Where particles stand in the order of clusters, and their positions in it.

use super::SPARE;
use crate::base::large_pages::with_large_pages;
use crate::base::parallel::{Rows, Team};
use crate::base::simd::LANES;
use crate::base::vec3::Vec3;
use crate::engine::search::NONE;
use std::ops::Range;

/// Where the coordinates of an empty lane lie, metres: out of everyone's reach, and its square a number still.
pub const FAR: f64 = 1e30;

/// Eight particles side by side in space, their coordinates by lane.
pub type Lanes = [[f64; LANES]; 3];

/// The parts of the order, each sorted by cells of its own and filled up to whole clusters. [Images](super::images) of particles
/// have sections of their own, empty where no axis is periodic. What rests stands before what moves, dummy walls before all that
/// has a pressure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Section {
    DummyWallImage,
    DummyWall,
    WallImage,
    Wall,
    /// Fluid and bodies.
    Mobile,
    MobileImage,
}

impl Section {
    pub const ALL: [Section; 6] = [
        Section::DummyWallImage,
        Section::DummyWall,
        Section::WallImage,
        Section::Wall,
        Section::Mobile,
        Section::MobileImage,
    ];

    /// Who has images.
    pub const HOMES: [Section; 3] = [Section::DummyWall, Section::Wall, Section::Mobile];

    /// Where the images of a section stand.
    pub fn images(self) -> Section {
        match self {
            Section::DummyWall | Section::DummyWallImage => Section::DummyWallImage,
            Section::Wall | Section::WallImage => Section::WallImage,
            Section::Mobile | Section::MobileImage => Section::MobileImage,
        }
    }

    pub fn are_images(self) -> bool {
        self == self.images()
    }

    pub fn are_dummies(self) -> bool {
        self.images() == Section::DummyWallImage
    }

    pub fn are_mobile(self) -> bool {
        self.images() == Section::MobileImage
    }
}

#[derive(Debug, Default)]
pub struct Slots {
    /// The particle in each slot, or whose image it is; [`NONE`] in those that fill up a section.
    pub particle: Vec<u32>,
    /// The slot of each particle; [`NONE`] for ghosts.
    pub of_particle: Vec<u32>,
    /// The coordinates of each cluster, metres.
    pub lanes: Vec<Lanes>,
    /// The same by slot, and a number beside them that the pressure's stage puts there.
    pub points: Vec<[f64; 4]>,
    /// The slots of each section that hold particles, from a whole cluster on.
    filled: [Range<usize>; 6],
}

impl Slots {
    /// The slots of a section that hold particles.
    pub fn of(&self, section: Section) -> Range<usize> {
        self.filled[section as usize].clone()
    }

    /// The clusters of a section.
    pub fn clusters(&self, section: Section) -> Range<usize> {
        let slots = self.of(section);
        slots.start / LANES..slots.end.div_ceil(LANES).max(slots.start / LANES)
    }

    /// How many lanes of a cluster hold particles.
    #[inline(always)]
    pub fn filled_lanes(&self, section: Section, cluster: usize) -> usize {
        (self.of(section).end - cluster * LANES).min(LANES)
    }

    /// Makes room for so many particles in each section.
    pub fn lay_out(&mut self, counts: [usize; 6], particles: usize) {
        let mut next = 0;
        for (filled, count) in self.filled.iter_mut().zip(counts) {
            *filled = next..next + count;
            next = (next + count).next_multiple_of(LANES);
        }
        self.of_particle.resize(particles, NONE);
        fit(&mut self.particle, next, NONE);
        fit(&mut self.points, next, [FAR, FAR, FAR, 0.0]);
        fit(&mut self.lanes, next / LANES, [[FAR; LANES]; 3]);
    }

    /// Notes which particles `section` holds now, which stand in `particle` already.
    pub fn renumber(&mut self, section: Section) {
        for slot in self.of(section) {
            self.of_particle[self.particle[slot] as usize] = slot as u32;
        }
        self.fill_up(section);
    }

    /// Marks the slots as empty that fill the last cluster of `section` up.
    pub fn fill_up(&mut self, section: Section) {
        let (slots, clusters) = (self.of(section), self.clusters(section));
        for empty in slots.end..clusters.end * LANES {
            self.particle[empty] = NONE;
            self.points[empty] = [FAR, FAR, FAR, 0.0];
            for d in 0..3 {
                self.lanes[empty / LANES][d][empty % LANES] = FAR;
            }
        }
    }

    /// Takes up the positions of a section.
    pub fn gather(&mut self, section: Section, positions: &[Vec3], team: Team<'_>) {
        let clusters = self.clusters(section);
        let slots = clusters.start * LANES..clusters.end * LANES;
        let particle = &self.particle[slots.clone()];
        let columns = (Rows::new(&mut self.lanes[clusters]), Rows::of_width(&mut self.points[slots], LANES));
        team.evenly().fill(columns, |clusters, (lanes, points)| {
            let particle = &particle[clusters.start * LANES..];
            for ((lanes, points), particle) in
                lanes.iter_mut().zip(points.chunks_mut(LANES)).zip(particle.chunks(LANES))
            {
                for (lane, (point, &particle)) in points.iter_mut().zip(particle).enumerate() {
                    if particle != NONE {
                        let x = positions[particle as usize];
                        point[..3].copy_from_slice(&x);
                        for d in 0..3 {
                            lanes[d][lane] = x[d];
                        }
                    }
                }
            }
        });
    }

    /// Puts the particle or image in a slot to a place.
    pub fn put(&mut self, slot: usize, x: Vec3) {
        let lanes = &mut self.lanes[slot / LANES];
        for d in 0..3 {
            self.points[slot][d] = x[d];
            lanes[d][slot % LANES] = x[d];
        }
    }

    /// Where the particle or image in a slot is.
    #[inline(always)]
    pub fn place(&self, slot: usize) -> Vec3 {
        let [x, y, z, _] = self.points[slot];
        [x, y, z]
    }

    /// The slot of the particle itself whose image stands in a slot.
    #[inline(always)]
    pub fn home(&self, image: usize) -> usize {
        self.of_particle[self.particle[image] as usize] as usize
    }

    /// Puts the pressures beside particles beside their images as well.
    pub fn show_pressures_to_images(&mut self) {
        for images in [Section::WallImage, Section::MobileImage] {
            for image in self.of(images) {
                self.points[image][3] = self.points[self.home(image)][3];
            }
        }
    }

    /// The box around a cluster.
    pub fn bounds(&self, section: Section, cluster: usize) -> (Vec3, Vec3) {
        let first = cluster * LANES;
        let points = &self.points[first..first + self.filled_lanes(section, cluster)];
        let start = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        points.iter().fold(start, |(low, high), x| {
            ([0, 1, 2].map(|d| low[d].min(x[d])), [0, 1, 2].map(|d| high[d].max(x[d])))
        })
    }

    pub fn bytes(&self) -> usize {
        (self.particle.capacity() + self.of_particle.capacity()) * size_of::<u32>()
            + self.points.capacity() * size_of::<[f64; 4]>()
            + self.lanes.capacity() * size_of::<Lanes>()
    }
}

/// Makes a list just so long, in large pages; one that grows again and again gets some room to spare.
fn fit<T: Copy>(list: &mut Vec<T>, length: usize, filling: T) {
    if list.capacity() < length {
        let spare = if list.is_empty() { 0 } else { length / 8 + SPARE };
        let mut longer = with_large_pages(length + spare);
        longer.extend_from_slice(list);
        *list = longer;
    }
    list.resize(length, filling);
}
