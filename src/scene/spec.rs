//! A scene file: its keys, their checks, and the engine's parameters that follow from it.

use serde::Deserialize;

use crate::base::input::{Check, InputError};
use crate::base::vec3::Vec3;
use crate::engine::effects::{collision, gravity, viscosity, wall_contact};
use crate::engine::parameters::{self, Domain, Effects, Parameters};
use crate::engine::particles::InitialParticle;
use crate::engine::pressure;
use crate::scene::geometry::{Geometry, MAX_LATTICE_POINTS};
use crate::scene::probe::{self, spec::ProbeSpec};

/// The version of the scene format.
pub const SCHEMA: u32 = 1;
/// The most steps a simulation may take.
pub const MAX_STEPS: usize = 100_000_000;
/// An upper estimate of the memory that a particle takes in one simulation, bytes: its columns, its share of the
/// search, and a row of the pressure matrix with room for a crowded neighbourhood.
pub const BYTES_PER_PARTICLE: usize = 3000;
/// The same for a bucket: its list, and a row of the relocated copy as wide as a crowded bucket.
pub const BYTES_PER_BUCKET: usize = 2000;

/// A scene as its file describes it. Lengths, times and so on are SI; radii are in particle distances.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    pub schema: u32,
    pub name: String,
    /// What the scene shows, in a sentence.
    pub description: String,
    pub particle_distance_m: f64,
    pub time_step_s: f64,
    pub end_time_s: f64,
    pub fluid: Fluid,
    pub radii: Radii,
    pub domain: DomainMargins,
    pub effects: EffectsSpec,
    pub geometry: Geometry,
    /// What is looked at while the scene is simulated.
    #[serde(default)]
    pub probe: Vec<ProbeSpec>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fluid {
    pub density_kg_m3: f64,
}

/// Influence radii in particle distances.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Radii {
    pub number_density: f64,
    pub gradient: f64,
    pub laplacian: f64,
}

/// How far the bucket domain reaches beyond the initial particles.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DomainMargins {
    /// On all sides, metres.
    pub margin_m: f64,
    /// Upwards (+y) in addition, metres.
    pub headroom_m: f64,
}

