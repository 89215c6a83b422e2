//! A file with every key is read and placed, and an editor is told what each key means.

use repro::engine::particles::Kind;
use repro::scene::geometry::{Geometry, Hydrostatics, Placement};

use crate::support::{beside, binary, box_surface, by_group, place};

const EXAMPLE: &str = include_str!("example.toml");

#[test]
fn every_key_has_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let scene = beside(folder.path(), &binary(&box_surface([0.0; 3], [300.0, 300.0, 400.0])));
    let rest = Hydrostatics { density_kg_m3: 1000.0, gravity_m_s2: [0.0, -9.8, 0.0] };
    let placement = Placement { hydrostatics: Some(rest), ..Placement::new(&scene, 0.05) };
    let particles = place(EXAMPLE, &placement).unwrap_or_else(|error| panic!("{error}"));
    let geometry: Geometry = toml::from_str(EXAMPLE).unwrap();
    assert_eq!(geometry.group_names(), ["", "tank", "pool", "drop", "obstacle", "probe"]);
    let groups = by_group(&particles);
    assert_eq!((groups.len(), groups[&5]), (6, 1));
    // A ball of the radius of three particle distances around a lattice point.
    assert_eq!(groups[&3], 123);
    let kinds = [Kind::Fluid, Kind::Wall, Kind::DummyWall];
    assert!(kinds.iter().all(|kind| particles.iter().any(|p| p.kind == *kind)));
    let within = |x: f64, low: f64, high: f64| x > low + 0.001 && x < high - 0.001;
    assert!(!particles.iter().any(|p| {
        within(p.position[0], 0.3, 0.6) && within(p.position[1], 0.0, 0.3) && within(p.position[2], 0.3, 0.7)
    }));
}

/// Descriptions become what an editor shows, so no key may be without one.
#[cfg(feature = "driver")]
#[test]
fn every_key_of_the_schema_is_described() {
    let schema = serde_json::to_value(schemars::schema_for!(Geometry)).unwrap();
    let mut types = vec![("Geometry", &schema)];
    types.extend(
        schema["$defs"].as_object().unwrap().iter().map(|(name, definition)| (name.as_str(), definition)),
    );
    let mut keys = 0;
    for (name, definition) in types {
        assert!(definition["description"].is_string(), "{name}");
        for (key, value) in definition["properties"].as_object().into_iter().flatten() {
            keys += 1;
            assert!(value["description"].is_string(), "{name}.{key} has no description: {value}");
            assert!(EXAMPLE.contains(key), "the example shows {name}.{key}");
        }
    }
    assert!(keys > 40, "{keys}");
}
