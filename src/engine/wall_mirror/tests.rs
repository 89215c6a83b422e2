use std::sync::Arc;

use super::*;
use crate::base::parallel::Workers;
use crate::base::schedule::Schedule;
use crate::engine::kernel::Dimensions;
use crate::engine::parameters::{Domain, Effects, Radii};
use crate::engine::particles::InitialParticle;
use crate::engine::phase::NoProbe;
use crate::engine::search::RootFirst;
use crate::engine::search::grid::Grid;
use crate::engine::search::linked_list::LinkedList;
use crate::engine::search::periodic::Periodic;

const L0: f64 = 0.1;

fn parameters() -> Parameters {
    let domain =
        Domain { periodic: [true, false, false], ..Domain::new([-0.05, -1.0, 0.0], [1.15, 2.0, 0.0]) };
    Parameters {
        dimensions: Dimensions::Two,
        particle_distance_m: L0,
        time_step_s: 1e-3,
        adaptive: None,
        density_kg_m3: 1000.0,
        radii: Radii { number_density: 2.1, gradient: 2.1, laplacian: 3.1 },
        domain,
        groups: Vec::new(),
        effects: Effects::default(),
    }
}

/// Twelve layers of fluid over two of wall and two of dummy wall, the fluid moved off the lattice by up to `jitter`.
fn floor(jitter: f64) -> State<Periodic<LinkedList>> {
    let mut particles = Vec::new();
    for i in 0..12 {
        for j in -3..=12 {
            let kind = match j {
                ..=-2 => Kind::DummyWall,
                -1..=0 => Kind::Wall,
                _ => Kind::Fluid,
            };
            let off = |k: i32| {
                let noise = f64::from((k * 7919 + 104729) % 1000) / 500.0 - 1.0;
                if kind == Kind::Fluid { jitter * L0 * noise } else { 0.0 }
            };
            let position =
                [L0 * f64::from(i) + off(31 * i + 17 * j), L0 * f64::from(j) + off(13 * i + 29 * j + 5), 0.0];
            particles.push(InitialParticle::at_rest(kind, position));
        }
    }
    let parameters = parameters();
    let workers = Arc::new(Workers::new(1, Schedule::Static, &[]).unwrap());
    let grid = Grid::new(parameters.domain, parameters.largest_radius_m(), 1).unwrap();
    let mut state =
        State::new(Particles::new(&particles, &workers), grid, parameters.lengths(), workers, 1e-3);
    state.refresh(&mut NoProbe).unwrap();
    state
}

fn mirrored(state: &State<Periodic<LinkedList>>, field: &[f64]) -> Vec<(f64, f64)> {
    let mut mirror = WallMirror::new(&parameters());
    mirror.refresh::<_, RootFirst>(state);
    assert_eq!(mirror.walls().len(), 48);
    let mut values = Vec::new();
    mirror.extrapolate::<_, RootFirst, f64>(state, field, &mut values);
    let height = |behind: &Behind| state.particles.position[behind.particle as usize][1] - 0.5 * L0;
    mirror.walls().iter().map(height).zip(values).collect()
}

#[test]
fn a_line_goes_on_behind_the_surface_however_the_fluid_lies() {
    let state = floor(0.3);
    let height = |i: usize| state.particles.position[i][1] - 0.5 * L0;
    let value = |i: usize| if state.particles.kind[i] == Kind::Fluid { 4.0 + 3.0 * height(i) } else { 4.0 };
    let field: Vec<f64> = (0..state.particles.len()).map(value).collect();
    for (height, value) in mirrored(&state, &field) {
        assert!((value - (4.0 + 3.0 * height)).abs() < 1e-12, "{height} {value}");
    }
}

#[test]
fn on_the_lattice_a_curve_is_reflected_at_the_surface() {
    let state = floor(0.0);
    let curve = |h: f64| 5.0 * h - 2.0 * h * h;
    let field: Vec<f64> = (0..state.particles.len())
        .map(|i| match state.particles.kind[i] {
            Kind::Fluid => 1.0 + curve(state.particles.position[i][1] - 0.5 * L0),
            _ => 1.0,
        })
        .collect();
    for (height, value) in mirrored(&state, &field) {
        // The deepest layer's mirror points lie too far away: it is given the slope of the layer above it.
        let (depth, mirror) = (-height, (-height).min(1.5 * L0));
        let expected = 1.0 - depth / mirror * curve(mirror);
        assert!((value - expected).abs() < 1e-12, "{height} {value} {expected}");
    }
}

#[test]
fn values_are_exchanged_and_come_back_and_walls_that_move_are_found_anew() {
    let mut state = floor(0.0);
    let mut mirror = WallMirror::new(&parameters());
    mirror.refresh::<_, RootFirst>(&state);
    let mut field: Vec<Vec3> = (0..state.particles.len()).map(|i| [i as f64, 0.0, 1.0]).collect();
    let (before, mut mirrored) = (field.clone(), Vec::new());
    mirror.extrapolate::<_, RootFirst, Vec3>(&state, &field, &mut mirrored);
    mirror.exchange(&mut field, &mut mirrored);
    assert_ne!(field, before);
    mirror.exchange(&mut field, &mut mirrored);
    assert_eq!(field, before);

    let first = *mirror.surface_of(0).unwrap();
    assert!((first.depth_m - 3.5 * L0).abs() < 1e-12 && (first.normal[1] - 1.0).abs() < 1e-12, "{first:?}");
    for position in state.particles.position.iter_mut().filter(|x| x[1] > -0.05 && x[1] < 0.05) {
        position[1] += 0.05 * L0;
    }
    state.positions_changed();
    state.refresh(&mut NoProbe).unwrap();
    mirror.refresh::<_, RootFirst>(&state);
    assert!((mirror.surface_of(0).unwrap().depth_m - 3.55 * L0).abs() < 1e-12);
}

#[test]
fn steepness_is_depth_over_height() {
    let state = floor(0.0);
    let mut mirror = WallMirror::new(&parameters());
    mirror.refresh::<_, RootFirst>(&state);
    // Particle 2 lies 1.5 l0 below the surface, particles 4 and 5 lie 0.5 and 1.5 above it.
    let (wall, [near, far]) = (mirror.surface_of(2).unwrap(), [4, 5]);
    let from = |i: usize| sub(state.particles.position[2], state.particles.position[i]);
    assert!((mirror.steepness(wall, from(near)) - 3.0).abs() < 1e-9);
    assert!((mirror.steepness(wall, from(far)) - 1.0).abs() < 1e-9);
}
