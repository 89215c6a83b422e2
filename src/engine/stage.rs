//! What the stages of a step share, and what a stage is.

use std::sync::Arc;

use crate::base::parallel::{FirstIndex, Team, Workers};
use crate::base::vec3::{Vec3, ZERO};
use crate::engine::error::SimulationError;
use crate::engine::particles::{Kind, Particles};
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::pressure::PressureReport;
use crate::engine::search::grid::{Buckets, Grid};
use crate::engine::search::{CandidateSearch, NONE, Neighborhood};

/// One part of a step: an effect that the scene names, or the motion between them. A stage owns the columns that
/// nobody else needs, and exists only if the scene calls for it.
pub trait Stage<C: CandidateSearch, T>: Send {
    /// Advances `state` by this stage, each phase of it announced to `probe`.
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError>;

    /// Bytes that the stage's own columns take.
    fn bytes(&self) -> usize {
        0
    }
}

/// The particles, and who finds their neighbours.
#[derive(Debug)]
pub struct State<C> {
    pub particles: Particles,
    pub workers: Arc<Workers>,
    /// The number of the step under way, from 1.
    pub step: usize,
    /// Particles that left the bucket domain so far.
    pub ghosts: usize,
    /// What the pressure solve of this step met; stays `None` in a scene without pressure.
    pub pressure: Option<PressureReport>,
    candidates: C,
    buckets: Buckets,
    /// Whether the buckets are those of the present positions.
    fresh: bool,
}

impl<C: CandidateSearch> State<C> {
    pub fn new(particles: Particles, grid: Grid, workers: Arc<Workers>) -> Self {
        let count = particles.len();
        State {
            ghosts: particles.count(Kind::Ghost),
            candidates: C::new(&grid, count),
            buckets: Buckets { grid, of_particle: workers.column(count, NONE) },
            particles,
            workers,
            step: 0,
            pressure: None,
            fresh: false,
        }
    }

    /// The team that walks over particles.
    pub fn team(&self) -> Team<'_> {
        self.workers.scheduled()
    }

    /// Says that positions have changed, so that the next walk sorts the particles anew.
    pub fn positions_changed(&mut self) {
        self.fresh = false;
    }

    /// Phases `bucket_build` and `relocation`: brings the buckets up to date, if positions changed since the last time.
    pub fn refresh(&mut self, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        if self.fresh {
            return Ok(());
        }
        within(probe, Phase::BucketBuild, || self.sort_into_buckets())?;
        if C::RELOCATES {
            within(probe, Phase::Relocation, || {
                self.candidates.relocate(&self.particles.position, self.workers.scheduled());
            });
        }
        self.fresh = true;
        Ok(())
    }

    fn sort_into_buckets(&mut self) -> Result<(), SimulationError> {
        let Particles { kind, position, .. } = &self.particles;
        let assigned = self.buckets.assign(kind, position, self.workers.scheduled());
        if let Some(particle) = assigned.not_finite {
            let (step, phase) = (self.step, Phase::BucketBuild);
            return Err(SimulationError::NotFinite { step, phase, particle, quantity: "position" });
        }
        if assigned.someone_left {
            self.retire_those_outside();
        }
        self.candidates.build(&self.buckets, &self.workers);
        Ok(())
    }

    /// Turns particles that are in no bucket into ghosts: out of all sums for good, velocity and pressure zero.
    fn retire_those_outside(&mut self) {
        let Particles { kind, velocity, acceleration, pressure, number_density, .. } = &mut self.particles;
        for (i, &bucket) in self.buckets.of_particle.iter().enumerate() {
            if bucket == NONE && kind[i] != Kind::Ghost {
                self.ghosts += 1;
                kind[i] = Kind::Ghost;
                (velocity[i], acceleration[i]) = (ZERO, ZERO);
                for column in [&mut *pressure, &mut *number_density] {
                    if let Some(value) = column.get_mut(i) {
                        *value = 0.0;
                    }
                }
            }
        }
    }

    /// Which bucket each particle was in when they were last sorted.
    pub fn buckets(&self) -> &Buckets {
        &self.buckets
    }

    /// The neighbour search at the present positions. [`State::refresh`] must have run since they changed.
    pub fn neighborhood(&self) -> Neighborhood<'_, C> {
        debug_assert!(self.fresh, "a walk needs buckets of the present positions");
        Neighborhood {
            candidates: &self.candidates,
            buckets: &self.buckets,
            positions: &self.particles.position,
        }
    }

    /// The neighbour search beside exclusive access to the accelerations, for a stage that adds forces.
    pub fn forces(&mut self) -> Forces<'_, C> {
        let Particles { kind, position, velocity, acceleration, pressure, .. } = &mut self.particles;
        Forces {
            near: Neighborhood { candidates: &self.candidates, buckets: &self.buckets, positions: position },
            kind,
            velocity,
            pressure,
            acceleration,
            team: self.workers.scheduled(),
        }
    }

    /// An error if `phase` recorded a particle whose `quantity` is not finite: two particles at one place, if the
    /// particle has such a twin, and the quantity itself otherwise.
    pub fn require_finite(
        &self,
        broken: &FirstIndex,
        phase: Phase,
        quantity: &'static str,
    ) -> Result<(), SimulationError> {
        let Some(particle) = broken.get() else {
            return Ok(());
        };
        let Particles { kind, position, .. } = &self.particles;
        let twin = (0..position.len())
            .find(|&j| j != particle && kind[j] != Kind::Ghost && position[j] == position[particle]);
        Err(match twin {
            Some(other) => SimulationError::Coincident { step: self.step, phase, particle, other },
            None => SimulationError::NotFinite { step: self.step, phase, particle, quantity },
        })
    }

    /// Bytes of the particles' columns, the buckets and the search.
    pub fn bytes(&self) -> usize {
        self.particles.bytes() + size_of_val(&self.buckets.of_particle[..]) + self.candidates.bytes()
    }
}

/// What a stage needs that adds to the accelerations of fluid particles.
#[derive(Debug)]
pub struct Forces<'a, C> {
    pub near: Neighborhood<'a, C>,
    pub kind: &'a [Kind],
    pub velocity: &'a [Vec3],
    pub pressure: &'a [f64],
    pub acceleration: &'a mut [Vec3],
    pub team: Team<'a>,
}
