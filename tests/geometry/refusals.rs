//! Each mistake is refused with the key, what was found and what is allowed.

use repro::scene::geometry::{Geometry, Hydrostatics, Placement};

use crate::support::{lattice, place, placed, region};

const BOX: &str = "from_m = [0, 0, 0]\nto_m = [4, 4, 4]\n";

#[track_caller]
fn refused_in(placement: &Placement<'_>, text: &str, words: &[&str]) {
    let error = place(text, placement).expect_err("must be refused").to_string();
    for word in words.iter().chain(&[placement.file]) {
        assert!(error.contains(word), "`{word}` is not in: {error}");
    }
}

/// In three dimensions, with a lattice of 0 to 8.
#[track_caller]
fn refused(text: &str, words: &[&str]) {
    refused_in(&Placement::new("scene.toml", 1.0), &(lattice(8.0, 0) + text), words);
}

/// With a region that is fine before the one that is not.
#[track_caller]
fn region_refused(fill: &str, rest: &str, words: &[&str]) {
    refused(&(region("fluid", BOX) + &region(fill, rest)), words);
}

#[test]
fn lattices() {
    let placement = Placement::new("scene.toml", 1.0);
    let refused = |lattice: &str, words: &[&str]| {
        refused_in(&placement, &format!("lattice = {{ {lattice} }}\n{}", region("fluid", BOX)), words);
    };
    refused("extent_m = [1, -1, 1], layers = 0", &["geometry.lattice.extent_m", "-1.0", "from 0 up"]);
    refused("extent_m = [1, inf, 1], layers = 0", &["geometry.lattice.extent_m", "inf", "finite"]);
    refused("extent_m = [1, 1, 1], layers = 65", &["geometry.lattice.layers", "65", "0 to 64"]);
    refused("extent_m = [1, 1, 1], layers = 0, origin_m = [0, nan, 0]", &["origin_m", "NaN", "finite"]);
    refused("extent_m = [1e4, 1e4, 1e4], layers = 0", &["particle_distance_m", "1.000e12", "raise it"]);
    let plane = Placement { dimensions: 2, ..placement };
    let text = format!("lattice = {{ extent_m = [1, 1, 1], layers = 0 }}\n{}", region("fluid", BOX));
    refused_in(&plane, &text, &["geometry.lattice.extent_m", "two dimensions", "must be 0"]);
    let text = text.replace("[1, 1, 1]", "[1, 1, 0], origin_m = [0, 0, 1]");
    refused_in(&plane, &text, &["geometry.lattice.origin_m", "two dimensions", "must be 0"]);
}

#[test]
fn unknown_keys_are_named_with_those_that_are_known() {
    for (text, words) in [
        (region("fluid", "sphere = { center_m = [0, 0, 0], radius = 1 }"), ["radius", "radius_m"]),
        (region("water", BOX), ["water", "dummy_wall"]),
        (region("fluid", "ball = 1"), ["ball", "sphere"]),
        ("jitter = { size = 1 }\n".to_string(), ["size", "amplitude"]),
    ] {
        let error = toml::from_str::<Geometry>(&(lattice(1.0, 0) + &text)).unwrap_err().to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    }
}

#[test]
fn a_region_has_one_shape() {
    let key = "`geometry.region[1]`";
    region_refused("wall", "", &[key, "without a shape", "`from_m` and `to_m`", "`sphere`", "`stl`"]);
    region_refused("wall", "from_m = [0, 0, 0]", &[key, "without `to_m`", "both corners"]);
    region_refused("wall", "to_m = [0, 0, 0]", &[key, "without `from_m`", "both corners"]);
    let sphere = "sphere = { center_m = [4, 4, 4], radius_m = 1 }";
    region_refused("wall", &format!("{BOX}{sphere}"), &[key, "a box and `sphere`", "give it one"]);
    region_refused(
        "wall",
        &format!("{sphere}\nstl = {{ file = \"a.stl\" }}"),
        &[key, "`sphere` and `stl`", "give it one"],
    );
}

