//! The textbook's stages on clusters: eight particles at once, from the lists of [`Clusters`].
//!
//! Each stage walks over lists whose lanes are particles `i` and whose entries are single particles `j`, computes in
//! vectors, and hands its sums back in the particles' own order. Sums are the textbook's but for the order of their terms.
//! What these stages do not cover - other gradients, sources, surfaces - runs as in any other search, from the same lists.

mod assembly;
pub mod collision;
mod density;
mod dry_walls;
mod entries;
mod gradient;
mod matrix;
pub mod pressure;
mod reached;
mod rows;
#[cfg(test)]
mod tests;
pub mod viscosity;

use crate::base::parallel::{Columns, Rows, Team};
use crate::base::simd::{LANES, Simd};
use crate::base::vec3::Vec3;
use crate::engine::search::NONE;
use crate::engine::search::clusters::{Lanes, Near, Slots};

/// Clusters whose sums one piece of work makes.
const PIECE: usize = 8;

/// The slots of a list, each with the lanes that count: all but one that is itself the particle in that slot.
///
/// An iterator rather than a function that takes a closure: a closure that is not inlined would be compiled without the
/// processor's features.
struct Walk<'a> {
    slots: &'a [u32],
    next: usize,
    own: usize,
}

#[inline(always)]
fn walk<'a>(near: Near<'a>, slots: &'a [u32]) -> Walk<'a> {
    Walk { slots, next: 0, own: near.own }
}

impl Iterator for Walk<'_> {
    type Item = (usize, u8);

    #[inline(always)]
    fn next(&mut self) -> Option<(usize, u8)> {
        let &slot = self.slots.get(self.next)?;
        let itself = u8::from(self.next < self.own) << (self.next & (LANES - 1));
        self.next += 1;
        Some((slot as usize, !itself))
    }
}

/// `x_j - x_i` for all lanes.
#[inline(always)]
fn from_lanes<S: Simd>(s: S, point: &[f64; 4], x: &[S::F; 3]) -> [S::F; 3] {
    [s.sub(s.splat(point[0]), x[0]), s.sub(s.splat(point[1]), x[1]), s.sub(s.splat(point[2]), x[2])]
}

/// `sum + weight vector` for all lanes.
#[inline(always)]
fn add_weighted<S: Simd>(s: S, sum: &mut [S::F; 3], weight: S::F, vector: [S::F; 3]) {
    sum[0] = s.mul_add(weight, vector[0], sum[0]);
    sum[1] = s.mul_add(weight, vector[1], sum[1]);
    sum[2] = s.mul_add(weight, vector[2], sum[2]);
}

#[inline(always)]
fn load<S: Simd>(s: S, lanes: &Lanes) -> [S::F; 3] {
    [s.load(&lanes[0]), s.load(&lanes[1]), s.load(&lanes[2])]
}

/// The vector in one lane.
#[inline(always)]
fn lane(lanes: &[Lanes], first_cluster: usize, slot: usize) -> Vec3 {
    let lanes = &lanes[slot / LANES - first_cluster];
    [0, 1, 2].map(|d| lanes[d][slot % LANES])
}

/// Fills `columns`, a row a particle, `of(particle, slot, row)` setting those that stand in a slot from `first` on.
fn scatter<T: Send>(
    column: &mut [T],
    slots: &Slots,
    first: usize,
    team: Team<'_>,
    of: impl Fn(usize, usize, &mut T) + Sync,
) where
    for<'a> Rows<'a, T>: Columns<Part = &'a mut [T]>,
{
    team.fill(Rows::new(column), |range, column| {
        for (i, value) in range.zip(column) {
            let slot = slots.of_particle[i];
            if slot != NONE && slot as usize >= first {
                of(i, slot as usize, value);
            }
        }
    });
}
