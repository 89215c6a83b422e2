//! Physical effects, one a file. A scene runs exactly those that it names.

pub mod buoyancy;
pub mod collision;
pub mod diffusion;
pub mod gravity;
pub mod motion;
pub mod viscosity;
pub mod wall_contact;
