//! Balls, drawn into a buffer of depths at twice the picture's resolution.

use resvg::tiny_skia::{Pixmap, PremultipliedColorU8};

use crate::report::picture::{HEIGHT, WIDTH};

/// Samples a pixel in each direction, so that edges are smooth.
const SAMPLES: usize = 2;
const COLUMNS: usize = WIDTH * SAMPLES;
const ROWS: usize = HEIGHT * SAMPLES;

/// Grey of a wall that faces the viewer.
const WALL: f32 = 150.0;
/// How much of what lies behind a wall is lost: in front of the ground, and in front of fluid.
const WALL_OVER_GROUND: f32 = 0.42;
const WALL_OVER_FLUID: f32 = 0.13;

/// A ball in the picture, pixels.
#[derive(Debug, Clone, Copy)]
pub struct Ball {
    pub x: f64,
    pub y: f64,
    /// Towards the viewer.
    pub depth: f64,
    pub radius: f64,
}

/// The nearest of a kind of ball at a sample.
#[derive(Debug, Clone, Copy)]
struct Nearest {
    depth: f32,
    /// How much of the light comes back, 0 to 1.
    shade: f32,
}

const NOTHING: Nearest = Nearest { depth: f32::NEG_INFINITY, shade: 0.0 };

/// What is seen at each sample: the nearest wall, the nearest fluid and its colour.
#[derive(Debug)]
pub struct Canvas {
    wall: Vec<Nearest>,
    fluid: Vec<Nearest>,
    color: Vec<[u8; 3]>,
}

impl Canvas {
    pub fn new() -> Canvas {
        Canvas {
            wall: vec![NOTHING; COLUMNS * ROWS],
            fluid: vec![NOTHING; COLUMNS * ROWS],
            color: vec![[0; 3]; COLUMNS * ROWS],
        }
    }

    pub fn wall(&mut self, ball: &Ball) {
        let wall = &mut self.wall;
        samples(ball, |sample, seen| {
            if seen.depth > wall[sample].depth {
                wall[sample] = seen;
            }
        });
    }

    pub fn fluid(&mut self, ball: &Ball, color: [u8; 3]) {
        let (fluid, colors) = (&mut self.fluid, &mut self.color);
        samples(ball, |sample, seen| {
            if seen.depth > fluid[sample].depth {
                (fluid[sample], colors[sample]) = (seen, color);
            }
        });
    }

    /// The picture; `shaded` where balls are to look round.
    pub fn finish(self, shaded: bool) -> Option<Pixmap> {
        let mut image = Pixmap::new(WIDTH as u32, HEIGHT as u32)?;
        for (place, pixel) in image.pixels_mut().iter_mut().enumerate() {
            let (row, column) = (place / WIDTH * SAMPLES, place % WIDTH * SAMPLES);
            let mut sum = [0.0_f32; 3];
            for k in 0..SAMPLES * SAMPLES {
                let sample = (row + k / SAMPLES) * COLUMNS + column + k % SAMPLES;
                for (sum, channel) in sum.iter_mut().zip(self.seen(sample, shaded)) {
                    *sum += channel / (SAMPLES * SAMPLES) as f32;
                }
            }
            let [red, green, blue] = sum.map(|channel| channel.round() as u8);
            *pixel = PremultipliedColorU8::from_rgba(red, green, blue, 255)?;
        }
        Some(image)
    }

    fn seen(&self, sample: usize, shaded: bool) -> [f32; 3] {
        let (wall, fluid) = (self.wall[sample], self.fluid[sample]);
        let light = |nearest: Nearest| if shaded { nearest.shade } else { 1.0 };
        let mut seen = [255.0_f32; 3];
        if fluid.depth > f32::NEG_INFINITY {
            seen = self.color[sample].map(|channel| f32::from(channel) * light(fluid));
        }
        if wall.depth > fluid.depth {
            let share = if fluid.depth > f32::NEG_INFINITY { WALL_OVER_FLUID } else { WALL_OVER_GROUND };
            // Walls are flatter than fluid, or a large one would be a grille.
            let grey = WALL * (0.75 + 0.25 * light(wall));
            seen = seen.map(|channel| channel + share * (grey - channel));
        }
        seen
    }
}

/// Calls `draw` for each sample that a ball covers, with the depth of its surface there. The light comes from above, on the
/// left, and from behind the viewer.
fn samples(ball: &Ball, mut draw: impl FnMut(usize, Nearest)) {
    let scale = SAMPLES as f64;
    let (x, y) = ((ball.x * scale) as f32, (ball.y * scale) as f32);
    let radius = ((ball.radius * scale) as f32).max(1.0);
    let range = |middle: f32, end: usize| {
        let low = (middle - radius).floor().clamp(0.0, end as f32) as usize;
        let high = (middle + radius).ceil().clamp(0.0, end as f32) as usize;
        low..high
    };
    for row in range(y, ROWS) {
        for column in range(x, COLUMNS) {
            let (dx, dy) = ((column as f32 + 0.5 - x) / radius, (row as f32 + 0.5 - y) / radius);
            let beside = dx * dx + dy * dy;
            if beside <= 1.0 {
                let towards = (1.0 - beside).sqrt();
                let facing = (-0.35 * dx - 0.55 * dy + 0.76 * towards).max(0.0);
                let depth = (ball.depth * scale) as f32 + radius * towards;
                draw(row * COLUMNS + column, Nearest { depth, shade: 0.5 + 0.5 * facing });
            }
        }
    }
}
