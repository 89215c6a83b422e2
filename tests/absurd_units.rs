//! A unit taken for another one is refused when the scene is read, by file, key, value, what is allowed and the way out; and
//! no scene that somebody could mean is.

#[path = "common/toy.rs"]
mod toy;

use repro::scene::library;
use toy::TOYS;

#[track_caller]
fn refused(scene: &str, sets: &[&str], words: &[&str]) {
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    let error = library::load(scene, &sets).expect_err("must be refused").to_string();
    for word in words.iter().chain(&[&*format!("scenes/{scene}.toml"), "allowed are"]) {
        assert!(error.contains(word), "`{word}` is not in: {error}");
    }
}

#[track_caller]
fn accepted(scene: &str, sets: &[&str]) {
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    library::load(scene, &sets).unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn scenes_of_the_program_are_sane() {
    library::names().for_each(|name| accepted(name, &[]));
    for &toy in TOYS {
        toy::load(toy, &[]);
    }
}

#[test]
fn densities() {
    refused("dam-break", &["fluid.density_kg_m3=1e9"], &["fluid.density_kg_m3", "1000000000", "kg/m3"]);
    refused("dam-break", &["fluid.density_kg_m3=1e-6"], &["fluid.density_kg_m3", "water has 1000"]);
    accepted("dam-break", &["fluid.density_kg_m3=1"]);
    accepted("dam-break", &["fluid.density_kg_m3=13534"]);
}

#[test]
fn accelerations_in_millimetres() {
    let gravity = "effects.gravity.acceleration_m_s2=[0.0, -9810.0, 0.0]";
    refused("dam-break", &[gravity], &["effects.gravity.acceleration_m_s2", "is 9810", "5000 m/s2", "9.8"]);
    accepted("dam-break", &["effects.gravity.acceleration_m_s2=[0.0, -980.0, 0.0]", "time_step_s=1e-3"]);
}

#[test]
fn viscosities_in_centipoise() {
    let key = "effects.viscosity.kinematic_viscosity_m2_s";
    refused("dam-break", &[&format!("{key}=1.0")], &[key, "is 1;", "1 cP", "effects.implicit_viscosity"]);
    accepted("dam-break", &[&format!("{key}=7e-3")]);
    let implicit = "effects.implicit_viscosity.kinematic_viscosity_m2_s";
    accepted("mud-flow", &[&format!("{implicit}=1e4")]);
    refused("mud-flow", &[&format!("{implicit}=1e6")], &[implicit, "1000000", "m2/s"]);
    let of_fluid = "fluid.kinematic_viscosity_m2_s";
    refused("sloshing-tank", &[&format!("{of_fluid}=0.89")], &[of_fluid, "0.89", "1 cP"]);
}

#[test]
fn other_properties() {
    let tension = "effects.surface_tension.surface_tension_n_m";
    refused("drop-impact", &[&format!("{tension}=72.8")], &[tension, "72.8", "N/m", "0.072"]);
    let soft = "effects.pressure.compressibility_1_pa";
    refused("dam-break", &[&format!("{soft}=2.2e9")], &[soft, "2200000000", "inverse of the bulk modulus"]);
    let heat = "effects.heat.thermal_diffusivity_m2_s";
    refused("heated-cavity", &[&format!("{heat}=21.2")], &[heat, "21.2", "m2/s"]);
    let expansion = "effects.buoyancy.expansion_1_k";
    refused("heated-cavity", &[&format!("{expansion}=294")], &[expansion, "294", "1/K"]);
    refused("dam-break", &["particle_distance_m=1e7"], &["particle_distance_m", "in metres"]);
}

#[test]
fn steps_a_hundred_times_too_long() {
    let words = ["time_step_s", "is 3;", "its own distance", "lower it", "particle_distance_m"];
    refused("dam-break", &["time_step_s=3", "end_time_s=30"], &words);
    // The longest of adaptive steps may be any; the shortest decides.
    let adaptive = "adaptive_time_step.courant=0.2";
    let shortest = |seconds: &str| format!("adaptive_time_step.shortest_s={seconds}");
    accepted("dam-break", &["time_step_s=3", "end_time_s=30", adaptive, &shortest("1e-6")]);
    let sets = ["time_step_s=3", "end_time_s=30", adaptive, &shortest("2.5")];
    refused("dam-break", &sets, &["adaptive_time_step.shortest_s", "is 2.5"]);
    let sets = ["effects.viscosity.kinematic_viscosity_m2_s=0.4", "particle_distance_m=0.002"];
    refused("dam-break", &sets, &["time_step_s", "0.003", "viscosity spreads", "`effects.viscosity`"]);
    refused("oscillating-drop", &["time_step_s=5e-3"], &["time_step_s", "a wave of tension"]);
    refused(
        "heated-cavity",
        &["effects.heat.thermal_diffusivity_m2_s=0.09"],
        &["time_step_s", "heat spreads"],
    );
    accepted("dam-break", &["time_step_s=0.02"]);
}

#[test]
fn drops_of_metres() {
    let key = "effects.surface_tension.surface_tension_n_m";
    let pool = [
        "particle_distance_m=0.2",
        "time_step_s=0.02",
        "geometry.lattice.extent_m=[16.0, 12.0, 0.0]",
        "geometry.region=[{ fill = \"fluid\", from_m = [0, 0, -1], to_m = [16, 2, 1] }]",
    ];
    refused("drop-impact", &pool, &[key, "0.0728", "Bond", "metres", "leave the effect out"]);
    let drop = [
        "particle_distance_m=0.03333",
        "time_step_s=1e-3",
        "geometry.lattice.extent_m=[1.2, 1.2, 0.0]",
        "geometry.region=[{ fill = \"fluid\", sphere = { center_m = [0.6, 0.6, 0], radius_m = 0.5 }, \
         velocity_m_s = [100.0, 0, 0] }]",
    ];
    refused("oscillating-drop", &drop, &[key, "0.0728", "Weber", "inertia"]);
    accepted("drop-impact", &["particle_distance_m=0.0004", &format!("{key}=0")]);
}