/// The effects that the scene names.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EffectsSpec {
    pub gravity: Option<GravitySpec>,
    pub viscosity: Option<ViscositySpec>,
    pub collision: Option<CollisionSpec>,
    pub wall_contact: Option<WallContactSpec>,
    pub pressure: Option<PressureSpec>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GravitySpec {
    pub acceleration_m_s2: Vec3,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViscositySpec {
    pub kinematic_viscosity_m2_s: f64,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CollisionSpec {
    /// In particle distances.
    pub distance: f64,
    pub restitution: f64,
}

/// In particle distances.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WallContactSpec {
    pub height: f64,
    pub reach: f64,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PressureSpec {
    pub surface_threshold: f64,
    pub source_relaxation: f64,
    pub compressibility_1_pa: f64,
    /// In particle distances.
    pub kernel_floor: Option<f64>,
}

impl Scene {
    /// Reads and checks a scene. `file` names it in errors; `sets` are changes `dotted.key=value` to its keys.
    pub fn parse(text: &str, file: &str, sets: &[String]) -> Result<Scene, InputError> {
        let mut table: toml::Table = toml::from_str(text).map_err(|error| syntax_error(file, &error))?;
        for set in sets {
            apply(&mut table, set, file)?;
        }
        // Serialised anew, so that an error's position and key are those of the changed scene.
        let scene: Scene = table.try_into().map_err(|error| syntax_error(file, &error))?;
        scene.check(file)?;
        Ok(scene)
    }

    fn check(&self, file: &str) -> Result<(), InputError> {
        let check = Check { file };
        check.require(
            self.schema == SCHEMA,
            "schema",
            self.schema,
            format!("this program reads schema {SCHEMA}"),
        )?;
        check.positive("particle_distance_m", self.particle_distance_m)?;
        check.positive("time_step_s", self.time_step_s)?;
        check.not_negative("end_time_s", self.end_time_s)?;
        let steps = self.end_time_s / self.time_step_s;
        let allowed = format!("`time_step_s` may divide it into at most {MAX_STEPS} steps");
        check.require(steps <= MAX_STEPS as f64, "end_time_s", self.end_time_s, allowed)?;
        check.positive("fluid.density_kg_m3", self.fluid.density_kg_m3)?;
        for (key, radius) in [
            ("radii.number_density", self.radii.number_density),
            ("radii.gradient", self.radii.gradient),
            ("radii.laplacian", self.radii.laplacian),
        ] {
            let allowed = "allowed are radii above 1 and up to 10 particle distances";
            check.require(radius > 1.0 && radius <= 10.0, key, radius, allowed)?;
        }
        check.not_negative("domain.margin_m", self.domain.margin_m)?;
        check.not_negative("domain.headroom_m", self.domain.headroom_m)?;
        self.effects.check(check)?;
        probe::spec::check(&self.probe, check)?;
        self.geometry.check(check, self.particle_distance_m)
    }

    /// The number of time steps up to the end time.
    pub fn steps(&self) -> usize {
        (self.end_time_s / self.time_step_s - 1e-9).ceil().max(0.0) as usize
    }

    /// Refuses a scene that would need more memory than there is: `copies` simulations of it at a time.
    pub fn require_memory(&self, file: &str, copies: usize, available_bytes: u64) -> Result<(), InputError> {
        let single = self.geometry.particle.len() as f64;
        let points = self.geometry.lattice_points(self.particle_distance_m) + single;
        let buckets = self.buckets();
        let bytes = points * BYTES_PER_PARTICLE as f64 + buckets * BYTES_PER_BUCKET as f64;
        let needed = bytes * copies as f64;
        let gib = f64::from(1 << 30);
        Check { file }.require(
            needed <= available_bytes as f64 && points <= MAX_LATTICE_POINTS as f64,
            "particle_distance_m",
            self.particle_distance_m,
            format!(
                "its lattice of {points:.0} points in {buckets:.0} buckets would need up to {:.1} GiB and {:.1} GiB are \
                 available: raise it, or shrink `domain`",
                needed / gib,
                available_bytes as f64 / gib
            ),
        )
    }

    /// An upper estimate of the number of buckets.
    fn buckets(&self) -> f64 {
        let radii = &self.radii;
        let side = radii.number_density.max(radii.gradient).max(radii.laplacian) * self.particle_distance_m;
        let (low, high) = self.geometry.bounds(self.particle_distance_m);
        let margins = 2.0 * self.domain.margin_m;
        let headroom = [0.0, self.domain.headroom_m, 0.0];
        (0..3).map(|d| ((high[d] - low[d] + margins + headroom[d]) / side).floor() + 3.0).product()
    }

    /// The particles at the start, in the order of their identities.
    pub fn particles(&self, file: &str) -> Result<Vec<InitialParticle>, InputError> {
        let particles = self.geometry.fill(self.particle_distance_m);
        Check { file }.require(
            !particles.is_empty(),
            "geometry",
            "empty",
            "a region must hold a lattice point, or a particle be given",
        )?;
        Ok(particles)
    }

    /// What the engine needs to know. The bucket domain follows from where the scene's own particles start.
    pub fn parameters(&self, initial: &[InitialParticle]) -> Parameters {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for particle in initial {
            for d in 0..3 {
                low[d] = low[d].min(particle.position[d] - self.domain.margin_m);
                high[d] = high[d].max(particle.position[d] + self.domain.margin_m);
            }
        }
        high[1] += self.domain.headroom_m;
        Parameters {
            particle_distance_m: self.particle_distance_m,
            time_step_s: self.time_step_s,
            density_kg_m3: self.fluid.density_kg_m3,
            radii: parameters::Radii {
                number_density: self.radii.number_density,
                gradient: self.radii.gradient,
                laplacian: self.radii.laplacian,
            },
            domain: Domain { low, high },
            effects: self.effects.to_engine(),
        }
    }
}

impl EffectsSpec {
    /// The keys of the fields above: what a scene may name, and switch off.
    const NAMES: [&'static str; 5] = ["gravity", "viscosity", "collision", "wall_contact", "pressure"];

    fn check(&self, check: Check<'_>) -> Result<(), InputError> {
        if let Some(gravity) = &self.gravity {
            let finite = gravity.acceleration_m_s2.iter().all(|a| a.is_finite());
            let found = format!("{:?}", gravity.acceleration_m_s2);
            check.require(
                finite,
                "effects.gravity.acceleration_m_s2",
                found,
                "allowed are three finite numbers",
            )?;
        }
        if let Some(viscosity) = &self.viscosity {
            check.not_negative(
                "effects.viscosity.kinematic_viscosity_m2_s",
                viscosity.kinematic_viscosity_m2_s,
            )?;
        }
        if let Some(collision) = &self.collision {
            let (key, distance) = ("effects.collision.distance", collision.distance);
            check.require(
                distance > 0.0 && distance < 1.0,
                key,
                distance,
                "allowed are numbers between 0 and 1",
            )?;
            let (key, restitution) = ("effects.collision.restitution", collision.restitution);
            check.require(
                (0.0..=1.0).contains(&restitution),
                key,
                restitution,
                "allowed are numbers from 0 to 1",
            )?;
        }
        if let Some(contact) = &self.wall_contact {
            for (name, value) in [("height", contact.height), ("reach", contact.reach)] {
                let key = format!("effects.wall_contact.{name}");
                check.require(
                    value > 0.0 && value < 1.5,
                    &key,
                    value,
                    "allowed are numbers between 0 and 1.5",
                )?;
            }
        }
        if let Some(pressure) = &self.pressure {
            let (key, threshold) = ("effects.pressure.surface_threshold", pressure.surface_threshold);
            check.require(
                threshold > 0.0 && threshold <= 1.0,
                key,
                threshold,
                "allowed are numbers above 0 up to 1",
            )?;
            let (key, relaxation) = ("effects.pressure.source_relaxation", pressure.source_relaxation);
            check.require(
                relaxation > 0.0 && relaxation <= 1.0,
                key,
                relaxation,
                "allowed are numbers above 0 up to 1",
            )?;
            check.not_negative("effects.pressure.compressibility_1_pa", pressure.compressibility_1_pa)?;
            if let Some(floor) = pressure.kernel_floor {
                check.require(
                    floor > 0.0 && floor <= 1.0,
                    "effects.pressure.kernel_floor",
                    floor,
                    "allowed are numbers above 0 up to 1; without the key there is no floor",
                )?;
            }
        }
        Ok(())
    }

    fn to_engine(&self) -> Effects {
        Effects {
            gravity: self
                .gravity
                .as_ref()
                .map(|g| gravity::Gravity { acceleration_m_s2: g.acceleration_m_s2 }),
            viscosity: self
                .viscosity
                .as_ref()
                .map(|v| viscosity::Viscosity { kinematic_viscosity_m2_s: v.kinematic_viscosity_m2_s }),
            collision: self
                .collision
                .as_ref()
                .map(|c| collision::Collision { distance: c.distance, restitution: c.restitution }),
            wall_contact: self
                .wall_contact
                .as_ref()
                .map(|c| wall_contact::WallContact { height: c.height, reach: c.reach }),
            pressure: self.pressure.as_ref().map(|p| pressure::Pressure {
                surface_threshold: p.surface_threshold,
                source_relaxation: p.source_relaxation,
                compressibility_1_pa: p.compressibility_1_pa,
                kernel_floor: p.kernel_floor,
            }),
        }
    }
}

/// Sets the value behind a dotted key; `false` removes the table there, which switches an effect off. A key that the
/// scene format does not know is refused when the scene is read.
fn apply(table: &mut toml::Table, set: &str, file: &str) -> Result<(), InputError> {
    let wrong = |allowed: &str| InputError::new(file, "--set", format!("`{set}`"), allowed.to_string());
    let (key, value) = set.split_once('=').ok_or_else(|| wrong("allowed is `dotted.key=value`"))?;
    let value = format!("value = {value}")
        .parse::<toml::Table>()
        .ok()
        .and_then(|mut parsed| parsed.remove("value"))
        .unwrap_or_else(|| toml::Value::String(value.to_string()));
    let mut path: Vec<&str> = key.split('.').collect();
    let last =
        path.pop().filter(|last| !last.is_empty()).ok_or_else(|| wrong("allowed is `dotted.key=value`"))?;
    let mut target = table;
    for part in path {
        let entry = target.entry(part).or_insert_with(|| toml::Value::Table(toml::Table::new()));
        target = entry.as_table_mut().ok_or_else(|| wrong("a part of its key is a value, not a table"))?;
    }
    if value == toml::Value::Boolean(false) {
        return remove_table(target, last, key).map_err(|allowed| wrong(&allowed));
    }
    // A whole number is as good as a decimal one where a length or a time is asked for.
    let value = match (target.get(last), value) {
        (Some(toml::Value::Float(_)), toml::Value::Integer(whole)) => toml::Value::Float(whole as f64),
        (_, value) => value,
    };
    target.insert(last.to_string(), value);
    Ok(())
}

/// Removes the table `last` of `target`. An effect that the scene does not name is off already; any other missing table
/// is a mistake that nothing would notice later.
fn remove_table(target: &mut toml::Table, last: &str, key: &str) -> Result<(), String> {
    match target.get(last) {
        Some(toml::Value::Table(_)) => {
            target.remove(last);
            Ok(())
        }
        None if key.strip_prefix("effects.").is_some_and(|name| EffectsSpec::NAMES.contains(&name)) => Ok(()),
        Some(_) => Err("`false` removes a table, and this key is a value".to_string()),
        None => {
            let effects = EffectsSpec::NAMES.map(|name| format!("effects.{name}")).join(", ");
            Err(format!(
                "`false` removes a table, and there is none; allowed besides the scene's own are {effects}"
            ))
        }
    }
}

fn syntax_error(file: &str, error: &toml::de::Error) -> InputError {
    let text = error.to_string();
    let text = text.trim().replace('\n', " ");
    InputError::new(file, "scene", "not a valid scene", text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::particles::Kind;

    const TEXT: &str = r#"
        schema = 1
        name = "test"
        description = "a lattice of eight and whatever a test adds"
        particle_distance_m = 0.5
        time_step_s = 0.001
        end_time_s = 0.001
        fluid = { density_kg_m3 = 1000.0 }
        radii = { number_density = 2.1, gradient = 2.1, laplacian = 3.1 }
        domain = { margin_m = 0.1, headroom_m = 0.0 }
        effects.viscosity = { kinematic_viscosity_m2_s = 1e-6 }
        effects.collision = { distance = 0.5, restitution = 0.2 }
        geometry.lattice = { extent_m = [1.0, 1.0, 1.0], layers = 0 }
    "#;
    const REGION: &str = r#"
        [[geometry.region]]
        fill = "wall"
        from_m = [0.0, 0.0, 0.0]
        to_m = [1.0, 1.0, 1.0]
    "#;

    fn parse(more: &str, sets: &[&str]) -> Result<Scene, InputError> {
        let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
        Scene::parse(&format!("{TEXT}{more}"), "test.toml", &sets)
    }

    fn refused(more: &str, sets: &[&str], words: &[&str]) {
        let text = parse(more, sets).unwrap_err().to_string();
        for word in words.iter().chain(&["test.toml"]) {
            assert!(text.contains(word), "{sets:?} does not say `{word}`: {text}");
        }
    }

    fn particle(kind: &str, position: &str, velocity: &str) -> String {
        format!(
            "[[geometry.particle]]\nkind = \"{kind}\"\nposition_m = {position}\nvelocity_m_s = {velocity}\n"
        )
    }

    #[test]
    fn single_particles_follow_those_of_the_lattice_in_the_order_of_the_file() {
        let thrown = particle("fluid", "[0.1, 0.2, 0.3]", "[1.0, 2.0, 3.0]");
        let still = "[[geometry.particle]]\nkind = \"dummy_wall\"\nposition_m = [5.0, 0.0, -2.0]\n";
        let scene = parse(&format!("{REGION}{thrown}{still}"), &[]).unwrap();
        let particles = scene.particles("test.toml").unwrap();
        assert_eq!(particles.len(), 8 + 2);
        assert!(particles[..8].iter().all(|p| p.kind == Kind::Wall));
        let expected = InitialParticle {
            velocity: [1.0, 2.0, 3.0],
            ..InitialParticle::at_rest(Kind::Fluid, [0.1, 0.2, 0.3])
        };
        assert_eq!(particles[8], expected);
        assert_eq!(particles[9], InitialParticle::at_rest(Kind::DummyWall, [5.0, 0.0, -2.0]));
        let domain = scene.parameters(&particles).domain;
        assert_eq!((domain.low[2], domain.high[0]), (-2.1, 5.1), "the domain holds single particles too");
        let side = 3.1 * 0.5;
        let needed = (0..3).map(|d| ((domain.high[d] - domain.low[d]) / side).floor() + 3.0).product::<f64>();
        assert!(scene.buckets() >= needed, "the estimate of the memory counts the buckets up to them");
    }

    #[test]
    fn a_scene_may_consist_of_single_particles_but_not_of_nothing() {
        let scene = parse(&particle("fluid", "[0, 0, 0]", "[0, 0, 0]"), &[]).unwrap();
        assert_eq!(scene.particles("test.toml").unwrap().len(), 1);
        let error = parse("", &[]).unwrap().particles("test.toml").unwrap_err().to_string();
        assert!(error.contains("`geometry` is empty") && error.contains("a particle"), "{error}");
    }

    #[test]
    fn impossible_single_particles_are_refused() {
        let nowhere = particle("fluid", "[0.0, nan, 0.0]", "[0, 0, 0]");
        refused(&nowhere, &[], &["geometry.particle[0].position_m", "NaN", "finite"]);
        let too_fast = particle("fluid", "[0.0, 0.0, 0.0]", "[0, inf, 0]");
        refused(&too_fast, &[], &["geometry.particle[0].velocity_m_s", "inf", "finite"]);
        let moving_wall = particle("wall", "[0.0, 0.0, 0.0]", "[0, 1, 0]");
        refused(&moving_wall, &[], &["geometry.particle[0].velocity_m_s", "only fluid"]);
        refused(&particle("ghost", "[0, 0, 0]", "[0, 0, 0]"), &[], &["ghost", "dummy_wall"]);
    }

    #[test]
    fn false_switches_an_effect_off() {
        let scene = parse(REGION, &["effects.viscosity=false", "effects.pressure=false"]).unwrap();
        assert_eq!((scene.effects.viscosity, scene.effects.pressure), (None, None));
        assert!(scene.effects.collision.is_some());
        let last =
            ["effects.collision=false", "effects.collision.distance=0.4", "effects.collision.restitution=0"];
        let collision = parse(REGION, &last).unwrap().effects.collision.unwrap();
        assert_eq!((collision.distance, collision.restitution), (0.4, 0.0), "a later change counts");
    }

    #[test]
    fn false_for_what_is_no_table_is_refused() {
        refused(REGION, &["effects.viscosty=false"], &["--set", "viscosty=false", "effects.viscosity"]);
        refused(REGION, &["time_step_s=false"], &["--set", "time_step_s=false", "is a value"]);
        refused(REGION, &["fluid=false"], &["missing field", "fluid"]);
    }

    #[test]
    fn a_kernel_floor_is_optional_and_at_most_a_particle_distance() {
        let pressure = "[effects.pressure]\nsurface_threshold = 0.97\nsource_relaxation = 0.2\n\
                        compressibility_1_pa = 0.45e-9\n";
        let floor = |sets: &[&str]| {
            let scene = parse(&format!("{REGION}{pressure}"), sets).unwrap();
            scene.effects.to_engine().pressure.unwrap().kernel_floor
        };
        assert_eq!((floor(&[]), floor(&["effects.pressure.kernel_floor=1"])), (None, Some(1.0)));
        for wrong in ["0", "-0.5", "1.01", "nan"] {
            let set = format!("effects.pressure.kernel_floor={wrong}");
            refused(
                &format!("{REGION}{pressure}"),
                &[&set],
                &["effects.pressure.kernel_floor", "above 0 up to 1"],
            );
        }
    }

    #[test]
    fn impossible_wall_contacts_are_refused() {
        let set = |height: &str, reach: &str| {
            [format!("effects.wall_contact.height={height}"), format!("effects.wall_contact.reach={reach}")]
        };
        let contact = |[height, reach]: [String; 2]| parse(REGION, &[&height, &reach]);
        assert!(contact(set("0.7", "0.75")).unwrap().effects.to_engine().wall_contact.is_some());
        for (sets, key) in
            [(set("0", "0.75"), "height"), (set("0.7", "1.5"), "reach"), (set("nan", "1"), "height")]
        {
            let text = contact(sets).unwrap_err().to_string();
            assert!(
                text.contains(&format!("effects.wall_contact.{key}")) && text.contains("0 and 1.5"),
                "{text}"
            );
        }
    }

    /// `NAMES` repeats what serde knows.
    #[test]
    fn every_effect_can_be_switched_off() {
        let error = toml::from_str::<EffectsSpec>("unheard_of = 1").unwrap_err().to_string();
        let known: Vec<String> = error.split('`').skip(1).step_by(2).map(String::from).collect();
        assert_eq!(
            known.iter().filter(|name| EffectsSpec::NAMES.contains(&name.as_str())).count(),
            known.len() - 1
        );
    }
}
