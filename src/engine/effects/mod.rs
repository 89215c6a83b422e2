//! Physical effects, one a file. A scene runs exactly those that it names.

pub mod buoyancy;
pub mod collision;
pub mod diffusion;
pub mod flow_boundaries;
pub mod frame;
pub mod gravity;
pub mod implicit_viscosity;
pub mod motion;
pub mod no_slip;
pub mod potential_tension;
pub mod rheology;
pub mod rigid_bodies;
pub mod shifting;
pub mod strain_rate;
pub mod surface_tension;
pub mod turbulence;
pub mod viscosity;
pub mod wall_contact;
pub mod wall_motion;
