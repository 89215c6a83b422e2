//! Start-up of plane Poiseuille flow: the fluid is accelerated by 1e-4 m/s2.

use crate::engine::viscous::Walls;
use crate::scene::validation::channel::SCHEMES;
use crate::scene::validation::startup::Drive;
use crate::scene::validation::{Fidelity, Outcome};

pub const DRIVE: Drive =
    Drive { case: "start-up of plane Poiseuille flow", speed_m_s: 0.0, force_m_s2: 1e-4 };

/// Start-up with mirrored walls, 40 particles across; 80 in full. Implicit also with steps of 200 times the explicit limit,
/// judged when the flow is steady.
pub fn run(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let across = if fidelity == Fidelity::Full { 80 } else { 40 };
    let mut outcomes = Vec::new();
    for scheme in SCHEMES {
        outcomes.extend(DRIVE.run(across, scheme, Walls::Mirrored, None)?);
        if scheme.implicit {
            let long = Drive { case: "plane Poiseuille flow, 200 times the explicit limit", ..DRIVE };
            outcomes.extend(long.run(across, scheme, Walls::Mirrored, Some(200.0))?.pop());
        }
    }
    Ok(outcomes)
}
