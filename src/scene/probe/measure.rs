//! What probes compute from columns of particles. Pure functions; every formula stands at its function.
//!
//! Volumes and masses are those of one particle, `l0^3` and `rho l0^3`. In a planar scene, whose particles all lie in one
//! plane `z = const`, they are `l0^2` and `rho l0^2`, and extensive quantities are per metre of depth.

use std::f64::consts::PI;

use crate::base::vec3::{Vec3, ZERO, add, add_scaled, dot, scale, sub};
use crate::engine::kernel::weight;
use crate::engine::particles::Kind;
use crate::scene::probe::near::Near;

/// The smooth kernel `w(q) = c (1 - q)^4 (4 q + 1)` with `q = r / R`, zero from `R` on, whose integral over space is 1:
/// `c = 21 / (2 pi R^3)`, in the plane `c = 7 / (pi R^2)` (Wendland 1995). 1/m3, in the plane 1/m2.
///
/// MPS's own weight has no integral and no value at its centre, and so cannot tell how full a place is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SmoothKernel {
    radius_m: f64,
    scale: f64,
}

impl SmoothKernel {
    pub fn new(radius_m: f64, planar: bool) -> Self {
        let scale = if planar { 7.0 / (PI * radius_m.powi(2)) } else { 21.0 / (2.0 * PI * radius_m.powi(3)) };
        SmoothKernel { radius_m, scale }
    }

    pub fn at(self, distance_m: f64) -> f64 {
        let q = distance_m / self.radius_m;
        if q < 1.0 { self.scale * (1.0 - q).powi(4) * (4.0 * q + 1.0) } else { 0.0 }
    }
}

/// The pressure at a point, Pa: `sum_j p_j w_j / sum_j w_j` over fluid and wall particles with the smooth kernel's
/// weights. `None` where none is within the radius.
pub fn point_pressure(
    point: Vec3,
    kernel: SmoothKernel,
    kind: &[Kind],
    position: &[Vec3],
    pressure: &[f64],
) -> Option<f64> {
    let (mut sum, mut weights) = (0.0, 0.0);
    for (j, &p) in pressure.iter().enumerate() {
        if matches!(kind[j], Kind::Fluid | Kind::Wall) {
            let apart = sub(position[j], point);
            let w = kernel.at(dot(apart, apart).sqrt());
            (sum, weights) = (sum + p * w, weights + w);
        }
    }
    (weights > 0.0).then(|| sum / weights)
}

/// The height of the free surface on the vertical line through `x` and `z`, metres.
///
/// How full a place is follows from the sums `F` over fluid and `S` over wall and dummy wall particles of their volume
/// times the smooth kernel: the fluid's share of what solids leave, `F / (1 - S)`. Inside the fluid it is 1, on a level
/// surface, half a particle distance above the uppermost particles, 1/2. The height is that of the uppermost crossing of
/// 1/2 from above, found between points a quarter of `l0` apart by linear interpolation. A place that is mostly solid counts
/// as empty. A lone drop never reaches 1/2, and so does not count; a splash or a breaking wave does. Our own definition.
pub fn surface_height(
    [x, z]: [f64; 2],
    kernel: SmoothKernel,
    volume: f64,
    spacing_m: f64,
    kind: &[Kind],
    position: &[Vec3],
) -> Option<f64> {
    let beside = |&i: &usize| {
        let [dx, dz] = [position[i][0] - x, position[i][2] - z];
        dx * dx + dz * dz < kernel.radius_m * kernel.radius_m && kind[i] != Kind::Ghost
    };
    let column: Vec<usize> = (0..position.len()).filter(beside).collect();
    let heights = || column.iter().filter(|&&i| kind[i] == Kind::Fluid).map(|&i| position[i][1]);
    let top = heights().reduce(f64::max)? + kernel.radius_m;
    let bottom = heights().reduce(f64::min)? - kernel.radius_m;
    let fullness = |y: f64| {
        let (mut fluid, mut solid) = (0.0, 0.0);
        for &i in &column {
            let apart = sub(position[i], [x, y, z]);
            let share = volume * kernel.at(dot(apart, apart).sqrt());
            if kind[i] == Kind::Fluid { fluid += share } else { solid += share }
        }
        if solid < 0.5 { fluid / (1.0 - solid) } else { 0.0 }
    };
    let step = spacing_m / 4.0;
    let (mut above, mut y) = (fullness(top), top);
    while y > bottom {
        let here = fullness(y - step);
        if here >= 0.5 {
            return Some(y - step * (0.5 - above) / (here - above));
        }
        (above, y) = (here, y - step);
    }
    None
}

