//! What one reads off the particles: fronts, extremes, and the digest of a state.

use sha2::{Digest, Sha256};

use crate::base::vec3::{Vec3, dot};
use crate::engine::particles::{Kind, Particles};

/// 128 bits, as 32 hexadecimal digits, over kind, position, velocity and pressure of every particle by its index. Two
/// states have the same digest exactly if they are the same to the last bit.
pub fn digest(particles: &Particles) -> String {
    let mut hasher = Sha256::new();
    let mut bytes = Vec::with_capacity(24 * particles.len());
    bytes.extend(particles.kind.iter().map(|&kind| kind as u8));
    hasher.update(&bytes);
    let mut column = |values: &mut dyn Iterator<Item = f64>| {
        bytes.clear();
        bytes.extend(values.flat_map(|value| value.to_bits().to_le_bytes()));
        hasher.update(&bytes);
    };
    column(&mut particles.position.iter().flatten().copied());
    column(&mut particles.velocity.iter().flatten().copied());
    column(&mut particles.pressure.iter().copied());
    hasher.finalize().iter().take(16).map(|byte| format!("{byte:02x}")).collect()
}

/// Where the fluid is and how fast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowState {
    pub fluid: usize,
    /// Largest x of the fluid, metres: one drop of spray decides it.
    pub front_max_m: f64,
    /// 99th percentile of the fluid's x, metres: the bulk's front.
    pub front_p99_m: f64,
    /// Largest y of the fluid, metres.
    pub top_m: f64,
    pub max_speed_m_s: f64,
    pub max_pressure_fluid_pa: f64,
    pub max_pressure_pa: f64,
}

impl FlowState {
    /// Zeros where there is no fluid.
    pub fn of(particles: &Particles) -> Self {
        let fluid: Vec<usize> = (0..particles.len()).filter(|&i| particles.kind[i] == Kind::Fluid).collect();
        let position = |axis: usize| fluid.iter().map(move |&i| particles.position[i][axis]);
        let pressure = |i: usize| particles.pressure.get(i).copied().unwrap_or(0.0);
        let mut x: Vec<f64> = position(0).collect();
        x.sort_by(f64::total_cmp);
        let largest = |values: &mut dyn Iterator<Item = f64>| values.reduce(f64::max).unwrap_or(0.0);
        FlowState {
            fluid: fluid.len(),
            front_max_m: x.last().copied().unwrap_or(0.0),
            front_p99_m: percentile(&x, 0.99),
            top_m: largest(&mut position(1)),
            max_speed_m_s: largest(&mut fluid.iter().map(|&i| norm(particles.velocity[i]))),
            max_pressure_fluid_pa: largest(&mut fluid.iter().map(|&i| pressure(i))),
            max_pressure_pa: largest(&mut (0..particles.len()).map(pressure)),
        }
    }
}

fn norm(v: Vec3) -> f64 {
    dot(v, v).sqrt()
}

/// The value below which a share of an ascending slice lies, interpolated linearly; 0 for an empty one.
fn percentile(ascending: &[f64], share: f64) -> f64 {
    let Some(last) = ascending.len().checked_sub(1) else {
        return 0.0;
    };
    let place = share * last as f64;
    let (below, rest) = (place.floor() as usize, place.fract());
    ascending[below] + rest * (ascending[(below + 1).min(last)] - ascending[below])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_interpolate() {
        assert_eq!(percentile(&[], 0.99), 0.0);
        assert_eq!(percentile(&[3.0], 0.99), 3.0);
        assert_eq!(percentile(&[0.0, 1.0, 2.0], 0.75), 1.5);
    }

    #[test]
    fn a_digest_sees_every_bit() {
        let mut particles = Particles {
            kind: vec![Kind::Fluid; 2],
            position: vec![[0.0, 1.0, 2.0]; 2],
            velocity: vec![[0.0; 3]; 2],
            acceleration: vec![[0.0; 3]; 2],
            ..Particles::default()
        };
        let before = digest(&particles);
        assert_eq!((before.len(), digest(&particles)), (32, before.clone()));
        particles.velocity[1][2] = -0.0;
        assert_ne!(digest(&particles), before);
    }
}
