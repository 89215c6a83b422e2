//! A front measured in an experiment, from `paper/martin_moyce_1952.toml`.

use serde::Deserialize;

use crate::experiment::record::FrontSample;

/// The front of Martin and Moyce's column.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasuredFront {
    pub front: Vec<AtTime>,
    /// The share of Z by which experiments of this kind differ.
    pub scatter: f64,
    base_m: f64,
    gravity_m_s2: f64,
    n2: f64,
}

/// Dimensionless time and front, in the paper's symbols.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(non_snake_case, reason = "their symbols")]
pub struct AtTime {
    pub T: f64,
    pub Z: f64,
}

impl MeasuredFront {
    pub fn load() -> Self {
        toml::from_str(include_str!("../../paper/martin_moyce_1952.toml"))
            .expect("the embedded front is valid")
    }

    /// The root mean square of the relative difference of `ours`, its time shifted by `shift`, from the measured points that
    /// it covers, and their number.
    pub fn difference(&self, ours: &[(f64, f64)], shift: f64) -> Option<(f64, usize)> {
        let covered = self.front.iter().filter_map(|at| Some(interpolated(ours, at.T - shift)? / at.Z - 1.0));
        let squares: Vec<f64> = covered.map(|difference| difference * difference).collect();
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        (!squares.is_empty()).then(|| (mean.sqrt(), squares.len()))
    }

    /// The shift of our time, in steps of a hundredth up to half a unit either way, with the least difference: gates take
    /// time to open. Shifts that lose more than two points to compare with are not tried.
    pub fn best_shift(&self, ours: &[(f64, f64)]) -> Option<(f64, (f64, usize))> {
        let (_, all) = self.difference(ours, 0.0)?;
        let shifts = (-50..=50).map(|k| f64::from(k) / 100.0);
        let tried = shifts.filter_map(|shift| Some((shift, self.difference(ours, shift)?)));
        let enough = tried.filter(|(_, (_, count))| count + 2 >= all);
        enough.min_by(|a, b| a.1.0.total_cmp(&b.1.0))
    }

    /// Our front in their units: `T = n t sqrt(g / a)`, `Z = z / a`.
    pub fn scaled(&self, front: &[FrontSample]) -> Vec<(f64, f64)> {
        let rate = (self.n2 * self.gravity_m_s2 / self.base_m).sqrt();
        front.iter().map(|sample| (rate * sample.time_s, sample.front_p99_m / self.base_m)).collect()
    }
}

/// The value at `x` between the two points around it; `None` outside of them.
fn interpolated(points: &[(f64, f64)], x: f64) -> Option<f64> {
    points.windows(2).find_map(|pair| {
        let ((a, low), (b, high)) = (pair[0], pair[1]);
        (a..=b).contains(&x).then(|| low + (x - a) / (b - a) * (high - low))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_delayed_front_is_found_by_its_shift() {
        let measured = MeasuredFront::load();
        let late: Vec<(f64, f64)> = measured.front.iter().map(|at| (at.T - 0.2, at.Z)).collect();
        let (shift, (rms, _)) = measured.best_shift(&late).unwrap();
        assert!((shift - 0.2).abs() < 1e-9 && rms < 1e-9, "{shift} {rms}");
        assert!(measured.difference(&late, 0.0).unwrap().0 > 0.05);
        assert_eq!(measured.difference(&[(9.0, 1.0), (10.0, 2.0)], 0.0), None);
    }

    /// T = n t sqrt(g / a) with n^2 = 2, a = 0.25 m: one second is T = sqrt(78.4).
    #[test]
    fn our_front_is_put_into_their_units() {
        let front = [FrontSample { time_s: 1.0, front_p99_m: 0.5 }];
        let scaled = MeasuredFront::load().scaled(&front);
        assert!((scaled[0].0 - 78.4f64.sqrt()).abs() < 1e-12 && (scaled[0].1 - 2.0).abs() < 1e-12);
    }
}
