//! Physical effects, one a file. A scene runs exactly those that it names.

pub mod collision;
pub mod gravity;
pub mod motion;
pub mod potential_tension;
pub mod surface_tension;
pub mod viscosity;
pub mod wall_contact;
