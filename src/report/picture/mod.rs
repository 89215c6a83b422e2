//! A picture of the particles at one moment, so that a scene can be looked at while it is made.
//!
//! The fluid is opaque and coloured by a field, walls are grey and let the fluid through. Everything is computed pixel by
//! pixel in a fixed order, and the embedded font is the only one, so the same particles give the same bytes.

mod camera;
mod canvas;
mod color;
mod labels;
mod range;

use anyhow::{Context, Result};

use crate::base::input::InputError;
use crate::base::vec3::Vec3;
use crate::engine::particles::{InitialParticle, Kind, Particles};
use crate::scene::output::Moment;
use crate::scene::output::field::{Field, Values, fields};
use camera::Camera;
use canvas::{Ball, Canvas};
use labels::Labels;
pub use range::Range;

/// Size of a picture, pixels.
pub const WIDTH: usize = 1280;
pub const HEIGHT: usize = 720;

/// The file's name for a step.
pub fn file_name(step: usize) -> String {
    format!("frame-{step:06}.png")
}

/// Whether all particles lie in one plane `z = const`.
fn is_planar(initial: &[InitialParticle], particle_distance_m: f64) -> bool {
    let near = |particle: &InitialParticle| {
        (particle.position[2] - initial[0].position[2]).abs() < 0.5 * particle_distance_m
    };
    initial.iter().all(near)
}

/// What all pictures of a simulation have in common.
#[derive(Debug)]
pub struct Painter {
    title: String,
    camera: Camera,
    planar: bool,
    particle_distance_m: f64,
    color: String,
    /// The values at the ends of the colours where they are fixed; otherwise each picture finds its own.
    range: Option<Range>,
}

impl Painter {
    /// Pictures that frame the initial particles and stay there. `color` names a field.
    pub fn new(
        title: &str,
        initial: &[InitialParticle],
        particle_distance_m: f64,
        color: &str,
        range: Option<Range>,
    ) -> Painter {
        let planar = is_planar(initial, particle_distance_m);
        let shown = initial.iter().filter(|particle| particle.kind != Kind::Ghost);
        let positions: Vec<Vec3> = shown.map(|particle| particle.position).collect();
        Painter {
            title: title.to_string(),
            camera: Camera::framing(&positions, particle_distance_m, planar),
            planar,
            particle_distance_m,
            color: color.to_string(),
            range,
        }
    }

    /// Refuses a field that the scene does not have, before there is anything to paint.
    pub fn check(&self, particles: &Particles) -> Result<(), InputError> {
        self.field(particles).map(|_| ())
    }

    /// The picture as PNG.
    ///
    /// # Errors
    ///
    /// If the scene lacks the field, or the picture cannot be encoded.
    pub fn paint(&self, moment: &Moment<'_>) -> Result<Vec<u8>> {
        let particles = moment.particles;
        let field = self.field(particles)?;
        let fluid: Vec<usize> = (0..particles.len()).filter(|&i| particles.kind[i] == Kind::Fluid).collect();
        let values: Vec<f64> = fluid.iter().map(|&i| field.values.magnitude(i)).collect();
        let range = self.range.unwrap_or_else(|| Range::of(&values));
        let mut canvas = Canvas::new();
        let radius = 0.5 * self.particle_distance_m * self.camera.pixels_per_m;
        for i in (0..particles.len()).filter(|&i| self.shows_wall(particles.kind[i])) {
            let [x, y, depth] = self.camera.project(particles.position[i]);
            canvas.wall(&Ball { x, y, depth, radius }, particles.kind[i] == Kind::DummyWall);
        }
        for (&i, &value) in fluid.iter().zip(&values) {
            let [x, y, depth] = self.camera.project(particles.position[i]);
            canvas.fluid(&Ball { x, y, depth, radius }, color::viridis(range.share(value)));
        }
        let bodies = (0..particles.len()).filter(|&i| particles.kind[i] == Kind::Body);
        for i in bodies {
            let [x, y, depth] = self.camera.project(particles.position[i]);
            canvas.fluid(&Ball { x, y, depth, radius }, color::BODY);
        }
        let image = if self.planar { canvas.flat() } else { canvas.solid() };
        let mut image = image.context("the picture would be empty")?;
        let labels = Labels {
            title: &self.title,
            moment,
            field: &field,
            range: &range,
            values: &values,
            pixels_per_m: self.camera.pixels_per_m,
        };
        labels.draw(&mut image)?;
        image.encode_png().context("the picture cannot be written as PNG")
    }

