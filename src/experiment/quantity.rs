//! What is observed of a run: numbers with a name, a unit and a meaning.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A number that a run ends with. One that has no meaning for a scene, such as a depth without gravity, is absent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    Fluid,
    Alive,
    Left,
    Missing,
    NotFinite,
    Leaks,
    EnergyRise,
    MaxSpeed,
    LateSpeed,
    MaxCourant,
    FrontP99,
    ProfileError,
    PressureNoise,
    PeakPressure,
    CentreDrift,
    KineticEnergy,
    MeanTemperature,
    MeanConcentration,
    FallError,
    ShapeChange,
    CgIterations,
    ColumnBytes,
    BytesPerParticle,
}

impl Quantity {
    /// The name in files; the unit is its end where there is one.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::Fluid => "fluid",
            Quantity::Alive => "alive",
            Quantity::Left => "left",
            Quantity::Missing => "missing",
            Quantity::NotFinite => "not_finite",
            Quantity::Leaks => "leaks",
            Quantity::EnergyRise => "energy_rise",
            Quantity::MaxSpeed => "max_speed",
            Quantity::LateSpeed => "late_speed",
            Quantity::MaxCourant => "max_courant",
            Quantity::FrontP99 => "front_p99",
            Quantity::ProfileError => "profile_error",
            Quantity::PressureNoise => "pressure_noise",
            Quantity::PeakPressure => "peak_pressure",
            Quantity::CentreDrift => "centre_drift",
            Quantity::KineticEnergy => "kinetic_energy",
            Quantity::MeanTemperature => "mean_temperature",
            Quantity::MeanConcentration => "mean_concentration",
            Quantity::FallError => "fall_error",
            Quantity::ShapeChange => "shape_change",
            Quantity::CgIterations => "cg_iterations",
            Quantity::ColumnBytes => "column_bytes",
            Quantity::BytesPerParticle => "bytes_per_particle",
        }
    }

    pub fn unit(self) -> &'static str {
        match self {
            Quantity::Fluid | Quantity::Alive | Quantity::Left | Quantity::Missing => "particles",
            Quantity::NotFinite | Quantity::Leaks => "particles",
            Quantity::EnergyRise => "of the start's energy",
            Quantity::MaxSpeed => "m/s",
            Quantity::LateSpeed => "sqrt(g H)",
            Quantity::MaxCourant | Quantity::ProfileError => "1",
            Quantity::FrontP99 => "m",
            Quantity::PressureNoise | Quantity::PeakPressure => "rho g H",
            Quantity::CentreDrift => "H",
            Quantity::KineticEnergy => "J/kg",
            Quantity::MeanTemperature => "K",
            Quantity::MeanConcentration => "1",
            Quantity::FallError => "of the way fallen",
            Quantity::ShapeChange => "particle distances",
            Quantity::CgIterations => "1/step",
            Quantity::ColumnBytes | Quantity::BytesPerParticle => "B/particle",
        }
    }

    /// What it is, in a sentence's middle. `H` is the fluid's depth at the start.
    pub fn in_words(self) -> &'static str {
        match self {
            Quantity::Fluid => "fluid particles at the start",
            Quantity::Alive => "fluid particles at the end",
            Quantity::Left => "particles that left the domain",
            Quantity::Missing => "particles neither alive nor left",
            Quantity::NotFinite => "particles with a value that is not finite",
            Quantity::Leaks => "particles ever seen inside a wall",
            Quantity::EnergyRise => "highest rise of the energy over the start's",
            Quantity::MaxSpeed => "highest speed",
            Quantity::LateSpeed => "highest speed in the last half, in sqrt(g H)",
            Quantity::MaxCourant => "highest Courant number",
            Quantity::FrontP99 => "99th percentile of x at the end",
            Quantity::ProfileError => "error of the mean pressure profile against rho g h",
            Quantity::PressureNoise => "standard deviation of the pressure at the floor's middle, in rho g H",
            Quantity::PeakPressure => "highest pressure, in rho g H",
            Quantity::CentreDrift => "drift of the centre of mass, in H",
            Quantity::KineticEnergy => "mean kinetic energy of the fluid at the end",
            Quantity::MeanTemperature => "mean temperature of the fluid at the end",
            Quantity::MeanConcentration => "mean concentration in the fluid at the end",
            Quantity::FallError => "distance of the centre of mass from its free fall",
            Quantity::ShapeChange => "largest displacement against the centre of mass, in particle distances",
            Quantity::CgIterations => "CG iterations a step",
            Quantity::ColumnBytes => "bytes of columns a particle, before the first step",
            Quantity::BytesPerParticle => "bytes a particle at the end, the matrix included",
        }
    }
}
