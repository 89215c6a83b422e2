//! Pair terms: what an effect adds for each pair of neighbours, and the one walk that serves several of them.
//!
//! A term knows no search and a search no term. A walk over one term is compiled for it alone; terms of one stage and
//! radius are joined in a tuple and share a walk, whose price is mostly that of finding the pairs. Which terms there are
//! is decided once, when the simulation is built.

use crate::base::parallel::{FirstIndex, Rows};
use crate::base::vec3::{Vec3, is_finite};
use crate::engine::error::SimulationError;
use crate::engine::kernel::weight;
use crate::engine::particles::{Kind, Particles};
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::{Fields, Forces, Stage, State};
use crate::engine::time_step::StepLimit;

/// A neighbour `j` of particle `i`.
#[derive(Debug, Clone, Copy)]
pub struct Pair {
    pub i: usize,
    pub j: usize,
    /// `x_j - x_i`, metres.
    pub r_ij: Vec3,
    /// `|r_ij|`, metres.
    pub r: f64,
    /// `w(r, re)` at the walk's radius, dimensionless.
    pub w: f64,
}

/// The rates of one particle, to which terms add.
#[derive(Debug)]
pub struct Rates<'a> {
    /// Metres per second squared.
    pub acceleration: &'a mut Vec3,
    /// Kelvin per second; `None` in a scene without heat.
    pub temperature: Option<&'a mut f64>,
    /// Per second; `None` in a scene without a passive scalar.
    pub concentration: Option<&'a mut f64>,
}

/// What an effect adds for each pair. Each particle gathers its own sum, in the order in which its neighbours come.
pub trait PairTerm: Send + Sync {
    type Sum: Default;

    /// Takes note of where particles are before a walk: their buckets are those of the present positions.
    fn prepare<C: CandidateSearch, T: DistanceTest>(&mut self, _state: &State<C>) {}

    /// Adds the share of one neighbour.
    fn add(&self, sum: &mut Self::Sum, pair: &Pair, fields: &Fields<'_>);

    /// Adds what the sum makes of particle `i` to its rates.
    fn finish(&self, sum: Self::Sum, i: usize, fields: &Fields<'_>, rates: &mut Rates<'_>);

    /// Whether particles of a kind gather a sum at all.
    fn acts_on(&self, kind: Kind) -> bool {
        kind.moves()
    }

    /// Bytes of the term's own columns.
    fn bytes(&self) -> usize {
        0
    }

    /// The longest step in which the term is stable, seconds, and what limits it.
    fn longest_step(&self, _particles: &Particles) -> Option<StepLimit> {
        None
    }
}

/// No term: it takes its place in a tuple and leaves no code in the walk.
#[derive(Debug, Clone, Copy)]
pub struct Absent;

impl PairTerm for Absent {
    type Sum = ();

    #[inline(always)]
    fn add(&self, (): &mut (), _pair: &Pair, _fields: &Fields<'_>) {}

    #[inline(always)]
    fn finish(&self, (): (), _i: usize, _fields: &Fields<'_>, _rates: &mut Rates<'_>) {}

    fn acts_on(&self, _kind: Kind) -> bool {
        false
    }
}

/// Two terms in one walk; more of them are pairs of pairs.
impl<A: PairTerm, B: PairTerm> PairTerm for (A, B) {
    type Sum = (A::Sum, B::Sum);

    fn prepare<C: CandidateSearch, T: DistanceTest>(&mut self, state: &State<C>) {
        self.0.prepare::<C, T>(state);
        self.1.prepare::<C, T>(state);
    }

    #[inline(always)]
    fn add(&self, sum: &mut Self::Sum, pair: &Pair, fields: &Fields<'_>) {
        self.0.add(&mut sum.0, pair, fields);
        self.1.add(&mut sum.1, pair, fields);
    }

    #[inline(always)]
    fn finish(&self, sum: Self::Sum, i: usize, fields: &Fields<'_>, rates: &mut Rates<'_>) {
        if self.0.acts_on(fields.kind[i]) {
            self.0.finish(sum.0, i, fields, rates);
        }
        if self.1.acts_on(fields.kind[i]) {
            self.1.finish(sum.1, i, fields, rates);
        }
    }

    fn acts_on(&self, kind: Kind) -> bool {
        self.0.acts_on(kind) || self.1.acts_on(kind)
    }

    fn bytes(&self) -> usize {
        self.0.bytes() + self.1.bytes()
    }

    fn longest_step(&self, particles: &Particles) -> Option<StepLimit> {
        let limits = [self.0.longest_step(particles), self.1.longest_step(particles)];
        limits.into_iter().flatten().reduce(StepLimit::or)
    }
}

/// The stage that walks once over all pairs within a radius, for all its terms.
#[derive(Debug)]
pub struct PairPass<P> {
    pub term: P,
    /// Metres.
    pub radius_m: f64,
    /// That of the term or, where several share the walk, [`Phase::PairTerms`].
    pub phase: Phase,
}

impl<C: CandidateSearch, T: DistanceTest, P: PairTerm> Stage<C, T> for PairPass<P> {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        state.refresh(probe)?;
        let broken = FirstIndex::default();
        within(probe, self.phase, || {
            self.term.prepare::<C, T>(state);
            self.walk::<C, T>(state, &broken);
        });
        state.require_finite(&broken, self.phase, "acceleration")
    }

    fn bytes(&self) -> usize {
        self.term.bytes()
    }

    fn longest_step(&self, state: &State<C>) -> Option<StepLimit> {
        self.term.longest_step(&state.particles)
    }
}

impl<P: PairTerm> PairPass<P> {
    fn walk<C: CandidateSearch, T: DistanceTest>(&self, state: &mut State<C>, broken: &FirstIndex) {
        let Forces { near, fields, acceleration, temperature_rate, concentration_rate, team, .. } =
            state.forces();
        let (term, radius_m) = (&self.term, self.radius_m);
        let columns =
            (Rows::new(acceleration), Rows::if_there(temperature_rate), Rows::if_there(concentration_rate));
        team.fill(columns, |range, (acceleration, temperature, concentration)| {
            for (k, i) in range.enumerate() {
                if !term.acts_on(fields.kind[i]) {
                    continue;
                }
                let mut sum = P::Sum::default();
                near.for_each_neighbor::<T>(i, radius_m, |j, r_ij, r| {
                    term.add(&mut sum, &Pair { i, j, r_ij, r, w: weight(r, radius_m) }, &fields);
                });
                let mut rates = Rates {
                    acceleration: &mut acceleration[k],
                    temperature: temperature.get_mut(k),
                    concentration: concentration.get_mut(k),
                };
                term.finish(sum, i, &fields, &mut rates);
                if !is_finite(acceleration[k]) {
                    broken.record(i);
                }
            }
        });
    }
}
