//! Physical effects, one a file. A scene runs exactly those that it names.

pub mod collision;
pub mod flow_boundaries;
pub mod frame;
pub mod gravity;
pub mod motion;
pub mod rigid_bodies;
pub mod shifting;
pub mod viscosity;
pub mod wall_contact;
pub mod wall_motion;
