//! Rotations in space as unit quaternions; in a plane the axis is z.

use crate::base::vec3::{Vec3, add, add_scaled, cross, dot, scale};

/// A rotation: `w = cos(angle / 2)`, `v = sin(angle / 2) axis`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rotation {
    pub w: f64,
    pub v: Vec3,
}

impl Rotation {
    pub const NONE: Rotation = Rotation { w: 1.0, v: [0.0; 3] };

    /// By an angle about a unit vector, right-handed.
    pub fn about(axis: Vec3, angle_rad: f64) -> Self {
        let (sin, cos) = (0.5 * angle_rad).sin_cos();
        Rotation { w: cos, v: scale(sin, axis) }
    }

    /// By the vector `angle axis`.
    pub fn by(vector_rad: Vec3) -> Self {
        let angle = dot(vector_rad, vector_rad).sqrt();
        if angle == 0.0 { Rotation::NONE } else { Rotation::about(scale(1.0 / angle, vector_rad), angle) }
    }

    /// A vector, turned: `x + 2 w (v x x) + 2 v x (v x x)`, which is `x` itself to the last bit where nothing turns.
    pub fn turn(self, x: Vec3) -> Vec3 {
        let t = scale(2.0, cross(self.v, x));
        add(add_scaled(x, self.w, t), cross(self.v, t))
    }

    /// The rotation that undoes this one.
    pub fn inverse(self) -> Self {
        Rotation { w: self.w, v: scale(-1.0, self.v) }
    }

    /// First `first`, then this one; brought back to unit length, so that long chains keep lengths.
    pub fn after(self, first: Rotation) -> Self {
        let w = self.w * first.w - dot(self.v, first.v);
        let v = add(add(scale(self.w, first.v), scale(first.w, self.v)), cross(self.v, first.v));
        let norm = (w * w + dot(v, v)).sqrt();
        Rotation { w: w / norm, v: scale(1.0 / norm, v) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: Vec3, b: Vec3) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-15), "{a:?} {b:?}");
    }

    #[test]
    fn quarter_turns_are_right_handed_and_come_one_after_another() {
        let quarter = std::f64::consts::FRAC_PI_2;
        let about_z = Rotation::about([0.0, 0.0, 1.0], quarter);
        near(about_z.turn([1.0, 0.0, 5.0]), [0.0, 1.0, 5.0]);
        near(about_z.inverse().turn(about_z.turn([1.0, 2.0, 3.0])), [1.0, 2.0, 3.0]);
        let about_x = Rotation::by([quarter, 0.0, 0.0]);
        near(about_x.after(about_z).turn([1.0, 0.0, 0.0]), [0.0, 0.0, 1.0]);
        assert_eq!(Rotation::by([0.0; 3]).turn([0.1, 0.2, 0.3]), [0.1, 0.2, 0.3]);
    }
}