#[test]
fn shapes() {
    let key = |rest: &str| format!("geometry.region[1].{rest}");
    let sphere =
        |center: &str, radius: &str| format!("sphere = {{ center_m = {center}, radius_m = {radius} }}");
    region_refused("wall", &sphere("[0, inf, 0]", "1"), &[&key("sphere.center_m"), "inf", "finite"]);
    for radius in ["0", "-1", "nan", "inf"] {
        region_refused("wall", &sphere("[0, 0, 0]", radius), &[&key("sphere.radius_m"), "above 0"]);
    }
    let cylinder = |to: &str, radius: &str| {
        format!("cylinder = {{ from_m = [1, 1, 1], to_m = {to}, radius_m = {radius} }}")
    };
    region_refused("wall", &cylinder("[1, 1, nan]", "1"), &[&key("cylinder.to_m"), "NaN", "finite"]);
    region_refused("wall", &cylinder("[1, 1, 1]", "1"), &[&key("cylinder.to_m"), "away from `from_m`"]);
    region_refused("wall", &cylinder("[1, 1, 2]", "0"), &[&key("cylinder.radius_m"), "is 0", "above 0"]);
    let half = |point: &str, normal: &str| format!("half_space = {{ point_m = {point}, normal = {normal} }}");
    region_refused("wall", &half("[nan, 0, 0]", "[0, 1, 0]"), &[&key("half_space.point_m"), "NaN"]);
    for normal in ["[0, 0, 0]", "[1e-200, 0, 0]"] {
        region_refused("wall", &half("[0, 0, 0]", normal), &[&key("half_space.normal"), "any direction"]);
    }
    region_refused("wall", &half("[0, 0, 0]", "[0, inf, 0]"), &[&key("half_space.normal"), "inf", "finite"]);
    let stl = |rest: &str| format!("stl = {{ file = {rest} }}");
    region_refused("wall", &stl("\"\""), &[&key("stl.file"), "empty", "path of an STL file"]);
    region_refused("wall", &stl("\"a.stl\", scale = 0"), &[&key("stl.scale"), "is 0", "above 0"]);
    region_refused("wall", &stl("\"a.stl\", translate_m = [0, nan, 0]"), &[&key("stl.translate_m"), "NaN"]);
    let missing = ["geometry.region[1].stl.file", "no-such.stl", "cannot be read", "scene file's folder"];
    region_refused("wall", &stl("\"no-such.stl\""), &missing);
    region_refused("wall", &stl("\".\""), &["stl.file", "it is no file"]);
}

#[test]
fn boxes_and_layers() {
    region_refused("wall", "from_m = [0, nan, 0]\nto_m = [1, 1, 1]", &["region[1]", "corner", "`inf`"]);
    region_refused("wall", "from_m = [0, 2, 0]\nto_m = [1, 1, 1]", &["region[1]", "the box", "lie above"]);
    let sphere = "sphere = { center_m = [4, 4, 4], radius_m = 1 }\n";
    let layers = format!("{sphere}layers_above = [1, 0, 0]");
    region_refused("wall", &layers, &["geometry.region[1].layers_below", "only a box", "`layers_outside`"]);
    for layers in ["0", "-1", "65", "nan"] {
        let text = format!("{sphere}layers_outside = {layers}");
        region_refused("wall", &text, &["geometry.region[1].layers_outside", "above 0 up to 64"]);
    }
    let text = format!("{BOX}layers_outside = 2");
    region_refused("wall", &text, &["geometry.region[1].layers_outside", "is 2", "`layers_below`"]);
}

#[test]
fn regions_that_hold_nothing_are_named() {
    let sphere =
        |center: &str, radius: &str| format!("sphere = {{ center_m = {center}, radius_m = {radius} }}");
    let key = "`geometry.region[1]` is a wall region that holds no particle";
    region_refused(
        "wall",
        &sphere("[20, 4, 4]", "1"),
        &[key, "outside the lattice", "from [0.0, 0.0, 0.0] to [8.0, 8.0, 8.0] m", "extent_m"],
    );
    region_refused(
        "wall",
        &sphere("[4.5, 4.5, 4.5]", "0.1"),
        &[key, "no lattice point lies in", "lower `particle_distance_m`"],
    );
    let covered = region("wall", &sphere("[2, 2, 2]", "1")) + &region("fluid", BOX);
    refused(&covered, &["`geometry.region[0]` is a wall region", "later regions cover", "put it after"]);
    // An `empty` one may be open to all sides, and hold nothing.
    assert_eq!(
        placed(&(lattice(2.0, 0) + &region("fluid", BOX) + &region("empty", &sphere("[20, 4, 4]", "1"))))
            .len(),
        8
    );
}

#[test]
fn attributes_that_a_region_cannot_have() {
    let with = |rest: &str| format!("{BOX}{rest}");
    let named = with("group = \"a\"");
    region_refused("empty", &named, &["geometry.region[1].group", "an empty region", "remove it"]);
    for fill in ["wall", "dummy_wall", "empty"] {
        let name = format!("a {fill} region").replace("a empty", "an empty");
        let velocity = with("velocity_m_s = [1, 0, 0]");
        region_refused(fill, &velocity, &["region[1].velocity_m_s", &name, "only fluid"]);
        let field = with("velocity_field = { rotation_rad_s = [0, 0, 1] }");
        region_refused(fill, &field, &["region[1].velocity_field", &name, "only fluid"]);
    }
    region_refused(
        "fluid",
        &with("velocity_m_s = [1, nan, 0]"),
        &["region[1].velocity_m_s", "NaN", "finite"],
    );
    let field = "velocity_field = { rotation_rad_s = [0, inf, 1] }";
    region_refused("fluid", &with(field), &["region[1].velocity_field", "inf", "finite"]);
    let field = "velocity_field = { about_m = [1, 1, 1] }";
    region_refused("fluid", &with(field), &["region[1].velocity_field", "zero everywhere", "`gradient_1_s`"]);
    for group in ["", "a b", "a/b", "ä", &"a".repeat(65)] {
        let text = with(&format!("group = \"{group}\""));
        region_refused("fluid", &text, &["region[1].group", &format!("`{group}`"), "letters, digits"]);
    }
    let gravity = ["region[1].hydrostatic", "without gravity", "`effects.gravity`"];
    region_refused("fluid", &with("hydrostatic = { surface_m = 1 }"), &gravity);
    let rest = |g| Some(Hydrostatics { density_kg_m3: 1000.0, gravity_m_s2: [0.0, g, 0.0] });
    let placement = |g| Placement { hydrostatics: rest(g), ..Placement::new("scene.toml", 1.0) };
    let text = |fill: &str, surface: &str| {
        lattice(8.0, 0)
            + &region("fluid", BOX)
            + &region(fill, &with(&format!("hydrostatic = {{ surface_m = {surface} }}")))
    };
    refused_in(&placement(0.0), &text("fluid", "1"), &gravity);
    refused_in(&placement(-9.8), &text("fluid", "nan"), &["hydrostatic.surface_m", "NaN", "finite"]);
    let words = ["region[1].hydrostatic", "a dummy_wall region", "only fluid and wall"];
    refused_in(&placement(-9.8), &text("dummy_wall", "1"), &words);
}

