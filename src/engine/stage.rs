//! What the stages of a step share, and what a stage is.

use std::sync::Arc;

use crate::base::parallel::{FirstIndex, Rows, Team, Workers};
use crate::base::vec3::{Vec3, ZERO};
use crate::engine::columns::{Column, Visitor};
use crate::engine::effects::flow_boundaries::FlowReport;
use crate::engine::error::SimulationError;
use crate::engine::parameters::Domain;
use crate::engine::particles::{Kind, Particles};
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::pressure::PressureReport;
use crate::engine::pressure::conjugate_gradient::CgInfo;
use crate::engine::search::grid::{Buckets, Grid};
use crate::engine::search::{CandidateSearch, Lengths, NONE, Neighborhood, Now};
use crate::engine::time_step::StepLimit;

/// One part of a step: an effect that the scene names, or the motion between them. A stage owns the columns that
/// nobody else needs, and exists only if the scene calls for it.
pub trait Stage<C: CandidateSearch, T>: Send {
    /// Advances `state` by this stage, each phase of it announced to `probe`.
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError>;

    /// Bytes that the stage's own columns take.
    fn bytes(&self) -> usize {
        0
    }

    /// Shows what the next step depends on beside the particles, so that a step can be taken back and a run go on later.
    fn visit(&mut self, _visitor: &mut Visitor<'_>) {}

    /// The longest step in which the stage is stable from the present state, seconds, and what limits it.
    fn longest_step(&self, _state: &State<C>) -> Option<StepLimit> {
        None
    }
}

/// The particles, and who finds their neighbours.
#[derive(Debug)]
pub struct State<C> {
    pub particles: Particles,
    pub workers: Arc<Workers>,
    /// The number of the step under way, from 1.
    pub step: usize,
    /// Simulated time at the start of the step under way, seconds.
    pub time_s: f64,
    /// Length of the step under way, seconds.
    pub time_step_s: f64,
    /// Particles that left the bucket domain so far.
    pub ghosts: usize,
    /// What the pressure solve of this step met; stays `None` in a scene without pressure.
    pub pressure: Option<PressureReport>,
    /// What came and went; stays `None` in a scene without flow boundaries.
    pub flow: Option<FlowReport>,
    /// Whether walls move: what was worked out from their places then holds for one step.
    pub walls_moved: bool,
    /// What the solve of implicit viscosity met in this step; stays `None` in a scene without it.
    pub viscosity: Option<CgInfo>,
    pub candidates: C,
    lengths: Lengths,
    buckets: Buckets,
    /// Whether the buckets are those of the present positions.
    fresh: bool,
    /// Whether walls, which mostly rest, have been sorted into buckets.
    walls_assigned: bool,
}

impl<C: CandidateSearch> State<C> {
    pub fn new(
        particles: Particles,
        grid: Grid,
        lengths: Lengths,
        workers: Arc<Workers>,
        time_step_s: f64,
    ) -> Self {
        let candidates = C::new(&grid, lengths, particles.len());
        Self::with_search(candidates, particles, grid, lengths, workers, time_step_s)
    }

