//! What decides where particles lie besides `[geometry]` itself.

use crate::base::vec3::{Vec3, dot};

/// The rest of the scene, as far as particles are placed by it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement<'a> {
    /// The scene file: errors name it, and the paths of STL files start from its folder.
    pub file: &'a str,
    pub particle_distance_m: f64,
    /// 2 or 3; in two dimensions there is one plane of particles, z = 0.
    pub dimensions: usize,
    /// Along these axes the scene repeats itself.
    pub periodic: [bool; 3],
    /// Without them no region can start with a hydrostatic pressure.
    pub hydrostatics: Option<Hydrostatics>,
    /// Whether something besides fluid moves, so that a scene without fluid has something to show.
    pub moves_without_fluid: bool,
}

impl<'a> Placement<'a> {
    /// Three dimensions, no periodic axis, no gravity.
    pub fn new(file: &'a str, particle_distance_m: f64) -> Self {
        Placement {
            file,
            particle_distance_m,
            dimensions: 3,
            periodic: [false; 3],
            hydrostatics: None,
            moves_without_fluid: false,
        }
    }
}

/// A fluid at rest under gravity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hydrostatics {
    pub density_kg_m3: f64,
    pub gravity_m_s2: Vec3,
}

impl Hydrostatics {
    /// `p = rho |g| (surface - height)` below the surface and 0 above, Pa. Heights are against gravity, from the origin.
    pub fn pressure(&self, position: Vec3, surface_m: f64) -> f64 {
        let gravity = self.magnitude();
        let height = -dot(self.gravity_m_s2, position) / gravity;
        self.density_kg_m3 * gravity * (surface_m - height).max(0.0)
    }

    /// m/s2.
    pub fn magnitude(&self) -> f64 {
        dot(self.gravity_m_s2, self.gravity_m_s2).sqrt()
    }
}
