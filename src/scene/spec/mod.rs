//! A scene file: its keys, their checks, and the engine's parameters that follow from it.

mod change;
pub mod effects;
pub mod fluid;
mod groups;
mod memory;
mod sense;

use serde::Deserialize;

use crate::base::input::{Check, InputError};
use crate::engine::kernel::Dimensions;
use crate::engine::parameters::{self, AdaptiveTimeStep, Domain, Parameters};
use crate::engine::particles::{InitialParticle, Kind};
use crate::scene::geometry::{Geometry, Hydrostatics, Placement};
use crate::scene::probe::{self, spec::ProbeSpec};
use effects::EffectsSpec;
use effects::wall_motion::MotionSpec;
use fluid::Fluid;
pub use groups::GroupSpec;
pub use memory::{BYTES_PER_BUCKET, BYTES_PER_PARTICLE};

/// The version of the scene format.
pub const SCHEMA: u32 = 1;
/// The most steps a simulation may take.
pub const MAX_STEPS: usize = 100_000_000;
/// A scene as its file describes it. Lengths, times and so on are SI; radii are in particle distances.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// The version of the format.
    pub schema: u32,
    pub name: String,
    /// What the scene shows, in a sentence.
    pub description: String,
    /// 2 for a plane, z = 0, where masses and forces are those of a metre of depth; 3 for space.
    #[serde(default = "three")]
    pub dimensions: u32,
    pub particle_distance_m: f64,
    /// Of every step or, with `adaptive_time_step`, of the longest one.
    pub time_step_s: f64,
    pub end_time_s: f64,
    pub adaptive_time_step: Option<AdaptiveSpec>,
    pub fluid: Fluid,
    pub radii: Radii,
    pub domain: DomainMargins,
    pub effects: EffectsSpec,
    /// Properties of the particles of regions that name a group.
    #[serde(default)]
    pub group: Vec<GroupSpec>,
    pub geometry: Geometry,
    /// What is looked at while the scene is simulated.
    #[serde(default)]
    pub probe: Vec<ProbeSpec>,
}

fn three() -> u32 {
    3
}

/// Steps that follow the flow.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct AdaptiveSpec {
    /// The share of a particle distance that the fastest particle may move in a step.
    pub courant: f64,
    /// The share of the longest stable step that effects may use.
    #[serde(default = "half")]
    pub safety: f64,
    /// By how much a step may be longer than the one before.
    #[serde(default = "a_fifth_more")]
    pub growth: f64,
    /// A simulation that would need a shorter step ends with an error.
    pub shortest_s: f64,
}

fn half() -> f64 {
    0.5
}

fn a_fifth_more() -> f64 {
    1.2
}

/// Influence radii in particle distances.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Radii {
    pub number_density: f64,
    pub gradient: f64,
    pub laplacian: f64,
}

/// How far the bucket domain reaches beyond the initial particles.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct DomainMargins {
    /// On all sides, metres.
    pub margin_m: f64,
    /// Upwards (+y) in addition, metres.
    pub headroom_m: f64,
    /// The axes along which the scene repeats itself after the lattice's extent.
    #[serde(default)]
    pub periodic: Vec<Axis>,
}

/// An axis by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    X,
    Y,
    Z,
}

