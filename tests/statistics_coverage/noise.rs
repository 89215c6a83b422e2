//! Rounds of a machine that does not exist: logarithms of the times of some cells, in the order of the rounds.

use fastrand::Rng;

/// The most rounds of an experiment.
pub const MOST: usize = 30;

/// The scale of a cell's own noise: one per cent of its time.
const SCALE: f64 = 0.01;

/// The log-times of all cells of a round, the base last.
pub type Round = Vec<f64>;

/// A machine disturbs trials, one after another; a cell adds noise of its own in each round.
#[derive(Clone, Copy)]
pub struct Setting {
    pub name: &'static str,
    machine: fn(&mut Rng, usize) -> Vec<f64>,
    /// Noise of a variant in successive rounds, in units of the scale.
    variant: fn(&mut Rng) -> Vec<f64>,
    base: fn(&mut Rng) -> Vec<f64>,
    /// The true median of a variant's noise minus the base's, in units of the scale.
    median_of_difference: f64,
    /// The true median of the base's noise.
    median_of_base: f64,
}

impl Setting {
    /// The rounds of an experiment with a number of variants. The cells of a round stand in random order on the machine.
    pub fn rounds(&self, random: &mut Rng, variants: usize) -> Vec<Round> {
        let cells = variants + 1;
        let machine = (self.machine)(random, cells * MOST);
        let mut own: Vec<Vec<f64>> = (0..variants).map(|_| (self.variant)(random)).collect();
        own.push((self.base)(random));
        let mut places: Vec<usize> = (0..cells).collect();
        let mut round = |r: usize| {
            random.shuffle(&mut places);
            (0..cells).map(|cell| SCALE * (own[cell][r] + machine[r * cells + places[cell]])).collect()
        };
        (0..MOST).map(&mut round).collect()
    }

    /// The true logarithm of a variant's ratio.
    pub fn true_ratio(&self) -> f64 {
        SCALE * self.median_of_difference
    }

    /// The true median of the base's log-time, where the machine has one.
    pub fn true_base(&self) -> f64 {
        SCALE * self.median_of_base
    }
}

const STILL: Setting = Setting {
    name: "normal",
    machine: still,
    variant: normal,
    base: normal,
    median_of_difference: 0.0,
    median_of_base: 0.0,
};

pub const NORMAL: Setting = STILL;
/// All the skew is in the variant, so that the ratio has it as well.
pub const EXPONENTIAL: Setting = Setting {
    name: "skewed: exponential",
    variant: exponential,
    base: none,
    median_of_difference: std::f64::consts::LN_2,
    ..STILL
};
pub const LOGNORMAL: Setting = Setting {
    name: "skewed: lognormal, sigma 1",
    variant: |random| series(random, |random| gauss(random).exp()),
    base: none,
    median_of_difference: 1.0,
    ..STILL
};
pub const STUDENT_2: Setting =
    Setting { name: "heavy tails: Student, 2 degrees", variant: |r| student(r, 2), base: none, ..STILL };
pub const STUDENT_3: Setting =
    Setting { name: "heavy tails: Student, 3 degrees", variant: |r| student(r, 3), base: none, ..STILL };
/// One trial in ten of either cell is slower by a Pareto time, whose mean is infinite.
pub const SPIKES: Setting =
    Setting { name: "heavy tails: Pareto spikes", variant: spikes, base: spikes, ..STILL };
pub const DRIFT: Setting = Setting {
    name: "drifting: half a sigma a trial",
    machine: |_, trials| (0..trials).map(|trial| 0.5 * trial as f64).collect(),
    ..STILL
};
pub const WALK: Setting = Setting {
    name: "drifting: random walk",
    machine: |random, trials| autocorrelated(random, trials, 1.0, 1.0),
    ..STILL
};
pub const AUTOCORRELATED: Setting = Setting {
    name: "autocorrelated: rho 0.7, 3 sigma",
    machine: |random, trials| autocorrelated(random, trials, 0.7, 3.0 * (1.0f64 - 0.49).sqrt()),
    ..STILL
};

/// The hardest: the ratio itself depends on the round before, or has no mass at its median.
pub const RATIO_0_2: Setting = Setting {
    name: "ratio autocorrelated: rho 0.2",
    variant: |random| autocorrelated(random, MOST, 0.2, 0.98),
    base: none,
    ..STILL
};
pub const RATIO_0_3: Setting = Setting {
    name: "ratio autocorrelated: rho 0.3",
    variant: |random| autocorrelated(random, MOST, 0.3, 0.954),
    base: none,
    ..STILL
};
pub const RATIO_0_5: Setting = Setting {
    name: "ratio autocorrelated: rho 0.5",
    variant: |random| autocorrelated(random, MOST, 0.5, 0.866),
    base: none,
    ..STILL
};
pub const TWO_MODES: Setting = Setting {
    name: "two modes, ten sigma apart",
    variant: |random| series(random, |random| 5.0 * f64::from(random.i8(0..2) * 2 - 1) + gauss(random)),
    base: none,
    ..STILL
};

/// Absolute times: what skews a cell's own time skews the base's, too.
pub const BOTH_EXPONENTIAL: Setting = Setting {
    name: "skewed: exponential",
    variant: exponential,
    base: exponential,
    median_of_base: std::f64::consts::LN_2,
    ..STILL
};
pub const BOTH_STUDENT_2: Setting = Setting {
    name: "heavy tails: Student, 2 degrees",
    variant: |random| student(random, 2),
    base: |random| student(random, 2),
    ..STILL
};

fn still(_: &mut Rng, trials: usize) -> Vec<f64> {
    vec![0.0; trials]
}

fn none(_: &mut Rng) -> Vec<f64> {
    vec![0.0; MOST]
}

fn series(random: &mut Rng, one: impl Fn(&mut Rng) -> f64) -> Vec<f64> {
    (0..MOST).map(|_| one(random)).collect()
}

fn normal(random: &mut Rng) -> Vec<f64> {
    series(random, gauss)
}

fn exponential(random: &mut Rng) -> Vec<f64> {
    series(random, |random| -uniform(random).ln())
}

fn student(random: &mut Rng, degrees: usize) -> Vec<f64> {
    let chi_squared = |random: &mut Rng| (0..degrees).map(|_| gauss(random).powi(2)).sum::<f64>();
    series(random, |random| gauss(random) / (chi_squared(random) / degrees as f64).sqrt())
}

fn spikes(random: &mut Rng) -> Vec<f64> {
    let spike = |random: &mut Rng| if random.f64() < 0.1 { 3.0 / uniform(random) } else { 0.0 };
    series(random, |random| gauss(random) + spike(random))
}

/// Each value is `rho` times the last one plus a normal step; from the stationary distribution where there is one.
fn autocorrelated(random: &mut Rng, length: usize, rho: f64, step: f64) -> Vec<f64> {
    let sigma = if rho < 1.0 { step / (1.0 - rho * rho).sqrt() } else { 0.0 };
    let first = sigma * gauss(random);
    let next = |value: &f64| Some(rho * value + step * gauss(random));
    std::iter::successors(Some(first), next).take(length).collect()
}

/// Above 0, at most 1.
fn uniform(random: &mut Rng) -> f64 {
    1.0 - random.f64()
}

/// A standard normal number, by Box and Muller.
fn gauss(random: &mut Rng) -> f64 {
    (-2.0 * uniform(random).ln()).sqrt() * (std::f64::consts::TAU * random.f64()).cos()
}
