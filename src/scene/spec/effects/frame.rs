//! `[effects.frame]`

use serde::Deserialize;

use super::EffectTable;
use super::columns::{Counted, SCALAR, VECTOR};
use crate::base::input::{Check, InputError};
use crate::base::vec3::Vec3;
use crate::engine::effects::frame::{Frame, Harmonic};
use crate::scene::Scene;
use crate::scene::number_table::TableFile;

/// The scene is seen from a tank that is shaken or turns.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct FrameSpec {
    /// The rotation vector of the frame.
    #[serde(default)]
    pub angular_velocity_rad_s: Vec3,
    /// How long the rotation takes to get going, in proportion to time; 0 where it is there from the start.
    #[serde(default)]
    pub spin_up_s: f64,
    /// A point on the axis.
    #[serde(default)]
    pub point_m: Vec3,
    /// Accelerations of the frame, added up.
    #[serde(default)]
    pub harmonic: Vec<HarmonicSpec>,
    /// A CSV file of the frame's acceleration, with the columns time_s, x_m_s2, y_m_s2, z_m_s2: straight between its
    /// times, and constant before and after them.
    pub acceleration_table: Option<TableFile>,
}

/// An acceleration of the frame, `amplitude sin(2 pi frequency t + phase)` along a direction.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct HarmonicSpec {
    pub amplitude_m_s2: f64,
    /// Of any length but zero.
    pub direction: Vec3,
    pub frequency_hz: f64,
    #[serde(default)]
    pub phase_rad: f64,
}

impl HarmonicSpec {
    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        check.finite(&format!("{key}.amplitude_m_s2"), self.amplitude_m_s2)?;
        check.finite(&format!("{key}.phase_rad"), self.phase_rad)?;
        check.not_negative(&format!("{key}.frequency_hz"), self.frequency_hz)?;
        check.direction(&format!("{key}.direction"), self.direction)
    }

    fn to_engine(&self) -> Harmonic {
        let length = self.direction.iter().map(|d| d * d).sum::<f64>().sqrt();
        Harmonic {
            amplitude_m_s2: self.direction.map(|d| self.amplitude_m_s2 * (d / length)),
            frequency_hz: self.frequency_hz,
            phase_rad: self.phase_rad,
        }
    }
}

impl EffectTable for FrameSpec {
    type Effect = Frame;

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        check.finite_vector(&format!("{key}.angular_velocity_rad_s"), self.angular_velocity_rad_s)?;
        check.finite_vector(&format!("{key}.point_m"), self.point_m)?;
        check.not_negative(&format!("{key}.spin_up_s"), self.spin_up_s)?;
        for (k, harmonic) in self.harmonic.iter().enumerate() {
            harmonic.check(check, &format!("{key}.harmonic[{k}]"))?;
        }
        let columns = ["time_s", "x_m_s2", "y_m_s2", "z_m_s2"];
        let key = format!("{key}.acceleration_table");
        self.acceleration_table.as_ref().map_or(Ok(()), |table| table.read(check, &key, &columns))
    }

    fn column_bytes(&self, _of: &Counted<'_>) -> usize {
        let rows = self.acceleration_table.as_ref().map_or(0, |table| table.curve::<3>().time_s.len());
        self.harmonic.len() * size_of::<Harmonic>() + rows * (SCALAR + VECTOR)
    }

    fn effect(&self, _scene: &Scene) -> Frame {
        Frame {
            angular_velocity_rad_s: self.angular_velocity_rad_s,
            spin_up_s: self.spin_up_s,
            point_m: self.point_m,
            harmonics: self.harmonic.iter().map(HarmonicSpec::to_engine).collect(),
            table: self.acceleration_table.as_ref().map(TableFile::curve),
        }
    }
}
