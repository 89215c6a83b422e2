//! Fluid particles a little beside their lattice points.

use serde::Deserialize;

use crate::base::input::{Check, InputError};
use crate::base::vec3::Vec3;

/// Moves the fluid particles of the lattice by uniform random displacements; walls and single particles stay.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Jitter {
    /// The largest displacement in each direction, in particle distances: from 0 up to, and not, 0.5.
    pub amplitude: f64,
    /// Another seed gives other displacements; the same seed gives the same on every machine.
    #[serde(default)]
    pub seed: u64,
}

impl Jitter {
    pub(super) fn check(&self, check: Check<'_>) -> Result<(), InputError> {
        check.require(
            (0.0..0.5).contains(&self.amplitude),
            "geometry.jitter.amplitude",
            self.amplitude,
            "allowed are numbers from 0 up to, and not, 0.5 particle distances: farther particles could meet",
        )
    }

    /// The displacement of the particle at a lattice point, in particle distances. It follows from the point's indices, not
    /// from how many particles come before it, so that a change elsewhere in the scene leaves it as it is.
    pub(super) fn displacement(&self, index: [i64; 3]) -> Vec3 {
        let point = index.iter().fold(mixed(self.seed), |hash, i| mixed(hash ^ *i as u64));
        [1, 2, 3].map(|component| self.amplitude * (2.0 * uniform(mixed(point ^ component)) - 1.0))
    }
}

/// SplitMix64 (Steele, Lea & Flood 2014): integer arithmetic alone, so that no machine and no library's version differs.
fn mixed(state: u64) -> u64 {
    let mut z = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A number from 0 up to, and not, 1: the upper 53 bits, which a double holds exactly.
fn uniform(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first output for the seeds 0 and 1234567 of the reference implementation (prng.di.unimi.it/splitmix64.c).
    #[test]
    fn the_mixing_is_that_of_splitmix64() {
        assert_eq!(mixed(0), 0xe220_a839_7b1d_cdaf);
        assert_eq!(mixed(1_234_567), 6_457_827_717_110_365_317);
    }

    #[test]
    fn displacements_fill_their_range_evenly() {
        let jitter = Jitter { amplitude: 0.25, seed: 7 };
        let count = 20_000;
        let all: Vec<Vec3> =
            (0..count).map(|k| jitter.displacement([k % 20, k / 20 % 50, k / 1000])).collect();
        for d in 0..3 {
            let mean = all.iter().map(|x| x[d]).sum::<f64>() / count as f64;
            let square = all.iter().map(|x| x[d] * x[d]).sum::<f64>() / count as f64;
            assert!(all.iter().all(|x| x[d].abs() <= 0.25));
            // Of a uniform distribution: the standard error of the mean is 0.001, the variance a^2 / 3.
            assert!(mean.abs() < 0.005, "{mean}");
            assert!((square / (0.0625 / 3.0) - 1.0).abs() < 0.03, "{square}");
        }
    }
}