#[test]
fn more_groups_than_a_byte_counts() {
    let regions = |count: usize| {
        (0..count).map(|k| region("fluid", &format!("{BOX}group = \"g{k}\""))).collect::<String>()
    };
    refused(&regions(256), &["`geometry`", "256 groups", "at most 255"]);
    let geometry: Geometry = toml::from_str(&(lattice(8.0, 0) + &regions(255))).unwrap();
    let check = repro::base::input::Check { file: "" };
    geometry.check(check, &Placement::new("", 1.0)).unwrap();
    assert_eq!(geometry.group_names().len(), 256);
}

#[test]
fn velocities_out_of_the_plane() {
    let plane = Placement { dimensions: 2, ..Placement::new("scene.toml", 1.0) };
    let refused = |rest: &str, words: &[&str]| {
        let text = "lattice = { extent_m = [8, 8, 0], layers = 0 }\n".to_string() + rest;
        refused_in(&plane, &text, words);
    };
    let fluid = |rest: &str| region("fluid", &format!("{BOX}{rest}"));
    refused(&fluid("velocity_m_s = [0, 0, 1]"), &["region[0].velocity_m_s", "two dimensions", "must be 0"]);
    for field in ["rotation_rad_s = [1, 0, 0]", "gradient_1_s = [[0, 0, 0], [0, 0, 0], [1, 0, 0]]"] {
        let text = fluid(&format!("velocity_field = {{ {field} }}"));
        refused(&text, &["region[0].velocity_field", "two dimensions", "[0, 0, w]"]);
    }
    let single = |rest: &str| fluid("") + "[[particle]]\nkind = \"fluid\"\n" + rest;
    refused(&single("position_m = [1, 1, 1]"), &["particle[0].position_m", "two dimensions"]);
    let moving = "position_m = [1, 1, 0]\nvelocity_m_s = [0, 0, 1]";
    refused(&single(moving), &["particle[0].velocity_m_s", "two dimensions"]);
}

#[test]
fn single_particles() {
    let single = |rest: &str| region("fluid", BOX) + "[[particle]]\nkind = \"wall\"\n" + rest;
    refused(&single("position_m = [0, nan, 0]"), &["geometry.particle[0].position_m", "NaN", "finite"]);
    let moving = "position_m = [0, 0, 0]\nvelocity_m_s = [1, 0, 0]";
    refused(&single(moving), &["geometry.particle[0].velocity_m_s", "only fluid"]);
    refused(&single("position_m = [0, 0, 0]\ngroup = \"\""), &["geometry.particle[0].group", "1 to 64"]);
    let periodic = Placement { periodic: [false, true, false], ..Placement::new("scene.toml", 1.0) };
    let text = lattice(8.0, 0) + &single("position_m = [99, 8, 99]");
    refused_in(&periodic, &text, &["particle[0].position_m", "periodic axis y", "0 m up to, and not, 8 m"]);
    place(&text.replace("[99, 8, 99]", "[99, 7.9, 99]"), &periodic).unwrap();
}

#[test]
fn jitter() {
    for amplitude in ["0.5", "-0.1", "nan", "inf"] {
        let text = format!("jitter = {{ amplitude = {amplitude} }}\n") + &region("fluid", BOX);
        refused(&text, &["geometry.jitter.amplitude", "from 0 up to, and not, 0.5"]);
    }
}

#[test]
fn scenes_in_which_nothing_can_move() {
    refused("", &["`geometry` is empty", "a particle"]);
    refused(&region("empty", BOX), &["`geometry` is empty", "hold a lattice point"]);
    let wall = region("wall", BOX);
    refused(&wall, &["`geometry`", "without fluid", "`fill`", "[[geometry.particle]]"]);
    let moving = Placement { moves_without_fluid: true, ..Placement::new("scene.toml", 1.0) };
    assert_eq!(place(&(lattice(8.0, 0) + &wall), &moving).unwrap().len(), 64);
    let single = "[[particle]]\nkind = \"wall\"\nposition_m = [1, 1, 1]\n";
    assert_eq!(placed(&(lattice(8.0, 0) + &wall + single)).len(), 65, "on a lattice point, and coincident");
}