impl Scene {
    /// Reads and checks a scene. `file` names it in errors; `sets` are changes `dotted.key=value` to its keys.
    pub fn parse(text: &str, file: &str, sets: &[String]) -> Result<Scene, InputError> {
        let mut table: toml::Table = toml::from_str(text).map_err(|error| syntax_error(file, &error))?;
        for set in sets {
            change::apply(&mut table, set, file)?;
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
        let allowed = "allowed are 2 and 3";
        check.require(matches!(self.dimensions, 2 | 3), "dimensions", self.dimensions, allowed)?;
        if let Some(adaptive) = &self.adaptive_time_step {
            adaptive.check(check, self.time_step_s)?;
        }
        let steps = self.end_time_s / self.time_step_s;
        let allowed = format!("`time_step_s` may divide it into at most {MAX_STEPS} steps");
        check.require(steps <= MAX_STEPS as f64, "end_time_s", self.end_time_s, allowed)?;
        self.fluid.check(check)?;
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
        self.effects.check(check, self)?;
        self.check_groups(check)?;
        self.check_motions(check)?;
        self.check_bodies(check)?;
        if let Some(boundaries) = &self.effects.flow_boundaries {
            let (groups, l0) = (self.group_names(), self.particle_distance_m);
            boundaries.check_beside(check, &groups, l0, self.engine_dimensions())?;
        }
        probe::spec::check(&self.probe, check)?;
        self.geometry.check(check, &self.placement(file))?;
        self.check_sense(check)
    }

    /// The files that the scene names, as it names them: STL files, and tables of motions.
    pub fn files(&self) -> Vec<String> {
        let solids = self.geometry.region.iter().filter_map(|region| region.stl.as_ref());
        let solids = solids.map(|stl| stl.file.clone());
        let frames = self.effects.frame.iter().filter_map(|frame| frame.acceleration_table.as_ref());
        let motions = self.group.iter().filter_map(|group| match &group.motion {
            Some(MotionSpec::Table(table)) => Some(&table.file),
            _ => None,
        });
        solids.chain(frames.chain(motions).map(|table| table.file().to_string())).collect()
    }

    /// The number of time steps up to the end time.
    pub fn steps(&self) -> usize {
        (self.end_time_s / self.time_step_s - 1e-9).ceil().max(0.0) as usize
    }

    /// Whether a simulation of the scene has come to its end. The number of steps decides where all are equally long.
    pub fn is_over(&self, steps_done: usize, time_s: f64) -> bool {
        match self.adaptive_time_step {
            None => steps_done >= self.steps(),
            Some(_) => time_s >= self.end_time_s || steps_done >= MAX_STEPS,
        }
    }

    fn engine_dimensions(&self) -> Dimensions {
        if self.dimensions == 2 { Dimensions::Two } else { Dimensions::Three }
    }

    /// Along which axes the scene repeats itself.
    pub fn periodic(&self) -> [bool; 3] {
        [Axis::X, Axis::Y, Axis::Z].map(|axis| self.domain.periodic.contains(&axis))
    }

    /// How many particles wait to be let in.
    fn reserve(&self) -> usize {
        self.effects.flow_boundaries.as_ref().map_or(0, |boundaries| boundaries.reserve)
    }

    /// What decides where particles lie besides `geometry`.
    fn placement<'a>(&self, file: &'a str) -> Placement<'a> {
        let hydrostatics = self.effects.gravity.as_ref().map(|gravity| Hydrostatics {
            density_kg_m3: self.fluid.density_kg_m3,
            gravity_m_s2: gravity.acceleration_m_s2,
        });
        Placement {
            dimensions: self.dimensions as usize,
            periodic: self.periodic(),
            hydrostatics,
            moves_without_fluid: self.effects.rigid_bodies.is_some()
                || self.effects.flow_boundaries.is_some(),
            ..Placement::new(file, self.particle_distance_m)
        }
    }

    /// The particles at the start, in the order of their identities.
    pub fn particles(&self, file: &str) -> Result<Vec<InitialParticle>, InputError> {
        let mut particles = self.geometry.fill(&self.placement(file))?;
        self.set_carried(&mut particles);
        // Ghosts wait inside the domain; one outside would count as a particle that left.
        if let Some(first) = particles.first() {
            let waiting = InitialParticle::at_rest(Kind::Ghost, first.position);
            particles.resize(particles.len() + self.reserve(), waiting);
        }
        Ok(particles)
    }

    /// What the engine needs to know. The bucket domain follows from where the scene's own particles start.
    pub fn parameters(&self, initial: &[InitialParticle]) -> Parameters {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let inflows = self.effects.flow_boundaries.as_ref();
        let layers = inflows.map_or(Vec::new(), |inflows| inflows.bounds(self.particle_distance_m));
        for position in initial.iter().map(|particle| particle.position).chain(layers) {
            for d in 0..3 {
                low[d] = low[d].min(position[d] - self.domain.margin_m);
                high[d] = high[d].max(position[d] + self.domain.margin_m);
            }
        }
        high[1] += self.domain.headroom_m;
        for (d, period) in self.geometry.periods(&self.placement("")).into_iter().enumerate() {
            (low[d], high[d]) = period.unwrap_or((low[d], high[d]));
        }
        if self.dimensions == 2 {
            (low[2], high[2]) = (0.0, 0.0);
        }
        Parameters {
            dimensions: self.engine_dimensions(),
            particle_distance_m: self.particle_distance_m,
            time_step_s: self.time_step_s,
            adaptive: self.adaptive_time_step.as_ref().map(AdaptiveSpec::to_engine),
            density_kg_m3: self.fluid.density_kg_m3,
            radii: parameters::Radii {
                number_density: self.radii.number_density,
                gradient: self.radii.gradient,
                laplacian: self.radii.laplacian,
            },
            domain: Domain { low, high, periodic: self.periodic() },
            groups: self.group_names(),
            effects: self.effects.to_engine(self),
        }
    }
}

impl AdaptiveSpec {
    fn check(&self, check: Check<'_>, longest_s: f64) -> Result<(), InputError> {
        let allowed = "allowed are numbers above 0 up to 1";
        for (name, value) in [("courant", self.courant), ("safety", self.safety)] {
            let key = format!("adaptive_time_step.{name}");
            check.require(value > 0.0 && value <= 1.0, &key, value, allowed)?;
        }
        let (key, allowed) = ("adaptive_time_step.growth", "allowed are numbers above 1 up to 2");
        check.require(self.growth > 1.0 && self.growth <= 2.0, key, self.growth, allowed)?;
        check.positive("adaptive_time_step.shortest_s", self.shortest_s)?;
        let allowed = format!("allowed are steps below `time_step_s`, the longest, which is {longest_s}");
        check.require(self.shortest_s < longest_s, "adaptive_time_step.shortest_s", self.shortest_s, allowed)
    }

    fn to_engine(&self) -> AdaptiveTimeStep {
        let AdaptiveSpec { courant, safety, growth, shortest_s } = *self;
        AdaptiveTimeStep { courant, safety, growth, shortest_s }
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
            scene.effects.to_engine(&scene).pressure.unwrap().kernel_floor
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
        let drop = particle("fluid", "[0.5, 2.0, 0.5]", "[0, 0, 0]");
        let scene = format!("{REGION}{drop}");
        let contact = |[height, reach]: [String; 2]| parse(&scene, &[&height, &reach]);
        let scene = contact(set("0.7", "0.75")).unwrap();
        assert!(scene.parameters(&scene.particles("test.toml").unwrap()).effects.wall_contact.is_some());
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
}
