//! Surface tension: free drops in a plane, forces of pairs, and what scenes may say.

use repro::base::vec3::{ZERO, dot};
use repro::engine::particles::Particles;
use repro::scene::validation::drop::{Drop, Model};
use repro::scene::validation::sessile::{angles, segment_angle_deg};
use repro::scene::validation::sphere;
use repro::scene::validation::tension::{oscillation, pressure_jump, square};
use repro::scene::validation::{Fidelity, Outcome};

fn fidelity() -> Fidelity {
    match std::env::var("REPRO_FULL_VALIDATION") {
        Ok(value) if value == "1" => Fidelity::Full,
        _ => Fidelity::Coarse,
    }
}

/// Prints what both models did and demands that the surface's error is below its gate.
fn held(case: impl Fn(Model) -> Result<Vec<Outcome>, String>) {
    for model in Model::ALL {
        for Outcome { effect, case, quantity, value, reference, error, gate, .. } in case(model).unwrap() {
            println!(
                "{effect}, {case}, {quantity}: {value:.4} for {reference:.4}, error {error:.4}, gate {gate}"
            );
            assert!(model == Model::Potential || error <= gate, "{effect}: {quantity}, error {error}");
        }
    }
}

#[test]
fn a_round_drop_has_laplaces_pressure_and_stays_at_rest() {
    held(|model| pressure_jump(model, fidelity()));
}

#[test]
fn a_drop_swings_with_rayleighs_period() {
    held(|model| oscillation(model, 0.0, fidelity()));
    held(|model| oscillation(model, 0.02, fidelity()));
}

#[test]
fn a_square_becomes_round() {
    held(|model| square(model, fidelity()));
}

#[test]
fn a_drop_in_space_has_laplaces_pressure() {
    held(|model| if model == Model::Lack { sphere::laplace(fidelity()) } else { Ok(Vec::new()) });
}

#[test]
fn drops_meet_walls_at_the_set_angle() {
    for Outcome { effect, case, value, reference, error, gate, .. } in angles(fidelity()).unwrap() {
        println!("{effect}, {case}: {value:.1} for {reference}, error {error:.1}, gate {gate}");
        assert!(error <= gate, "{effect}, {case}: {value}");
    }
}

/// Half a disc has a right angle, and its middle at `4 / (3 pi)`.
#[test]
fn angles_are_read_off_segments() {
    let pi = std::f64::consts::PI;
    let angle = segment_angle_deg(0.5 * pi, 4.0 / (3.0 * pi));
    assert!((angle - 90.0).abs() < 1e-6, "{angle}");
}

/// Momentum, angular momentum, and what the latter is a sum of without signs.
fn momentum(particles: &Particles) -> ([f64; 2], f64, f64) {
    let (mut linear, mut angular, mut scale) = ([0.0; 2], 0.0, 0.0);
    for (x, u) in particles.position.iter().zip(&particles.velocity) {
        linear = [linear[0] + u[0], linear[1] + u[1]];
        angular += x[0] * u[1] - x[1] * u[0];
        scale += (dot(*x, *x) * dot(*u, *u)).sqrt();
    }
    (linear, angular, scale)
}

/// Forces of pairs are opposite: a lopsided drop gets no momentum. Their torques cancel where they are taken, but the step
/// moves particles on by `a dt^2` afterwards, which costs angular momentum of the order of the step. The drop is no mirror
/// image of itself, so that it could turn.
#[test]
fn a_lopsided_drop_pulls_itself_nowhere() {
    for model in Model::ALL {
        let drop = Drop::new(model, 6, 0.0);
        let particles = drop
            .lattice(|x, y| x * x + y * y < 1.0 || (x > 0.0 && x < 1.4 && y > 0.0 && y < 0.5), |_, _| ZERO);
        drop.run(&particles, 0.05, |_, particles| {
            let (linear, angular, scale) = momentum(particles);
            assert!(linear.iter().all(|m| m.abs() < 1e-8), "{model:?}: {linear:?}");
            assert!(angular.abs() < 0.01 * scale, "{model:?}: {angular} of {scale}");
        })
        .unwrap();
    }
}
