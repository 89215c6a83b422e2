//! Diffusion by the Laplacian model of the lattice.
//!
//! Past a surface that holds the value `T_s` a wall particle counts with the value on the line through `T_s` at the surface
//! and `T_i`: `T_j - T_i = (T_s - T_i) (h_i + d_j) / h_i`, with `h_i` the height of `i` above the surface and `d_j` the
//! depth of `j` behind it (as Morris, Fox & Zhu 1997 do for velocities). Past one through which the flux `q` enters, on the
//! line with that slope: `T_j - T_i = q (h_i + d_j) / k_i`; on a lattice the shares of all particles sum up to `q`.

use super::walls::Surfaces;
use super::{Carried, Diffusion, Medium, WallCondition};
use crate::engine::parameters::Parameters;
use crate::engine::particles::Kind;
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::{Fields, State};
use crate::engine::terms::{Pair, PairTerm, Rates};

/// The term.
#[derive(Debug)]
pub struct LatticeDiffusion {
    carried: Carried,
    medium: Medium,
    walls: Walls,
}

/// Walls by group, and where their surfaces are.
#[derive(Debug)]
pub(super) struct Walls {
    pub conditions: Vec<WallCondition>,
    pub surfaces: Surfaces,
}

impl Walls {
    pub fn new(diffusion: &Diffusion, parameters: &Parameters) -> Self {
        let groups = parameters.groups.len().max(1);
        let conditions = (0..groups).map(|group| diffusion.wall(group as u8)).collect();
        Walls { conditions, surfaces: Surfaces::new(parameters) }
    }

    /// `T_j - T_i` past a surface, `k_i` being the conductivity of the fluid there.
    #[inline(never)]
    fn difference(&self, pair: &Pair, value_i: f64, k_i: f64, fields: &Fields<'_>) -> f64 {
        let condition = self.conditions[fields.group_of(pair.j) as usize];
        match (condition, self.surfaces.seen(pair.j, pair.r_ij)) {
            (WallCondition::Value(at_surface), Some(seen)) => {
                (at_surface - value_i) * ((seen.height_m + seen.depth_m) / seen.height_m)
            }
            // Past an edge of the wall its particle is no mirror, but still as warm as its surface.
            (WallCondition::Value(at_surface), None) => at_surface - value_i,
            (WallCondition::Flux(flux), Some(seen)) if k_i > 0.0 => {
                flux * (seen.height_m + seen.depth_m) / k_i
            }
            (WallCondition::Flux(_), _) => 0.0,
        }
    }
}

impl LatticeDiffusion {
    pub fn new(carried: Carried, diffusion: &Diffusion, parameters: &Parameters) -> Self {
        LatticeDiffusion {
            carried,
            medium: Medium::new(diffusion, parameters),
            walls: Walls::new(diffusion, parameters),
        }
    }

    pub(super) fn carried(&self) -> Carried {
        self.carried
    }

    pub(super) fn medium(&self) -> &Medium {
        &self.medium
    }

    pub(super) fn walls(&self) -> &Walls {
        &self.walls
    }
}

impl PairTerm for LatticeDiffusion {
    /// `sum k_ij (T_j - T_i) w`.
    type Sum = f64;

    fn prepare<C: CandidateSearch, T: DistanceTest>(&mut self, state: &State<C>) {
        self.walls.surfaces.find::<C, T>(state);
    }

    #[inline(always)]
    fn add(&self, sum: &mut f64, pair: &Pair, fields: &Fields<'_>) {
        let (values, row) = (self.carried.values(fields), self.medium.row(pair.i, fields));
        *sum += match fields.kind[pair.j] {
            Kind::Wall | Kind::DummyWall => {
                let k_i = self.medium.conductivity[row];
                pair.w * k_i * self.walls.difference(pair, values[pair.i], k_i, fields)
            }
            _ => {
                let pair_of_groups = row * self.medium.groups + self.medium.row(pair.j, fields);
                let k_ij = self.medium.mean_conductivity[pair_of_groups];
                pair.w * k_ij * (values[pair.j] - values[pair.i])
            }
        };
    }

    #[inline(always)]
    fn finish(&self, sum: f64, i: usize, fields: &Fields<'_>, rates: &mut Rates<'_>) {
        let capacity = self.medium.capacity[self.medium.row(i, fields)];
        self.carried.add_rate(rates, self.medium.factor / capacity * sum);
    }

    fn bytes(&self) -> usize {
        self.walls.surfaces.bytes()
    }
}
