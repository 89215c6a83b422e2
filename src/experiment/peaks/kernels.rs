//! The loops that are timed: plain code that the compiler vectorises.

use std::hint::black_box;

use crate::base::dispatch::{Level, Work};

/// Registers of sums that are kept apart while an array is read: enough that no addition waits for the one before it.
const SUMS: usize = 8;
/// Registers of products and sums that do not depend on one another. An instruction's latency times the instructions that
/// start at once is eight to ten on the processors of these years.
const CHAINS: usize = 12;

/// Reads an array again and again.
pub struct Read<'a> {
    pub array: &'a [f64],
    pub passes: usize,
}

impl Work for Read<'_> {
    /// The sum of all that was read.
    type Output = f64;

    #[inline(always)]
    fn run(self, level: Level) -> f64 {
        match level {
            Level::Portable => sums::<2>(&self),
            Level::Avx2 => sums::<4>(&self),
            Level::Avx512 => sums::<8>(&self),
        }
    }
}

/// What is left over at the end of a pass has a sum of its own: indexed by how much that is, the others would not stay in
/// registers.
#[inline(always)]
fn sums<const LANES: usize>(work: &Read) -> f64 {
    let mut sums = [[0.0; LANES]; SUMS];
    let mut others = 0.0;
    for _ in 0..work.passes {
        let (registers, rest) = black_box(work.array).as_chunks::<LANES>();
        let (blocks, few) = registers.as_chunks::<SUMS>();
        for block in blocks {
            for (sum, register) in sums.iter_mut().zip(block) {
                for (sum, value) in sum.iter_mut().zip(register) {
                    *sum += value;
                }
            }
        }
        others += few.iter().flatten().chain(rest).sum::<f64>();
    }
    sums.iter().flatten().sum::<f64>() + others
}

/// McCalpin's triad, `a = b + s c`, again and again.
pub struct Triad<'a> {
    pub to: &'a mut [f64],
    pub from: [&'a [f64]; 2],
    pub factor: f64,
    pub passes: usize,
}

impl Work for Triad<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self, _: Level) {
        for _ in 0..self.passes {
            let [from, scaled] = black_box(self.from);
            let to = black_box(&mut *self.to);
            for ((to, from), scaled) in to.iter_mut().zip(from).zip(scaled) {
                *to = from + self.factor * scaled;
            }
        }
    }
}

/// Multiplies and adds numbers in registers, each by itself.
pub struct MultiplyAdd {
    pub factor: f64,
    pub summand: f64,
    pub rounds: usize,
}

impl MultiplyAdd {
    /// Floating-point operations of one round: a product and a sum a lane.
    pub fn operations_a_round(level: Level) -> usize {
        2 * CHAINS * level.lanes()
    }
}

impl Work for MultiplyAdd {
    /// The sum of all lanes after the last round, from 1 in each.
    type Output = f64;

    #[inline(always)]
    fn run(self, level: Level) -> f64 {
        match level {
            Level::Portable => chains::<2>(&self, level.fuses()),
            Level::Avx2 => chains::<4>(&self, true),
            Level::Avx512 => chains::<8>(&self, true),
        }
    }
}

#[inline(always)]
fn chains<const LANES: usize>(work: &MultiplyAdd, fused: bool) -> f64 {
    let (factor, summand) = (black_box(work.factor), black_box(work.summand));
    let next = |x: f64| if fused { x.mul_add(factor, summand) } else { x * factor + summand };
    let mut values = [[1.0; LANES]; CHAINS];
    for _ in 0..work.rounds {
        for chain in &mut values {
            for value in chain {
                *value = next(*value);
            }
        }
    }
    values.iter().flatten().sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::dispatch::{at_best, at_most};

    const LEVELS: [Level; 3] = [Level::Portable, Level::Avx2, Level::Avx512];

    #[test]
    fn an_array_is_read_as_often_as_was_asked() {
        let array: Vec<f64> = (0..1001).map(f64::from).collect();
        for level in LEVELS {
            assert_eq!(at_most(level, Read { array: &array, passes: 3 }), 3.0 * 500_500.0);
        }
    }

    #[test]
    fn the_triad_is_a_sum_and_a_product() {
        let from: Vec<f64> = (0..37).map(f64::from).collect();
        let scaled: Vec<f64> = (0..37).map(|k| 100.0 * f64::from(k)).collect();
        let mut to = vec![0.0; 37];
        at_best(Triad { to: &mut to, from: [&from, &scaled], factor: 0.5, passes: 2 });
        assert!(to.iter().zip(&from).all(|(to, from)| *to == 51.0 * from));
    }

    /// Halving and adding one tends to two; powers of two are exact, fused or not.
    #[test]
    fn products_and_sums_are_those_of_every_lane() {
        for level in LEVELS {
            let there = level.min(Level::best());
            let sum = at_most(level, MultiplyAdd { factor: 0.5, summand: 1.0, rounds: 3 });
            assert_eq!(sum, (CHAINS * there.lanes()) as f64 * 1.875);
            assert_eq!(MultiplyAdd::operations_a_round(there), 2 * CHAINS * there.lanes());
        }
    }
}
