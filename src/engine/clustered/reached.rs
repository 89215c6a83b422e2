//! Which unknown pressures are joined to the free surface by neighbours within `re_L`: the flood of
//! [`connectivity`](crate::engine::pressure::connectivity) on clusters. It ends in the same set whatever its order.

use std::sync::atomic::AtomicU8;
use std::sync::atomic::Ordering::Relaxed;

use super::entries::Kept;
use super::matrix::ClusterMatrix;
use crate::base::parallel::{Rows, Team};
use crate::base::simd::LANES;

#[derive(Debug, Default)]
pub struct Reached {
    /// Bit k: whether lane k is reached; by cluster. What one thread has reached others may meet in the same sweep or in the next.
    reached: Vec<AtomicU8>,
    left: Vec<u32>,
    /// Rows that are not reached, ascending.
    pub enclosed: Vec<u32>,
}

impl Reached {
    /// `filled` tells the lanes of each cluster that hold particles.
    pub fn find<V: Kept>(
        &mut self,
        matrix: &ClusterMatrix<V>,
        filled: impl Fn(usize) -> u8 + Sync,
        team: Team<'_>,
    ) {
        let Reached { reached, left, enclosed } = self;
        let unknown = &matrix.unknown;
        reached.resize_with(unknown.len(), AtomicU8::default);
        team.fill(Rows::new(reached), |range, reached| {
            for (c, reached) in range.zip(reached) {
                *reached.get_mut() = (filled(c) & !unknown[c]) | (unknown[c] & matrix.touching(c));
            }
        });
        let lost = |c: u32| unknown[c as usize] & !reached[c as usize].load(Relaxed);
        left.clear();
        left.extend((0..unknown.len() as u32).filter(|&c| lost(c) != 0));
        let mut before = usize::MAX;
        loop {
            let lanes_left: usize = left.iter().map(|&c| lost(c).count_ones() as usize).sum();
            if lanes_left == 0 || lanes_left == before {
                break;
            }
            before = lanes_left;
            team.run(left.len(), |range| {
                for &cluster in &left[range] {
                    let found = near_reached(matrix, cluster as usize, reached);
                    reached[cluster as usize].fetch_or(found, Relaxed);
                }
            });
            left.retain(|&c| lost(c) != 0);
            left.reverse();
        }
        left.sort_unstable();
        enclosed.clear();
        for &cluster in left.iter() {
            let lanes = (0..LANES as u32).filter(|lane| lost(cluster) >> lane & 1 == 1);
            enclosed.extend(lanes.map(|lane| cluster * LANES as u32 + lane));
        }
    }

    pub fn bytes(&self) -> usize {
        self.reached.capacity() + (self.left.capacity() + self.enclosed.capacity()) * size_of::<u32>()
    }
}

/// The lanes with an unknown of a cluster that have a neighbour that is reached, its own lanes among them.
fn near_reached<V: Kept>(matrix: &ClusterMatrix<V>, cluster: usize, reached: &[AtomicU8]) -> u8 {
    let wanted = matrix.unknown[cluster] & !reached[cluster].load(Relaxed);
    let mut found = 0;
    for run in matrix.entries(cluster) {
        for (&column, &lanes) in run.columns.iter().zip(run.lanes) {
            let column = column as usize;
            if reached[column / LANES].load(Relaxed) >> (column % LANES) & 1 == 1 {
                found |= lanes & wanted;
                if found == wanted {
                    return found;
                }
            }
        }
    }
    found
}