/// A rectangle that stands across an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    /// The axis that it stands across: 0, 1 or 2.
    pub axis: usize,
    pub low: Vec3,
    pub high: Vec3,
}

/// How many more fluid particles went through the rectangle upwards along its axis than downwards, each along the straight
/// line from where it was before to where it is after. A particle that was none before, or is none after, does not count.
pub fn crossings(
    rectangle: Rectangle,
    before: (&[Kind], &[Vec3]),
    (kind, position): (&[Kind], &[Vec3]),
) -> i64 {
    let Rectangle { axis, low, high } = rectangle;
    let mut net = 0;
    for ((&old_kind, &from), (&kind, &to)) in before.0.iter().zip(before.1).zip(kind.iter().zip(position)) {
        let (was_above, is_above) = (from[axis] >= low[axis], to[axis] >= low[axis]);
        if old_kind != Kind::Fluid || kind != Kind::Fluid || was_above == is_above {
            continue;
        }
        let share = (low[axis] - from[axis]) / (to[axis] - from[axis]);
        let through = add_scaled(from, share, sub(to, from));
        if (0..3).all(|d| d == axis || (low[d]..=high[d]).contains(&through[d])) {
            net += if is_above { 1 } else { -1 };
        }
    }
    net
}

/// What the force on a group needs to know beside the particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceModel {
    /// `re_g`, metres.
    pub radius_m: f64,
    /// `n0_g` of the reference lattice.
    pub reference: f64,
    /// The number of space dimensions `D`.
    pub dimensions: f64,
    /// `V` of one particle, m3; in a planar scene m2.
    pub volume: f64,
}

/// The force of the fluid's pressure on the wall particles of which `belongs` holds, N; in a planar scene N per metre of
/// depth.
///
/// `F = -V sum_i <grad p>_i` over the group's wall particles, with the antisymmetric gradient model
/// `<grad p>_i = (D / n0_g) sum_j (p_i + p_j) r_ij w(r_ij, re_g) / r_ij^2`, whose sums over pairs within the group cancel
/// (Khayyer & Gotoh 2008); so `j` runs over fluid particles only. On a flat wall of lattice particles that is as thick as
/// the radius it is the pressure times the area, exactly.
///
/// Limits: dummy walls have no pressure and take no part, so a wall thinner than `re_g` feels too little. The step itself
/// moves the fluid by `p_j - pmin_i`, which is not antisymmetric: this force is not the change of the fluid's momentum.
/// Viscous forces are not in it.
pub fn pressure_force(
    model: &ForceModel,
    kind: &[Kind],
    position: &[Vec3],
    pressure: &[f64],
    belongs: impl Fn(usize) -> bool,
) -> Vec3 {
    let fluid = Near::new(position, model.radius_m, |j| kind[j] == Kind::Fluid);
    let mut sum = ZERO;
    for i in (0..pressure.len()).filter(|&i| kind[i] == Kind::Wall && belongs(i)) {
        fluid.around(position[i], |j, apart, r| {
            if r > 0.0 {
                let push = (pressure[i] + pressure[j]) * weight(r, model.radius_m) / (r * r);
                sum = add_scaled(sum, push, apart);
            }
        });
    }
    scale(-model.volume * model.dimensions / model.reference, sum)
}

/// The mean position of the fluid particles, all of which weigh the same; metres. `None` where there is no fluid.
pub fn centre_of_mass(kind: &[Kind], position: &[Vec3]) -> Option<Vec3> {
    let fluid = || kind.iter().zip(position).filter(|(kind, _)| **kind == Kind::Fluid);
    let count = fluid().count();
    let sum = fluid().fold(ZERO, |sum, (_, &x)| add(sum, x));
    (count > 0).then(|| scale(1.0 / count as f64, sum))
}

/// How far the fluid reaches along an axis, metres: its outermost particle, and the place that 99 % of the particles are
/// short of. `None` where there is no fluid.
pub fn front(axis: usize, kind: &[Kind], position: &[Vec3]) -> Option<[f64; 2]> {
    let fluid = kind.iter().zip(position).filter(|(kind, _)| **kind == Kind::Fluid);
    let mut places: Vec<f64> = fluid.map(|(_, x)| x[axis]).collect();
    places.sort_by(f64::total_cmp);
    let last = places.len().checked_sub(1)?;
    let place = 0.99 * last as f64;
    let below = place.floor() as usize;
    let bulk = places[below] + place.fract() * (places[(below + 1).min(last)] - places[below]);
    Some([places[last], bulk])
}
