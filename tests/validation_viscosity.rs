//! Viscous effects against known answers. `REPRO_FULL_VALIDATION=1` doubles the resolution.
//!
//! Every case prints its outcomes (`--nocapture`), and every error is below its gate.
//!
//! Largest errors of the cases at 40 particles (12 a radius), and at twice as many: Couette flow 0.46 % and 0.12 %, of two
//! fluids 0.11 % and 0.05 %; Poiseuille flow 0.31 % and 0.13 %, with 200 times the explicit step 0.18 % and 0.12 %; decay of
//! a sine 0.64 % and 0.16 %; power laws 0.55 % and 0.18 %, Bingham 1.2 % and 1.2 %, Herschel-Bulkley 1.1 % and 1.4 %, Casson
//! 1.0 % and 1.0 % (what is left is the regularised yield stress); disc 5e-5 and 4e-5; eddies 1.1 % and 0.3 %.

use repro::engine::viscous::{Form, Walls};
use repro::scene::validation::channel::SCHEMES;
use repro::scene::validation::startup::Drive;
use repro::scene::validation::{
    Fidelity, Outcome, couette, decay, poiseuille, rheology, rotation, turbulence,
};

fn fidelity() -> Fidelity {
    if std::env::var_os("REPRO_FULL_VALIDATION").is_some() { Fidelity::Full } else { Fidelity::Coarse }
}

fn pass(run: fn(Fidelity) -> Result<Vec<Outcome>, String>) {
    let outcomes = run(fidelity()).unwrap();
    for o in &outcomes {
        println!(
            "{} | {} | {} | {:.5e} of {:.5e} | {:.2e} | {:.0e}",
            o.effect, o.case, o.quantity, o.value, o.reference, o.error, o.gate
        );
    }
    for outcome in outcomes {
        assert!(outcome.error <= outcome.gate, "{outcome:?}");
    }
}

#[test]
fn couette_flow_starts_up() {
    pass(couette::run);
}

#[test]
fn poiseuille_flow_starts_up() {
    pass(poiseuille::run);
}

#[test]
fn a_sine_decays_with_the_viscosity_asked_for() {
    pass(decay::run);
}

#[test]
fn generalised_newtonian_fluids_have_their_profiles() {
    pass(rheology::run);
}

#[test]
fn a_disc_goes_on_turning() {
    pass(rotation::run);
}

#[test]
fn eddies_are_as_viscous_as_smagorinsky_says() {
    pass(turbulence::run);
}

/// The errors at the last two times but one, at 10, 20 and 40 across.
fn orders(drive: Drive, walls: Walls) -> Vec<(&'static str, f64)> {
    let mut orders = Vec::new();
    for scheme in SCHEMES {
        let errors = [10, 20, 40].map(|across| drive.run(across, scheme, walls, None).unwrap()[1].error);
        println!("{}, {}, {walls:?}: {errors:?}", drive.case, scheme.name);
        for pair in errors.windows(2) {
            orders.push((scheme.name, (pair[0] / pair[1]).log2()));
        }
    }
    orders
}

#[test]
fn mirrored_walls_are_of_second_order() {
    for drive in [couette::DRIVE, poiseuille::DRIVE] {
        for (scheme, order) in orders(drive, Walls::Mirrored) {
            assert!(order > 1.8, "{}, {scheme}: order {order}", drive.case);
        }
    }
}

/// Why there are mirrored walls: the textbook's begin somewhere below their first layer.
#[test]
fn resting_walls_are_of_first_order() {
    for (scheme, order) in orders(couette::DRIVE, Walls::Resting) {
        assert!(order > 0.8 && order < 1.2, "{scheme}: order {order}");
    }
}

/// The Laplacian form's forces are not central: at a free surface it slows rigid rotation.
#[test]
fn the_laplacian_form_slows_a_disc() {
    for scheme in SCHEMES.into_iter().filter(|scheme| scheme.form == Form::Laplacian) {
        let kept = rotation::kept(12, scheme).unwrap();
        println!("{}: {kept} of its angular velocity", scheme.name);
        assert!(kept < 0.6, "{}: {kept}", scheme.name);
    }
}
