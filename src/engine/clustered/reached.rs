//! Which unknown pressures are joined to the free surface by neighbours within `re_L`: the flood of
//! [`connectivity`](crate::engine::pressure::connectivity) on clusters. It ends in the same set whatever its order.

use super::matrix::{ClusterMatrix, Kept};
use crate::base::simd::LANES;

#[derive(Debug, Default)]
pub struct Reached {
    /// Bit k: whether lane k is reached; by cluster.
    reached: Vec<u8>,
    left: Vec<u32>,
    /// Rows that are not reached, ascending.
    pub enclosed: Vec<u32>,
}

impl Reached {
    /// `filled` tells the lanes of each cluster that hold particles.
    pub fn find<V: Kept>(&mut self, matrix: &ClusterMatrix<V>, filled: impl Fn(usize) -> u8) {
        let Reached { reached, left, enclosed } = self;
        let unknown = &matrix.unknown;
        reached.clear();
        reached.extend(
            (0..unknown.len()).map(|c| (filled(c) & !unknown[c]) | (unknown[c] & matrix.touching(c))),
        );
        left.clear();
        left.extend((0..unknown.len() as u32).filter(|&c| unknown[c as usize] & !reached[c as usize] != 0));
        loop {
            let mut changed = false;
            left.retain(|&cluster| {
                let cluster = cluster as usize;
                let before = reached[cluster];
                let after = before | (unknown[cluster] & near_reached(matrix, cluster, reached));
                reached[cluster] = after;
                changed |= after != before;
                unknown[cluster] & !after != 0
            });
            if !changed || left.is_empty() {
                break;
            }
            left.reverse();
        }
        left.sort_unstable();
        enclosed.clear();
        for &cluster in left.iter() {
            let lost = unknown[cluster as usize] & !reached[cluster as usize];
            let lanes = (0..LANES as u32).filter(|lane| lost >> lane & 1 == 1);
            enclosed.extend(lanes.map(|lane| cluster * LANES as u32 + lane));
        }
    }

    pub fn bytes(&self) -> usize {
        self.reached.capacity() + (self.left.capacity() + self.enclosed.capacity()) * size_of::<u32>()
    }
}

/// The lanes of a cluster with a neighbour that is reached, its own lanes among them.
fn near_reached<V: Kept>(matrix: &ClusterMatrix<V>, cluster: usize, reached: &[u8]) -> u8 {
    let wanted = matrix.unknown[cluster] & !reached[cluster];
    let mut found = 0;
    for (columns, values) in matrix.entries(cluster) {
        for (&column, values) in columns.iter().zip(values) {
            let column = column as usize;
            if reached[column / LANES] >> (column % LANES) & 1 == 1 {
                found |= (0..LANES).fold(0, |bits, k| bits | u8::from(values[k].widened() > 0.0) << k);
                if found & wanted == wanted {
                    return found;
                }
            }
        }
    }
    found
}
