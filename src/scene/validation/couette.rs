//! Start-up of plane Couette flow: the upper wall moves at 1.25e-5 m/s.

use crate::engine::parameters::Property;
use crate::engine::viscous::Walls;
use crate::scene::validation::channel::{self, Channel, SCHEMES, Scheme};
use crate::scene::validation::startup::Drive;
use crate::scene::validation::{Fidelity, Outcome};

pub const DRIVE: Drive =
    Drive { case: "start-up of plane Couette flow", speed_m_s: 1.25e-5, force_m_s2: 0.0 };

/// Start-up with mirrored walls, 40 particles across; 80 in full. Two layers of fluid at as many.
pub fn run(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let across = if fidelity == Fidelity::Full { 80 } else { 40 };
    let mut outcomes = Vec::new();
    for scheme in SCHEMES {
        outcomes.extend(DRIVE.run(across, scheme, Walls::Mirrored, None)?);
        if scheme.implicit {
            outcomes.push(two_layers(across, scheme)?);
        }
    }
    Ok(outcomes)
}

/// Steady flow of two layers of equal height and density, the upper one four times as viscous: where they meet, equal
/// stresses on both sides ask for four fifths of the wall's velocity.
fn two_layers(across: usize, scheme: Scheme) -> Result<Outcome, String> {
    let channel = Channel { across, width_m: 1.0, upper_wall_m_s: 1e-6 };
    let (lower, upper) = (1.0, 4.0);
    let effects = scheme.effects(Property::ByGroup(vec![lower, upper]), Walls::Mirrored);
    let mut parameters = channel.parameters(0.1, effects);
    parameters.groups = ["lower", "upper"].map(String::from).to_vec();
    let mut particles = channel.at_rest();
    particles.iter_mut().for_each(|particle| particle.group = u8::from(particle.position[1] > 0.5));
    let mut simulation = channel::build(&parameters, &particles)?;
    channel::advance(simulation.as_mut(), 100)?;
    let profile = channel.profile(simulation.particles());
    let exact = |y: f64| match y {
        ..0.5 => 1e-6 * 0.8 * y / 0.5,
        _ => 1e-6 * (1.0 - 0.2 * (1.0 - y) / 0.5),
    };
    let (y, value) = profile[across / 2];
    Ok(Outcome {
        effect: scheme.effect(),
        case: "plane Couette flow of two fluids",
        quantity: "velocity just above the interface, m/s; error: L2 of the profile",
        value,
        reference: exact(y),
        error: channel::relative_l2(&profile, exact),
        gate: 0.01,
        source: "equal stresses",
    })
}
