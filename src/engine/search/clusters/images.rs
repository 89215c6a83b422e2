//! Particles as they are seen across the ends of periodic axes: copies moved by whole periods, in slots of their own.
//!
//! Lists go over images as over any other particles; no cluster of images has lists. Every particle that lists may name from the
//! other end has an image, at corners several. Those of what moves are found when lists are made, and follow their particles while
//! lists are kept, also out of the domain: a particle that came in again at the other end stays, in its slot, where it
//! would be without it, so that crossing an end calls for no new lists.

use std::ops::RangeInclusive;

use super::cells::{Cells, Grid};
use super::slots::{Section, Slots};
use crate::base::parallel::Team;
use crate::base::vec3::{Vec3, add};
use crate::engine::parameters::Domain;

#[derive(Debug)]
pub struct Images {
    domain: Domain,
    /// By section; empty for those that hold no images.
    found: [Found; 6],
    /// 0, 1, 2 ..
    numbers: Vec<u32>,
}

/// The images of one section.
#[derive(Debug, Default)]
struct Found {
    /// Whose images they are, by how far they are moved, and where they were found, metres.
    particle: Vec<u32>,
    shift: Vec<Vec3>,
    place: Vec<Vec3>,
    /// Of each slot the number among these.
    sorted: Vec<u32>,
}

impl Images {
    /// `None` where no axis is periodic.
    pub fn of(domain: &Domain) -> Option<Self> {
        let images = Images { domain: *domain, found: Default::default(), numbers: Vec::new() };
        (domain.periodic != [false; 3]).then_some(images)
    }

    /// The domain and what lies within reach of it beyond its periodic ends.
    pub fn with_ends(domain: &Domain, reach_m: f64) -> Domain {
        let beyond = domain.periodic.map(|periodic| if periodic { reach_m } else { 0.0 });
        let low = [0, 1, 2].map(|d| domain.low[d] - beyond[d]);
        let high = [0, 1, 2].map(|d| domain.high[d] + beyond[d]);
        Domain { low, high, ..*domain }
    }

    /// Finds the images of `members` that lie within `reach_m` metres of the domain.
    pub fn find(&mut self, section: Section, members: &[u32], positions: &[Vec3], reach_m: f64) {
        let mut found = std::mem::take(&mut self.found[section as usize]);
        found.particle.clear();
        found.shift.clear();
        found.place.clear();
        for &i in members {
            let x = positions[i as usize];
            let [along_x, along_y, along_z] = [0, 1, 2].map(|d| self.periods(d, x[d], reach_m));
            for a in along_x {
                for b in along_y.clone() {
                    for c in along_z.clone().filter(|&c| [a, b, c] != [0; 3]) {
                        let shift = [self.length(0, a), self.length(1, b), self.length(2, c)];
                        found.particle.push(i);
                        found.shift.push(shift);
                        found.place.push(add(x, shift));
                    }
                }
            }
        }
        self.found[section as usize] = found;
    }

    /// By how many periods a coordinate may be moved along axis `d`.
    fn periods(&self, d: usize, x: f64, reach_m: f64) -> RangeInclusive<i32> {
        if !self.domain.periodic[d] {
            return 0..=0;
        }
        let (low, high, period) = (self.domain.low[d], self.domain.high[d], self.length(d, 1));
        ((low - reach_m - x) / period).ceil() as i32..=((high + reach_m - x) / period).floor() as i32
    }

    /// Of so many periods, metres.
    fn length(&self, d: usize, periods: i32) -> f64 {
        f64::from(periods) * (self.domain.high[d] - self.domain.low[d])
    }

    /// How many a section has.
    pub fn count(&self, section: Section) -> usize {
        self.found[section as usize].particle.len()
    }

    /// Sorts those that were found into the slots of their section.
    pub fn sort(
        &mut self,
        section: Section,
        cells: &mut Cells,
        grid: &Grid,
        slots: &mut Slots,
        team: Team<'_>,
    ) {
        let Found { particle, place, sorted, .. } = &mut self.found[section as usize];
        let count = particle.len();
        self.numbers.extend(self.numbers.len() as u32..count as u32);
        sorted.resize(count, 0);
        cells.sort(grid, &self.numbers[..count], place, sorted, team);
        for (slot, &k) in slots.of(section).zip(sorted.iter()) {
            slots.particle[slot] = particle[k as usize];
            slots.put(slot, place[k as usize]);
        }
        slots.fill_up(section);
    }

    /// Moves the images of what moves to where their particles are now, and these to where they would be without ends.
    pub fn follow(&self, slots: &mut Slots, positions: &[Vec3], built_at: &[Vec3]) {
        let Found { shift, sorted, .. } = &self.found[Section::MobileImage as usize];
        for (slot, &k) in slots.of(Section::MobileImage).zip(sorted) {
            let i = slots.particle[slot] as usize;
            let x = self.nearest(positions[i], built_at[i]);
            slots.put(slots.of_particle[i] as usize, x);
            slots.put(slot, add(x, shift[k as usize]));
        }
    }

    /// Of a place and its images the one nearest to another place.
    #[inline(always)]
    pub fn nearest(&self, mut x: Vec3, to: Vec3) -> Vec3 {
        for d in (0..3).filter(|&d| self.domain.periodic[d]) {
            let period = self.length(d, 1);
            x[d] -= period * ((x[d] - to[d]) / period).round();
        }
        x
    }

    pub fn bytes(&self) -> usize {
        let of_section = |f: &Found| {
            (f.particle.capacity() + f.sorted.capacity()) * size_of::<u32>()
                + (f.shift.capacity() + f.place.capacity()) * size_of::<Vec3>()
        };
        self.found.iter().map(of_section).sum::<usize>() + self.numbers.capacity() * size_of::<u32>()
    }
}
