//! What is said about a simulation once it is over.

use std::collections::BTreeMap;
use std::io::{self, Write};

use serde::Serialize;

use crate::engine::diagnostics::{FlowState, digest};
use crate::engine::particles::Kind;
use crate::engine::simulation::{Simulation, StepReport};

/// The state in which a simulation ended.
#[derive(Debug, Serialize)]
pub struct Ended {
    particles: usize,
    particles_by_kind: BTreeMap<&'static str, usize>,
    leaks: usize,
    steps: usize,
    wall_s: f64,
    bytes_per_particle: f64,
    front_max_m: f64,
    front_p99_m: f64,
    top_m: f64,
    max_speed_m_s: f64,
    max_pressure_fluid_pa: f64,
    max_pressure_pa: f64,
    /// Of the last step; `None` where the scene names no pressure.
    pressure: Option<LastSolve>,
    digest: String,
}

#[derive(Debug, Serialize)]
struct LastSolve {
    surface: usize,
    unknowns: usize,
    cg_iterations: usize,
    cg_residual: f64,
}

impl Ended {
    pub fn new(simulation: &dyn Simulation, last: &StepReport, leaks: usize, wall_s: f64) -> Ended {
        let particles = simulation.particles();
        let flow = FlowState::of(particles);
        Ended {
            particles: particles.len(),
            particles_by_kind: Kind::ALL
                .into_iter()
                .map(|kind| (kind.name(), particles.count(kind)))
                .collect(),
            leaks,
            steps: last.step,
            wall_s,
            bytes_per_particle: simulation.bytes() as f64 / particles.len() as f64,
            front_max_m: flow.front_max_m,
            front_p99_m: flow.front_p99_m,
            top_m: flow.top_m,
            max_speed_m_s: flow.max_speed_m_s,
            max_pressure_fluid_pa: flow.max_pressure_fluid_pa,
            max_pressure_pa: flow.max_pressure_pa,
            pressure: last.pressure.map(|pressure| LastSolve {
                surface: pressure.surface,
                unknowns: pressure.unknowns,
                cg_iterations: pressure.cg.iterations,
                cg_residual: pressure.cg.residual,
            }),
            digest: digest(particles),
        }
    }

    pub fn print(&self, out: &mut dyn Write) -> io::Result<()> {
        let counts: Vec<String> =
            self.particles_by_kind.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
        writeln!(out, "particles {} ({})", self.particles, counts.join(", "))?;
        writeln!(out, "leaks {}", self.leaks)?;
        writeln!(out, "steps {}", self.steps)?;
        writeln!(out, "wall_s {:.3}", self.wall_s)?;
        writeln!(out, "bytes_per_particle {:.0}", self.bytes_per_particle)?;
        writeln!(out, "front_max_m {:.9}", self.front_max_m)?;
        writeln!(out, "front_p99_m {:.9}", self.front_p99_m)?;
        writeln!(out, "top_m {:.9}", self.top_m)?;
        writeln!(out, "max_speed_m_s {:.6}", self.max_speed_m_s)?;
        writeln!(out, "max_pressure_fluid_pa {:.4}", self.max_pressure_fluid_pa)?;
        writeln!(out, "max_pressure_pa {:.4}", self.max_pressure_pa)?;
        if let Some(pressure) = &self.pressure {
            writeln!(out, "surface {}", pressure.surface)?;
            writeln!(out, "unknowns {}", pressure.unknowns)?;
            writeln!(out, "cg_iterations {}", pressure.cg_iterations)?;
            writeln!(out, "cg_residual {:e}", pressure.cg_residual)?;
        }
        writeln!(out, "digest {}", self.digest)
    }
}
