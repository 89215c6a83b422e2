//! Heat and passive scalars against closed solutions, and what their absence must mean.

use repro::scene::validation::{CASES, Fidelity, conduction};

fn fidelity() -> Fidelity {
    match std::env::var("REPRO_FULL_VALIDATION").as_deref() {
        Ok("1") => Fidelity::Full,
        _ => Fidelity::Coarse,
    }
}

/// Runs the case of that name, prints what it found and holds it to its gates.
fn hold(name: &str) {
    let case = CASES.iter().find(|case| case.name == name).expect("a case of that name");
    let outcomes = (case.run)(fidelity()).unwrap();
    for o in &outcomes {
        println!(
            "{}, {}, {}: {:.6} (reference {:.6}), error {:.2e}, gate {:.2e}",
            o.effect, o.case, o.quantity, o.value, o.reference, o.error, o.gate
        );
    }
    for o in outcomes {
        assert!(o.error <= o.gate, "{o:?}");
    }
}

#[test]
fn a_slab_cools() {
    hold("slab-cooling");
}

/// The corrected Laplacian converges where that of the lattice does not.
#[test]
fn a_slab_of_displaced_particles_cools() {
    hold("slab-cooling-jittered");
    let lattice = [20, 40].map(|across| conduction::jittered_slab_on_the_lattice(across).unwrap());
    println!("jittered slab, lattice Laplacian: {lattice:?}");
}

#[test]
fn bodies_in_contact_meet_at_the_mean_of_their_effusivities() {
    hold("bodies-in-contact");
}

#[test]
fn a_half_space_warms_up() {
    hold("half-space");
}

#[test]
fn a_wall_lets_a_flux_through() {
    hold("heat-flux-wall");
}

#[test]
fn dye_spreads() {
    hold("spreading-dye");
}

#[test]
fn dye_spreads_among_displaced_particles() {
    hold("spreading-dye-jittered");
}

#[test]
fn air_convects_gently() {
    hold("natural-convection-1e3");
}

#[test]
fn air_convects() {
    hold("natural-convection-1e4");
}
