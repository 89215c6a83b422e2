//! Eight positions at a time: which of them lie within a radius, without a branch.

use crate::base::vec3::{Vec3, dot};

/// Positions that one instruction may work on: eight `f64` are the widest vector of x86-64, and narrower machines take the
/// eight in parts.
pub const LANES: usize = 8;

/// A coordinate of eight positions.
pub type Lanes = [f64; LANES];

/// Lanes of eight: the lowest bit of byte `k` stands for lane `k`. Comparisons leave a vector in this form with the fewest
/// instructions.
pub type Chosen = u64;

/// The lanes whose squared distance from `here` is below `r2`, worked out exactly as the distance test does: what is not
/// chosen is no neighbour by either test, since the root of a rounded square is the number itself.
#[inline(always)]
pub fn near(x: &Lanes, y: &Lanes, z: &Lanes, here: &Vec3, r2: f64) -> Chosen {
    let squares: Lanes = std::array::from_fn(|k| {
        let r_ij = [x[k] - here[0], y[k] - here[1], z[k] - here[2]];
        dot(r_ij, r_ij)
    });
    Chosen::from_le_bytes(squares.map(|square| u8::from(square < r2)))
}

/// Lanes `from..to`, as far as there are such.
#[inline(always)]
pub fn among(from: usize, to: usize) -> Chosen {
    let below = |lane: usize| Chosen::MAX.checked_shr(8 * LANES.saturating_sub(lane) as u32).unwrap_or(0);
    below(to) & !below(from)
}

/// Calls `stop_at` for the chosen lanes by ascending number, until it returns true; tells whether it did.
#[inline(always)]
pub fn any(mut chosen: Chosen, mut stop_at: impl FnMut(usize) -> bool) -> bool {
    while chosen != 0 {
        if stop_at(chosen.trailing_zeros() as usize / 8) {
            return true;
        }
        chosen &= chosen - 1;
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lanes(chosen: Chosen) -> Vec<usize> {
        let mut lanes = Vec::new();
        any(chosen, |lane| {
            lanes.push(lane);
            false
        });
        lanes
    }

    #[test]
    fn chosen_are_the_lanes_within() {
        let x: Lanes = std::array::from_fn(|k| k as f64);
        let (y, z) = ([2.0; LANES], [-1.0; LANES]);
        let near = |at: f64, radius: f64| near(&x, &y, &z, &[at, 2.0, -1.0], radius * radius);
        assert_eq!(lanes(near(3.0, 2.0)), [2, 3, 4], "a distance of just the radius is not within");
        let ones = near(3.0, 100.0);
        let among = |from, to| lanes(ones & among(from, to));
        assert_eq!(among(0, 8), [0, 1, 2, 3, 4, 5, 6, 7]);
        assert_eq!((among(3, 5), among(6, 20), among(0, 0)), (vec![3, 4], vec![6, 7], vec![]));
        let mut last = 0;
        assert!(any(ones, |lane| {
            last = lane;
            lane == 5
        }));
        assert_eq!(last, 5);
    }
}