    /// Dummy walls only thicken the walls; in the plane they hide nothing.
    fn shows_wall(&self, kind: Kind) -> bool {
        kind == Kind::Wall || self.planar && kind == Kind::DummyWall
    }

    /// The field to colour by; `speed` is another name of the velocity, whose magnitude is shown.
    fn field<'a>(&self, particles: &'a Particles) -> Result<Field<'a>, InputError> {
        let shown: Vec<Field<'_>> = fields(particles)
            .into_iter()
            .filter(|field| !matches!(field.values, Values::Kinds(_)))
            .map(|field| Field { name: if field.name == "velocity" { "speed" } else { field.name }, ..field })
            .collect();
        let wanted = if self.color == "velocity" { "speed" } else { &self.color };
        let names: Vec<&str> = shown.iter().map(|field| field.name).collect();
        shown.iter().find(|field| field.name == wanted).copied().ok_or_else(|| {
            let allowed = format!("this scene's particles have {}", names.join(", "));
            InputError::new("command line", "--color", format!("`{}`", self.color), allowed)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of fluid in a corner of walls, or its middle layer alone.
    fn corner(planar: bool) -> Vec<InitialParticle> {
        let mut initial = Vec::new();
        for k in 0..1000 {
            let site = [k / 100, k / 10 % 10, k % 10];
            if planar && site[2] != 5 {
                continue;
            }
            let kind = if site.into_iter().take(2).min() < Some(2) { Kind::Wall } else { Kind::Fluid };
            initial.push(InitialParticle::at_rest(kind, site.map(|i| 0.1 * f64::from(i))));
        }
        initial
    }

    fn particles(initial: &[InitialParticle]) -> Particles {
        Particles {
            kind: initial.iter().map(|p| p.kind).collect(),
            position: initial.iter().map(|p| p.position).collect(),
            velocity: initial.iter().map(|p| p.position).collect(),
            ..Particles::default()
        }
    }

    #[test]
    fn the_same_particles_give_the_same_picture_of_the_promised_size() {
        for planar in [false, true] {
            let initial = corner(planar);
            let particles = particles(&initial);
            let painter = Painter::new("corner", &initial, 0.1, "speed", None);
            let moment = Moment { step: 1, time_s: 0.1, particles: &particles };
            let png = painter.paint(&moment).unwrap();
            assert_eq!(png, painter.paint(&moment).unwrap());
            let image = resvg::tiny_skia::Pixmap::decode_png(&png).unwrap();
            assert_eq!((image.width(), image.height()), (WIDTH as u32, HEIGHT as u32));
            let colored = |p: &resvg::tiny_skia::PremultipliedColorU8| {
                p.red().abs_diff(p.green()).max(p.green().abs_diff(p.blue())) > 40
            };
            let share = image.pixels().iter().filter(|p| colored(p)).count() as f64 / (WIDTH * HEIGHT) as f64;
            assert!(share > 0.1, "the fluid fills a good part of the picture: {share}");
        }
    }

    #[test]
    fn a_field_that_the_scene_lacks_is_refused_with_those_it_has() {
        let initial = corner(false);
        let painter = Painter::new("corner", &initial, 0.1, "temperature", None);
        let error = painter.check(&particles(&initial)).unwrap_err().to_string();
        assert!(
            error.contains("--color") && error.contains("temperature") && error.contains("speed"),
            "{error}"
        );
    }

    #[test]
    fn nothing_to_see_is_no_error() {
        let initial = [InitialParticle::at_rest(Kind::Fluid, [1.0; 3])];
        let painter = Painter::new("one", &initial, 0.1, "velocity", None);
        let mut particles = particles(&initial);
        particles.kind[0] = Kind::Ghost;
        painter.paint(&Moment { step: 0, time_s: 0.0, particles: &particles }).unwrap();
    }
}
