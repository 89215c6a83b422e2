//! Runs a computation with the widest instructions that this processor has, whatever the program was compiled for.
//!
//! The body is compiled once a level. Nothing here changes what it computes, unless it asks for the level itself: the
//! compiler never fuses a product and a sum that are written apart.

/// A set of instructions that a processor may have beyond those that the program was compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Those of the program's target alone.
    Portable,
    /// Four f64 at once, products and sums fused.
    Avx2,
    /// Eight f64 at once, and masks.
    Avx512,
}

/// A computation that is worth compiling for several levels. Its `run` must be `#[inline(always)]`: only what is inlined
/// is compiled for the level.
pub trait Work {
    type Output;
    fn run(self, level: Level) -> Self::Output;
}

impl Level {
    pub fn name(self) -> &'static str {
        match self {
            Level::Portable => "portable",
            Level::Avx2 => "avx2+fma",
            Level::Avx512 => "avx512f",
        }
    }

    /// How many f64 an instruction takes.
    pub const fn lanes(self) -> usize {
        match self {
            Level::Portable => 2,
            Level::Avx2 => 4,
            Level::Avx512 => 8,
        }
    }

    /// Whether `f64::mul_add` is one instruction, and not a call.
    pub const fn fuses(self) -> bool {
        let by_target = cfg!(any(target_feature = "fma", target_arch = "aarch64"));
        by_target || matches!(self, Level::Avx2 | Level::Avx512)
    }

    /// The best level that this processor has.
    pub fn best() -> Level {
        #[cfg(target_arch = "x86_64")]
        {
            let avx2 = is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("fma")
                && is_x86_feature_detected!("popcnt");
            let avx512 = is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512vl");
            if avx2 && avx512 {
                return Level::Avx512;
            }
            if avx2 {
                return Level::Avx2;
            }
        }
        Level::Portable
    }
}

/// Runs `work` at the best level of this processor.
#[inline]
pub fn at_best<W: Work>(work: W) -> W::Output {
    at_most(Level::Avx512, work)
}

/// Runs `work` at the best level of this processor that is not above `limit`.
#[inline]
pub fn at_most<W: Work>(limit: Level, work: W) -> W::Output {
    match Level::best().min(limit) {
        // SAFETY: `best` found the instructions of its level and of those below it.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { with_avx512(work) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => unsafe { with_avx2(work) },
        _ => work.run(Level::Portable),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,popcnt")]
fn with_avx2<W: Work>(work: W) -> W::Output {
    work.run(Level::Avx2)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,popcnt,avx512f,avx512dq,avx512vl")]
fn with_avx512<W: Work>(work: W) -> W::Output {
    work.run(Level::Avx512)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums a product, in an order that no compiler may change.
    struct Dot<'a>(&'a [f64], &'a [f64]);

    impl Work for Dot<'_> {
        type Output = (f64, Level);

        #[inline(always)]
        fn run(self, level: Level) -> (f64, Level) {
            (self.0.iter().zip(self.1).map(|(a, b)| a * b).sum(), level)
        }
    }

    #[test]
    fn every_level_gives_the_bits_of_the_plain_call() {
        let a: Vec<f64> = (0..1001).map(|k| 1.0 / (f64::from(k) + 0.3)).collect();
        let b: Vec<f64> = (0..1001).map(|k| f64::from(k).sqrt()).collect();
        let (plain, _) = Dot(&a, &b).run(Level::Portable);
        for limit in [Level::Portable, Level::Avx2, Level::Avx512] {
            let (sum, level) = at_most(limit, Dot(&a, &b));
            assert_eq!(sum.to_bits(), plain.to_bits(), "{}", level.name());
            assert!(level <= limit);
        }
        assert_eq!(at_best(Dot(&a, &b)), at_most(Level::Avx512, Dot(&a, &b)));
    }
}
