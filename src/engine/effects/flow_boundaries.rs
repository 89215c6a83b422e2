//! Fluid that comes in and goes out.
//!
//! **Inflow** through a rectangle, at a speed along its normal. Behind it stand four layers of prescribed particles, a
//! particle distance apart, that move in at that speed: to the flow they are a wall that moves, two layers with pressure
//! and two without. A layer whose cells lie past the rectangle becomes fluid, and a new one takes the last place. So a
//! layer comes in each `l0 / speed` seconds, which is `speed x area` by volume, whatever the step.
//!
//! **Outflow** boxes: a fluid particle inside one at the start of a step is taken out.
//!
//! Particles come from a reserve that the scene states, ghosts inside the bucket domain, and go back to it; nothing is
//! allocated while a simulation runs. A particle that comes in is a new one, whatever its index was before: indices tell
//! particles apart only while these stay in the flow. Fluid that leaves the bucket domain elsewhere is lost, counted as ever,
//! and does not refill the reserve.
//!
//! The reserve, the layers and their way are shown with the state. Without them, from particles alone, a run cannot be
//! gone on with: the layers would be laid anew where the old ones stand as walls.

use crate::base::vec3::{Vec3, ZERO};
use crate::engine::columns::{Column, Visitor};
use crate::engine::error::SimulationError;
use crate::engine::kernel::Dimensions;
use crate::engine::parameters::{Domain, Parameters};
use crate::engine::particles::{Kind, Particles};
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::search::CandidateSearch;
use crate::engine::stage::{Stage, State};
use crate::engine::time_step::StepLimit;

/// Layers of prescribed particles behind an inflow: the Laplacian's usual radius is 3.1 particle distances.
pub const LAYERS: usize = 4;
/// How many of them have a pressure.
const WITH_PRESSURE: usize = 2;

/// Where fluid comes in and goes out.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FlowBoundaries {
    pub inflows: Vec<Inflow>,
    pub outflows: Vec<Outflow>,
}

/// A rectangle normal to an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Inflow {
    /// Lower corner, metres.
    pub low_m: Vec3,
    /// Upper corner, metres; the same as the lower one along `axis`.
    pub high_m: Vec3,
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// Along the axis, metres per second; the sign says to which side.
    pub speed_m_s: f64,
    /// What particles that come in are, where the scene has such columns.
    pub group: u8,
    pub temperature: f64,
    pub concentration: f64,
}

/// A box that takes out fluid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outflow {
    /// Lower corner, metres.
    pub low_m: Vec3,
    /// Upper corner, metres.
    pub high_m: Vec3,
}

/// What came and went so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FlowReport {
    /// Particles that became fluid.
    pub entered: usize,
    /// Particles that an outflow took out.
    pub left: usize,
    /// Particles that wait.
    pub reserve: usize,
}

impl Inflow {
    /// The places of a layer whose cells end at the rectangle; rows of `l0`, of which the last may be cut off.
    pub fn places(&self, l0: f64, dimensions: Dimensions) -> Vec<Vec3> {
        let count = |d: usize| match d {
            d if d == self.axis => 1,
            2 if dimensions == Dimensions::Two => 1,
            d => ((self.high_m[d] - self.low_m[d]) / l0).round() as usize,
        };
        let at = |d: usize, k: usize| match d {
            d if d == self.axis => self.low_m[d],
            2 if dimensions == Dimensions::Two => 0.0,
            d => self.low_m[d] + (k as f64 + 0.5) * l0,
        };
        let mut places = Vec::with_capacity(count(0) * count(1) * count(2));
        for i in 0..count(0) {
            for j in 0..count(1) {
                places.extend((0..count(2)).map(|k| [at(0, i), at(1, j), at(2, k)]));
            }
        }
        places
    }

    fn velocity(&self) -> Vec3 {
        let mut velocity = ZERO;
        velocity[self.axis] = self.speed_m_s;
        velocity
    }
}

impl Outflow {
    fn holds(&self, x: Vec3) -> bool {
        (0..3).all(|d| x[d] >= self.low_m[d] && x[d] <= self.high_m[d])
    }
}

/// How many ghosts left the domain, and do not wait inside it to be let in.
pub fn ghosts_outside(particles: &Particles, domain: &Domain) -> usize {
    let outside = |i: &usize| particles.kind[*i] == Kind::Ghost && !inside(particles.position[*i], domain);
    (0..particles.len()).filter(outside).count()
}

fn inside(x: Vec3, domain: &Domain) -> bool {
    (0..3).all(|d| x[d] >= domain.low[d] && x[d] <= domain.high[d])
}

/// The stage.
#[derive(Debug)]
pub struct FlowBoundary {
    boundaries: FlowBoundaries,
    particle_distance_m: f64,
    /// Where particles wait.
    waiting_m: Vec3,
    /// The places of a layer of each inflow.
    places: Vec<Vec<Vec3>>,
    /// The particles of the layers, an inflow after another, the foremost layer first; empty before the first step.
    layers: Vec<u32>,
    /// How far the layers of each inflow are past their first places, metres.
    way_m: Vec<f64>,
    /// Particles that wait; the last is the next.
    reserve: Vec<u32>,
    entered: usize,
    left: usize,
}

