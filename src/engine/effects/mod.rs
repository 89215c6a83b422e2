//! Physical effects, one a file. A scene runs exactly those that it names.

pub mod collision;
pub mod gravity;
pub mod implicit_viscosity;
pub mod motion;
pub mod no_slip;
pub mod rheology;
pub mod strain_rate;
pub mod turbulence;
pub mod viscosity;
pub mod wall_contact;
