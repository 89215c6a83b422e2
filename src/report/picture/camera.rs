//! Where a point of the scene lies in the picture: an orthographic projection.

use crate::base::vec3::{Vec3, dot};
use crate::report::picture::{HEIGHT, WIDTH};

/// Room around the particles for title, time stamp, colour bar and scale, pixels.
const LEFT: f64 = 48.0;
const RIGHT: f64 = 170.0;
const TOP: f64 = 76.0;
const BOTTOM: f64 = 64.0;

/// Where one looks from in space: to the right of straight ahead, and from above; radians.
const AZIMUTH: f64 = 0.42;
const ELEVATION: f64 = 0.38;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    pub pixels_per_m: f64,
    /// Unit vectors to the right, upwards and towards the viewer.
    axes: [Vec3; 3],
    /// What lies in the middle, along the first two axes, metres.
    middle: [f64; 2],
}

impl Camera {
    /// Frames the points with half a distance around them: face-on in the plane, otherwise obliquely.
    pub fn framing(points: &[Vec3], particle_distance_m: f64, planar: bool) -> Camera {
        let (azimuth, elevation) = if planar { (0.0, 0.0) } else { (AZIMUTH, ELEVATION) };
        let axes = axes(azimuth, elevation);
        let reach = |axis: Vec3| {
            let along = || points.iter().map(|&point| dot(point, axis));
            let low = along().reduce(f64::min).unwrap_or(0.0) - particle_distance_m / 2.0;
            let high = along().reduce(f64::max).unwrap_or(0.0) + particle_distance_m / 2.0;
            (low, high)
        };
        let (right, up) = (reach(axes[0]), reach(axes[1]));
        let across = (WIDTH as f64 - LEFT - RIGHT) / (right.1 - right.0);
        let upwards = (HEIGHT as f64 - TOP - BOTTOM) / (up.1 - up.0);
        // A particle alone would fill the picture.
        let pixels_per_m = across.min(upwards).min(60.0 / particle_distance_m);
        Camera { pixels_per_m, axes, middle: [f64::midpoint(right.0, right.1), f64::midpoint(up.0, up.1)] }
    }

    /// Pixels from the left and from the top, and pixels towards the viewer.
    pub fn project(&self, point: Vec3) -> Vec3 {
        let [right, up, towards] = self.axes.map(|axis| dot(point, axis));
        let center = [(WIDTH as f64 + LEFT - RIGHT) / 2.0, (HEIGHT as f64 + TOP - BOTTOM) / 2.0];
        [
            center[0] + (right - self.middle[0]) * self.pixels_per_m,
            center[1] - (up - self.middle[1]) * self.pixels_per_m,
            towards * self.pixels_per_m,
        ]
    }
}

/// x points to the right, y upwards, z to the viewer; then the viewer walks to the right and up.
fn axes(azimuth: f64, elevation: f64) -> [Vec3; 3] {
    let ((sin_a, cos_a), (sin_e, cos_e)) = (azimuth.sin_cos(), elevation.sin_cos());
    [[cos_a, 0.0, -sin_a], [-sin_a * sin_e, cos_e, -cos_a * sin_e], [sin_a * cos_e, sin_e, cos_a * cos_e]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axes_are_orthonormal_and_right_handed() {
        let [right, up, towards] = axes(AZIMUTH, ELEVATION);
        for (a, b, expected) in [(right, right, 1.0), (up, up, 1.0), (right, up, 0.0), (up, towards, 0.0)] {
            assert!((dot(a, b) - expected).abs() < 1e-15);
        }
        let cross = [
            right[1] * up[2] - right[2] * up[1],
            right[2] * up[0] - right[0] * up[2],
            right[0] * up[1] - right[1] * up[0],
        ];
        assert!((dot(cross, towards) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn the_frame_holds_all_points() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.6, 0.3], [-0.1, 0.2, 0.4]];
        for planar in [false, true] {
            let camera = Camera::framing(&points, 0.01, planar);
            for point in points {
                let [x, y, _] = camera.project(point);
                assert!((LEFT..=WIDTH as f64 - RIGHT).contains(&x), "{x}");
                assert!((TOP..=HEIGHT as f64 - BOTTOM).contains(&y), "{y}");
            }
        }
    }
}
