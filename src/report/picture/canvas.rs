//! Balls, drawn into a buffer of depths at twice the picture's resolution.

use resvg::tiny_skia::{Pixmap, PremultipliedColorU8};

use crate::report::picture::{HEIGHT, WIDTH};

/// Samples a pixel in each direction, so that edges are smooth.
const SAMPLES: usize = 2;
const COLUMNS: usize = WIDTH * SAMPLES;
const ROWS: usize = HEIGHT * SAMPLES;

/// Greys of walls: the farthest and the nearest of those behind, those in front, dummy walls.
const FAR: f32 = 232.0;
const NEAR: f32 = 188.0;
const FRONT: f32 = 140.0;
const DUMMY: f32 = 232.0;
/// How much of what lies behind a wall in front is lost.
const OPACITY: f32 = 0.14;

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

/// What is seen at each sample: the nearest wall and how far away the farthest is, the nearest fluid and its colour.
#[derive(Debug)]
pub struct Canvas {
    wall: Vec<Nearest>,
    farthest: Vec<f32>,
    dummy: Vec<bool>,
    fluid: Vec<Nearest>,
    color: Vec<[u8; 3]>,
}

impl Canvas {
    pub fn new() -> Canvas {
        Canvas {
            wall: vec![NOTHING; COLUMNS * ROWS],
            farthest: vec![f32::INFINITY; COLUMNS * ROWS],
            dummy: vec![false; COLUMNS * ROWS],
            fluid: vec![NOTHING; COLUMNS * ROWS],
            color: vec![[0; 3]; COLUMNS * ROWS],
        }
    }

    pub fn wall(&mut self, ball: &Ball, is_dummy: bool) {
        let Canvas { wall, farthest, dummy, .. } = self;
        samples(ball, |sample, seen| {
            if seen.depth > wall[sample].depth {
                (wall[sample], dummy[sample]) = (seen, is_dummy);
            }
            farthest[sample] = farthest[sample].min(seen.depth);
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

    /// The picture in the plane: flat discs.
    pub fn flat(self) -> Option<Pixmap> {
        picture(|sample| {
            if self.fluid[sample].depth > f32::NEG_INFINITY {
                return self.color[sample].map(f32::from);
            }
            let grey = if self.dummy[sample] { DUMMY } else { NEAR };
            [if self.wall[sample].depth > f32::NEG_INFINITY { grey } else { 255.0 }; 3]
        })
    }

    /// The picture in space: balls of fluid before the walls behind them, which are the darker the nearer they are, and
    /// behind a veil of those in front.
    pub fn solid(self) -> Option<Pixmap> {
        let reached = || self.farthest.iter().copied().filter(|depth| depth.is_finite());
        let (low, high) =
            (reached().fold(f32::INFINITY, f32::min), reached().fold(f32::NEG_INFINITY, f32::max));
        picture(|sample| {
            let (wall, fluid, farthest) = (self.wall[sample], self.fluid[sample], self.farthest[sample]);
            let mut seen = [255.0; 3];
            if fluid.depth > f32::NEG_INFINITY {
                seen = self.color[sample].map(|channel| f32::from(channel) * fluid.shade);
            } else if farthest.is_finite() {
                let nearness = (farthest - low) / (high - low).max(1.0);
                seen = [(FAR + (NEAR - FAR) * nearness) * (0.85 + 0.15 * wall.shade); 3];
            }
            if wall.depth > fluid.depth {
                // Flatter than fluid, or a large wall would be a grille.
                let grey = FRONT * (0.7 + 0.3 * wall.shade);
                seen = seen.map(|channel| channel + OPACITY * (grey - channel));
            }
            seen
        })
    }
}

/// A picture whose pixels are the means of their samples.
fn picture(seen: impl Fn(usize) -> [f32; 3]) -> Option<Pixmap> {
    let mut image = Pixmap::new(WIDTH as u32, HEIGHT as u32)?;
    for (place, pixel) in image.pixels_mut().iter_mut().enumerate() {
        let (row, column) = (place / WIDTH * SAMPLES, place % WIDTH * SAMPLES);
        let mut sum = [0.0_f32; 3];
        for k in 0..SAMPLES * SAMPLES {
            let sample = (row + k / SAMPLES) * COLUMNS + column + k % SAMPLES;
            for (sum, channel) in sum.iter_mut().zip(seen(sample)) {
                *sum += channel / (SAMPLES * SAMPLES) as f32;
            }
        }
        let [red, green, blue] = sum.map(|channel| channel.round() as u8);
        *pixel = PremultipliedColorU8::from_rgba(red, green, blue, 255)?;
    }
    Some(image)
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
