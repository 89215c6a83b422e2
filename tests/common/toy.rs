//! The program's scenes at toy size, and a few with an effect that none of them names: between them they have every one.

use repro::scene::{Scene, library};

/// A scene, and what makes it small.
pub type Toy = (&'static str, &'static [&'static str]);

/// Each runs some tens of steps in a moment.
pub const TOYS: &[Toy] = &[
    ("dam-break", &["particle_distance_m=0.05"]),
    ("dam-break-obstacle", &["particle_distance_m=0.04", "geometry.lattice.layers=5"]),
    ("still-water", &["particle_distance_m=0.025"]),
    ("falling-block", &["particle_distance_m=0.04"]),
    ("lone-particle", &[]),
    ("leaver", &[]),
    ("drop-impact", &["particle_distance_m=0.0004", "time_step_s=4e-5"]),
    ("oscillating-drop", &["particle_distance_m=0.0001", "time_step_s=8e-6"]),
    (
        "oscillating-drop",
        &[
            "particle_distance_m=0.0001",
            "time_step_s=8e-6",
            "effects.surface_tension=false",
            "effects.potential_tension.surface_tension_n_m=0.0728",
        ],
    ),
    (
        "filling-mould",
        &[
            "particle_distance_m=0.02",
            "time_step_s=0.001",
            // Without it there were no fluid without the inflow.
            "geometry.particle=[{ kind = \"fluid\", position_m = [0.311, 0.207, 0.0] }]",
        ],
    ),
    ("floating-box", &["particle_distance_m=0.04", "time_step_s=0.001"]),
    ("piston-wave", &["particle_distance_m=0.06", "time_step_s=0.002"]),
    ("rotating-cup", &["particle_distance_m=0.06", "time_step_s=0.002"]),
    (
        "rotating-cup",
        &["particle_distance_m=0.06", "time_step_s=0.002", "effects.turbulence.smagorinsky_constant=0.15"],
    ),
    ("sloshing-tank", &["particle_distance_m=0.08", "time_step_s=0.003"]),
    ("heated-cavity", &["particle_distance_m=0.0018"]),
    (
        "heated-cavity",
        &[
            "particle_distance_m=0.0018",
            "effects.scalar.diffusivity_m2_s=1e-5",
            "effects.scalar.initial=0.5",
            "effects.viscosity.form=angular_momentum",
        ],
    ),
    ("mud-flow", &["particle_distance_m=0.01"]),
    ("mud-flow", &["particle_distance_m=0.01", "effects.implicit_viscosity.walls=mirrored"]),
];

/// A scene of the table with further changes.
pub fn load((name, small): Toy, more: &[&str]) -> Scene {
    let sets: Vec<String> = small.iter().chain(more).map(|set| set.to_string()).collect();
    library::load(name, &sets).unwrap()
}
