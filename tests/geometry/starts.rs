//! What particles start with: groups, velocities, hydrostatic pressure.

use repro::base::vec3::dot;
use repro::engine::particles::{InitialParticle, Kind};
use repro::scene::geometry::{Geometry, Hydrostatics, Placement};

use crate::support::{by_group, lattice, place, placed, region};

const ALL: &str = "from_m = [-inf, -inf, -inf]\nto_m = [inf, inf, inf]\n";

#[test]
fn groups_count_from_one_in_the_order_of_the_file() {
    let half = |side: &str, group: &str| {
        region(
            "fluid",
            &format!("half_space = {{ point_m = [1.5, 0, 0], normal = [{side}, 0, 0] }}\n{group}"),
        )
    };
    let text = lattice(3.0, 0)
        + &half("1", "group = \"left\"")
        + &half("-1", "group = \"right\"")
        + &region("fluid", "from_m = [-1, -1, -1]\nto_m = [0, 0, 0]")
        + "[[particle]]\nkind = \"wall\"\nposition_m = [9, 9, 9]\ngroup = \"left\"\n\
           [[particle]]\nkind = \"fluid\"\nposition_m = [8, 8, 8]\ngroup = \"probe\"\n";
    let geometry: Geometry = toml::from_str(&text).unwrap();
    assert_eq!(geometry.group_names(), ["", "left", "right", "probe"]);
    let particles = placed(&text);
    assert_eq!(by_group(&particles).into_iter().collect::<Vec<_>>(), [(0, 1), (1, 32), (2, 32), (3, 1)]);
    assert_eq!(particles[0].group, 0, "the later region without a name took it");
}

#[test]
fn without_attributes_particles_are_at_rest() {
    for particle in placed(&(lattice(2.0, 0) + &region("fluid", ALL))) {
        assert_eq!(particle, InitialParticle::at_rest(Kind::Fluid, particle.position));
    }
}

#[test]
fn numbers_reach_the_particles() {
    let text = lattice(1.0, 0)
        + &region("wall", ALL)
        + &region("fluid", "from_m = [-1, -1, -1]\nto_m = [0, 0, 0]\nvelocity_m_s = [1, 2, 3]")
        + "[[particle]]\nkind = \"fluid\"\nposition_m = [9, 9, 9]\nvelocity_m_s = [4, 5, 6]\n";
    let particles = placed(&text);
    assert_eq!([0, 1, 8].map(|k| particles[k].velocity), [[1.0, 2.0, 3.0], [0.0; 3], [4.0, 5.0, 6.0]]);
}

#[test]
fn a_rigid_rotation_is_perpendicular_to_axis_and_radius() {
    let field = "velocity_field = { rotation_rad_s = [0.5, -1, 2], about_m = [1, 2, 3] }";
    for particle in placed(&(lattice(4.0, 0) + &region("fluid", &format!("{ALL}{field}")))) {
        let radius = [0, 1, 2].map(|d| particle.position[d] - [1.0, 2.0, 3.0][d]);
        assert_eq!((dot(particle.velocity, radius), dot(particle.velocity, [0.5, -1.0, 2.0])), (0.0, 0.0));
    }
    let about_z = "velocity_field = { rotation_rad_s = [0, 0, 2] }";
    let particles = placed(&(lattice(1.0, 0) + &region("fluid", &format!("{ALL}{about_z}"))));
    let along_x = particles.iter().find(|p| p.position == [1.0, 0.0, 0.0]).unwrap();
    assert_eq!(along_x.velocity, [0.0, 2.0, 0.0], "anticlockwise as seen from the axis' tip");
}

/// The elliptic drop: u = (-x, y), and a shear flow u = (y, 0) that moves along.
#[test]
fn a_gradient_is_a_linear_field() {
    let at = |field: &str, point: [f64; 3]| {
        let particles = placed(&(lattice(4.0, 0) + &region("fluid", &format!("{ALL}{field}"))));
        particles.iter().find(|p| p.position == point).unwrap().velocity
    };
    let drop = "velocity_field = { about_m = [2, 2, 2], gradient_1_s = [[-3, 0, 0], [0, 3, 0], [0, 0, 0]] }";
    assert_eq!(at(drop, [4.0, 1.0, 0.0]), [-6.0, -3.0, 0.0]);
    let shear =
        "velocity_m_s = [10, 0, 0]\nvelocity_field = { gradient_1_s = [[0, 0.5, 0], [0, 0, 0], [0, 0, 0]] }";
    assert_eq!(at(shear, [3.0, 4.0, 1.0]), [12.0, 0.0, 0.0]);
}

/// The velocity is that of where the particle is, not of its lattice point.
#[test]
fn a_field_is_taken_where_jitter_put_the_particle() {
    let text = lattice(2.0, 0)
        + "jitter = { amplitude = 0.4 }\n"
        + &region("fluid", &format!("{ALL}velocity_field = {{ rotation_rad_s = [0, 0, 1] }}"));
    for particle in placed(&text) {
        assert_eq!(particle.velocity, [-particle.position[1], particle.position[0], 0.0]);
    }
}

#[test]
fn hydrostatic_pressure_is_that_of_the_depth() {
    let water = |gravity_m_s2| Some(Hydrostatics { density_kg_m3: 1000.0, gravity_m_s2 });
    let text = |fill: &str| {
        lattice(4.0, 0)
            + &region(fill, &format!("{ALL}hydrostatic = {{ surface_m = 3 }}"))
            + "[[particle]]\nkind = \"fluid\"\nposition_m = [9, 0, 9]\n"
    };
    for fill in ["fluid", "wall"] {
        let placement =
            Placement { hydrostatics: water([0.0, -9.8, 0.0]), ..Placement::new("scene.toml", 1.0) };
        let particles = place(&text(fill), &placement).unwrap();
        for particle in &particles[..125] {
            let depth = (3.0 - particle.position[1]).max(0.0);
            assert!((particle.pressure - 9800.0 * depth).abs() < 1e-9, "{particle:?}");
        }
        assert_eq!(particles[125].pressure, 0.0);
    }
    let placement = Placement { hydrostatics: water([6.0, 0.0, -8.0]), ..Placement::new("scene.toml", 1.0) };
    for particle in &place(&text("fluid"), &placement).unwrap()[..125] {
        // Along gravity (0.6, 0, -0.8) the pressure rises by rho |g| = 10,000 Pa a metre, from 3 m above the origin.
        let depth = 3.0 + 0.6 * particle.position[0] - 0.8 * particle.position[2];
        assert!((particle.pressure - 10_000.0 * depth.max(0.0)).abs() < 1e-6, "{particle:?}");
    }
}