impl FlowBoundary {
    pub fn new<C: CandidateSearch>(
        boundaries: FlowBoundaries,
        parameters: &Parameters,
        state: &State<C>,
    ) -> Self {
        let Particles { kind, position, .. } = &state.particles;
        let l0 = parameters.particle_distance_m;
        let places: Vec<_> =
            boundaries.inflows.iter().map(|inflow| inflow.places(l0, parameters.dimensions)).collect();
        let mut reserve = Vec::with_capacity(kind.len());
        let waits =
            |&i: &u32| kind[i as usize] == Kind::Ghost && inside(position[i as usize], &parameters.domain);
        reserve.extend((0..kind.len() as u32).rev().filter(waits));
        FlowBoundary {
            particle_distance_m: l0,
            waiting_m: parameters.domain.low,
            layers: Vec::with_capacity(places.iter().map(|places| LAYERS * places.len()).sum()),
            way_m: vec![0.0; boundaries.inflows.len()],
            places,
            boundaries,
            reserve,
            entered: 0,
            left: 0,
        }
    }

    /// Takes a particle out of the reserve for an inflow.
    fn take(
        &mut self,
        inflow: usize,
        step: usize,
        particles: &mut Particles,
    ) -> Result<u32, SimulationError> {
        let Some(slot) = self.reserve.pop() else {
            return Err(SimulationError::ReserveExhausted { step, inflow });
        };
        let (i, inflow) = (slot as usize, &self.boundaries.inflows[inflow]);
        particles.kind[i] = Kind::DummyWall;
        particles.velocity[i] = inflow.velocity();
        particles.acceleration[i] = ZERO;
        if let Some(group) = particles.group.get_mut(i) {
            *group = inflow.group;
        }
        let scalars = [
            (&mut particles.temperature, inflow.temperature),
            (&mut particles.concentration, inflow.concentration),
            (&mut particles.pressure, 0.0),
            (&mut particles.number_density, 0.0),
        ];
        for (column, value) in scalars {
            if let Some(entry) = column.get_mut(i) {
                *entry = value;
            }
        }
        Ok(slot)
    }

    /// Lays the layers before the first step.
    fn lay(&mut self, step: usize, particles: &mut Particles) -> Result<(), SimulationError> {
        for inflow in 0..self.places.len() {
            for _ in 0..LAYERS * self.places[inflow].len() {
                let slot = self.take(inflow, step, particles)?;
                self.layers.push(slot);
            }
        }
        Ok(())
    }

    fn take_out(&mut self, particles: &mut Particles) {
        for i in 0..particles.len() {
            let x = particles.position[i];
            if particles.kind[i] == Kind::Fluid && self.boundaries.outflows.iter().any(|box_| box_.holds(x)) {
                particles.kind[i] = Kind::Ghost;
                particles.position[i] = self.waiting_m;
                (particles.velocity[i], particles.acceleration[i]) = (ZERO, ZERO);
                for column in [&mut particles.pressure, &mut particles.number_density] {
                    if let Some(value) = column.get_mut(i) {
                        *value = 0.0;
                    }
                }
                self.reserve.push(i as u32);
                self.left += 1;
            }
        }
    }

    /// Lets go the layers that are past the rectangle, and moves the others to their places at the end of the step.
    fn let_in(&mut self, step: usize, dt: f64, particles: &mut Particles) -> Result<(), SimulationError> {
        let (l0, mut first) = (self.particle_distance_m, 0);
        for inflow in 0..self.places.len() {
            let width = self.places[inflow].len();
            let range = first..first + LAYERS * width;
            let speed = self.boundaries.inflows[inflow].speed_m_s;
            while self.way_m[inflow] >= l0 {
                for k in 0..width {
                    particles.kind[self.layers[range.start + k] as usize] = Kind::Fluid;
                    self.layers[range.start + k] = self.take(inflow, step, particles)?;
                }
                self.layers[range.clone()].rotate_left(width);
                self.way_m[inflow] -= l0;
                self.entered += width;
            }
            self.way_m[inflow] += speed.abs() * dt;
            let (axis, way_m) = (self.boundaries.inflows[inflow].axis, self.way_m[inflow]);
            for (k, &slot) in self.layers[range.clone()].iter().enumerate() {
                let (layer, mut place) = (k / width, self.places[inflow][k % width]);
                place[axis] += speed.signum() * (way_m - (layer as f64 + 0.5) * l0);
                particles.position[slot as usize] = place;
                particles.kind[slot as usize] =
                    if layer < WITH_PRESSURE { Kind::Wall } else { Kind::DummyWall };
            }
            first = range.end;
        }
        Ok(())
    }
}

impl<C: CandidateSearch, T> Stage<C, T> for FlowBoundary {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        within(probe, Phase::FlowBoundaries, || {
            let (step, dt, particles) = (state.step, state.time_step_s, &mut state.particles);
            if self.layers.is_empty() {
                self.lay(step, particles)?;
            }
            self.take_out(particles);
            self.let_in(step, dt, particles)?;
            let FlowBoundary { entered, left, .. } = *self;
            state.flow = Some(FlowReport { entered, left, reserve: self.reserve.len() });
            state.walls_moved = true;
            state.positions_changed();
            Ok(())
        })
    }

    fn bytes(&self) -> usize {
        let places = self.places.iter().map(|places| size_of_val(&places[..])).sum::<usize>();
        places + (self.layers.capacity() + self.reserve.capacity()) * size_of::<u32>()
    }

    fn visit(&mut self, visitor: &mut Visitor<'_>) {
        visitor("inflow_layers", Column::Indices(&mut self.layers));
        visitor("inflow_way", Column::Scalars(&mut self.way_m));
        visitor("reserve", Column::Indices(&mut self.reserve));
        visitor("entered", Column::Count(&mut self.entered));
        visitor("left", Column::Count(&mut self.left));
    }

    fn longest_step(&self, _state: &State<C>) -> Option<StepLimit> {
        let fastest = self.boundaries.inflows.iter().map(|inflow| inflow.speed_m_s.abs()).fold(0.0, f64::max);
        let time_step_s = self.particle_distance_m / fastest;
        (fastest > 0.0).then_some(StepLimit { time_step_s, reason: "a layer of an inflow" })
    }
}