    /// The same with a search that is made already, over as many particles.
    pub fn with_search(
        candidates: C,
        particles: Particles,
        grid: Grid,
        lengths: Lengths,
        workers: Arc<Workers>,
        time_step_s: f64,
    ) -> Self {
        let count = particles.len();
        State {
            ghosts: particles.count(Kind::Ghost),
            candidates,
            lengths,
            buckets: Buckets { grid, of_particle: workers.column(count, NONE) },
            particles,
            workers,
            step: 0,
            time_s: 0.0,
            time_step_s,
            pressure: None,
            flow: None,
            walls_moved: false,
            viscosity: None,
            fresh: false,
            walls_assigned: false,
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
        self.refresh_within(self.lengths.large_m, probe)
    }

    /// The same for walks of one radius, metres.
    pub fn refresh_within(&mut self, radius_m: f64, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        if self.fresh && self.candidates.reaches(radius_m) {
            return Ok(());
        }
        within(probe, Phase::BucketBuild, || self.sort_into_buckets(radius_m))?;
        if self.candidates.relocates() {
            within(probe, Phase::Relocation, || {
                let team = self.workers.scheduled();
                self.candidates.relocate(&self.buckets, &self.particles.position, team);
            });
        }
        self.fresh = true;
        Ok(())
    }

    fn sort_into_buckets(&mut self, radius_m: f64) -> Result<(), SimulationError> {
        if self.buckets.grid.domain().periodic != [false; 3] {
            self.bring_back_into_period();
        }
        let Particles { kind, position, .. } = &self.particles;
        let walls_too = self.walls_moved || !self.walls_assigned;
        let assigned = self.buckets.assign(kind, position, walls_too, self.workers.scheduled());
        self.walls_assigned = true;
        if let Some(particle) = assigned.not_finite {
            let (step, phase) = (self.step, Phase::BucketBuild);
            return Err(SimulationError::NotFinite { step, phase, particle, quantity: "position" });
        }
        if assigned.someone_left {
            self.retire_those_outside();
        }
        let Particles { kind, position, .. } = &self.particles;
        let now = Now { kind, position, radius_m, walls_moved: self.walls_moved };
        self.candidates.build(&self.buckets, now, &self.workers);
        Ok(())
    }

    /// Moves particles that crossed the end of a periodic axis to where they come in again.
    fn bring_back_into_period(&mut self) {
        let Domain { low, high, periodic } = *self.buckets.grid.domain();
        let position = Rows::new(&mut self.particles.position);
        self.workers.scheduled().fill(position, |_, position| {
            for x in position {
                for d in (0..3).filter(|&d| periodic[d]) {
                    // Positions that are not finite stay as they are, for the assignment to find.
                    if x[d] < low[d] || x[d] >= high[d] {
                        let period = high[d] - low[d];
                        let inside = x[d] - period * ((x[d] - low[d]) / period).floor();
                        x[d] = if inside < high[d] { inside } else { low[d] };
                    }
                }
            }
        });
    }

    /// Shows the particles' columns and the numbers of the step.
    pub fn visit(&mut self, visitor: &mut Visitor<'_>) {
        self.particles.visit(visitor);
        visitor("step", Column::Count(&mut self.step));
        visitor("ghosts", Column::Count(&mut self.ghosts));
        visitor("time", Column::Number(&mut self.time_s));
        visitor("time_step", Column::Number(&mut self.time_step_s));
        self.candidates.visit(visitor);
        (self.fresh, self.walls_assigned) = (false, false);
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
        let Particles {
            kind,
            position,
            velocity,
            acceleration,
            pressure,
            number_density: _,
            group,
            temperature,
            temperature_rate,
            concentration,
            concentration_rate,
            viscosity,
        } = &mut self.particles;
        Forces {
            near: Neighborhood { candidates: &self.candidates, buckets: &self.buckets, positions: position },
            fields: Fields { kind, group, velocity, pressure, temperature, concentration, viscosity },
            acceleration,
            temperature_rate,
            concentration_rate,
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

/// The columns that stages read while they add to rates. Those that the scene does not call for are empty.
#[derive(Debug, Clone, Copy)]
pub struct Fields<'a> {
    pub kind: &'a [Kind],
    pub group: &'a [u8],
    pub velocity: &'a [Vec3],
    pub pressure: &'a [f64],
    pub temperature: &'a [f64],
    pub concentration: &'a [f64],
    pub viscosity: &'a [f64],
}

impl Fields<'_> {
    /// The group of a particle, 0 where the scene names none.
    #[inline(always)]
    pub fn group_of(&self, i: usize) -> u8 {
        self.group.get(i).copied().unwrap_or(0)
    }
}

/// What a stage needs that adds to the rates of change of particles.
#[derive(Debug)]
pub struct Forces<'a, C> {
    pub near: Neighborhood<'a, C>,
    pub fields: Fields<'a>,
    pub acceleration: &'a mut [Vec3],
    /// Empty in a scene without heat.
    pub temperature_rate: &'a mut [f64],
    /// Empty in a scene without a passive scalar.
    pub concentration_rate: &'a mut [f64],
    pub team: Team<'a>,
}
