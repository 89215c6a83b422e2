//! Shapes made ready to be asked which lattice points they hold.

use super::lattice::Axis;
use super::shape::{Cylinder, HalfSpace, Shape, Sphere, Stl};
use super::stl::{self, Columns};
use crate::base::input::InputError;
use crate::base::vec3::{Vec3, ZERO, add, add_scaled, dot, scale, sub};

/// What absorbs rounding where a curved or inclined surface passes through a lattice point, in particle distances.
const ROUNDING: f64 = 1e-6;
/// The same for plane ends, whose places files give with few digits.
const PLANE_ROUNDING: f64 = 0.01;

#[derive(Debug)]
enum Form {
    Box { low: Vec3, high: Vec3 },
    Sphere(Sphere),
    Cylinder { from: Vec3, axis: Vec3, length: f64, radius: f64 },
    HalfSpace { point: Vec3, normal: Vec3 },
    Surface(Columns),
}

/// A region's shape, or the shell around it, and its copies in the periods next to the scene's own.
#[derive(Debug)]
pub(super) struct Solid {
    form: Form,
    /// Thickness of the shell in metres, where the region is one.
    shell: Option<f64>,
    l0: f64,
    /// The displacements of the copies that reach the lattice; none of them if the shape is outside.
    copies: Vec<Vec3>,
}

impl Solid {
    /// `key` and `file` name the region and its scene in errors of the STL file.
    pub fn new(
        shape: Shape<'_>,
        layers_outside: Option<f64>,
        axes: &[Axis; 3],
        (file, key): (&str, &str),
    ) -> Result<Solid, InputError> {
        let l0 = axes[0].spacing;
        let shell = layers_outside.map(|layers| layers * l0);
        let form = match shape {
            Shape::Box { from, to, below, above } => Form::Box {
                low: [0, 1, 2].map(|d| from[d] - below[d] * l0),
                high: [0, 1, 2].map(|d| to[d] + above[d] * l0),
            },
            Shape::Sphere(sphere) => Form::Sphere(*sphere),
            Shape::Cylinder(cylinder) => bar(cylinder),
            Shape::HalfSpace(half) => plane(half),
            Shape::Stl(stl) => Form::Surface(surface(stl, l0, shell.unwrap_or(0.0), file, key)?),
        };
        let mut solid = Solid { form, shell, l0, copies: Vec::new() };
        solid.copies = solid.copies(axes);
        Ok(solid)
    }

    /// The box without its third dimension, for scenes in two.
    pub fn flattened(mut self) -> Solid {
        if let Form::Box { low, high } = &mut self.form {
            (low[2], high[2]) = (f64::NEG_INFINITY, f64::INFINITY);
        }
        self
    }

    /// Whether no copy of the shape reaches the lattice.
    pub fn is_outside(&self) -> bool {
        self.copies.is_empty()
    }

    /// Calls `hold` with the index of each of the ascending heights `z` at (x, y) that the region holds.
    pub fn look(&self, x: f64, y: f64, z: &[f64], hold: &mut impl FnMut(usize)) {
        let mut column = ColumnBuffer::default();
        for copy in &self.copies {
            let (x, y) = (x - copy[0], y - copy[1]);
            if let Form::Surface(columns) = &self.form {
                column.heights.clear();
                column.heights.extend(z.iter().map(|z| z - copy[2]));
                columns.look(x, y, &column.heights, self.shell.is_some(), &mut column.held);
                (0..z.len()).filter(|k| column.held[*k]).for_each(&mut *hold);
                continue;
            }
            for (k, z) in z.iter().enumerate() {
                if self.holds([x, y, z - copy[2]]) {
                    hold(k);
                }
            }
        }
    }

    fn holds(&self, point: Vec3) -> bool {
        let outside = match &self.form {
            Form::Box { low, high } => {
                // A lattice point on a face belongs to the box below it; a hundredth of `l0` absorbs rounding.
                let epsilon = PLANE_ROUNDING * self.l0;
                return (0..3).all(|d| point[d] > low[d] + epsilon && point[d] <= high[d] + epsilon);
            }
            Form::Sphere(sphere) => {
                let from_center = sub(point, sphere.center_m);
                dot(from_center, from_center).sqrt() - sphere.radius_m - ROUNDING * self.l0
            }
            Form::Cylinder { from, axis, length, radius } => {
                let from_end = sub(point, *from);
                let along = dot(from_end, *axis);
                let across = add_scaled(from_end, -along, *axis);
                let beyond_side = dot(across, across).sqrt() - radius - ROUNDING * self.l0;
                let along = along - PLANE_ROUNDING * self.l0;
                let beyond_end = (-along).max(along - length);
                let (side, end) = (beyond_side.max(0.0), beyond_end.max(0.0));
                (side * side + end * end).sqrt()
            }
            Form::HalfSpace { point: on, normal } => dot(sub(point, *on), *normal) - ROUNDING * self.l0,
            Form::Surface(_) => return false,
        };
        match self.shell {
            None => outside <= 0.0,
            Some(thickness) => outside > 0.0 && outside <= thickness,
        }
    }

    /// The corners of a box that holds all that the region could hold, with room for rounding.
    fn bounds(&self) -> (Vec3, Vec3) {
        let around = |center: Vec3, reach: f64| (center.map(|x| x - reach), center.map(|x| x + reach));
        let (low, high) = match &self.form {
            Form::Box { low, high } => (*low, *high),
            Form::Sphere(sphere) => around(sphere.center_m, sphere.radius_m),
            Form::Cylinder { from, axis, length, radius } => {
                let (a, b) = (around(*from, *radius), around(add_scaled(*from, *length, *axis), *radius));
                ([0, 1, 2].map(|d| a.0[d].min(b.0[d])), [0, 1, 2].map(|d| a.1[d].max(b.1[d])))
            }
            Form::HalfSpace { .. } => ([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]),
            Form::Surface(columns) => columns.bounds(),
        };
        let room = self.shell.unwrap_or(0.0) + 2.0 * PLANE_ROUNDING * self.l0;
        (low.map(|x| x - room), high.map(|x| x + room))
    }

    /// A shape that crosses the border of a period goes on at its other side. A half space has no border and no copies.
    fn copies(&self, axes: &[Axis; 3]) -> Vec<Vec3> {
        let (low, high) = self.bounds();
        let mut copies = vec![ZERO];
        if !matches!(self.form, Form::HalfSpace { .. }) {
            for (d, axis) in axes.iter().enumerate() {
                let Some(period) = axis.period else { continue };
                copies = [0.0, -period, period]
                    .iter()
                    .flat_map(|shift| copies.iter().map(|copy| add(*copy, along(d, *shift))))
                    .collect();
            }
        }
        copies.retain(|copy| {
            (0..3).all(|d| {
                let (first, last) = (axes[d].point(axes[d].first), axes[d].point(axes[d].last));
                low[d] + copy[d] <= last && high[d] + copy[d] >= first
            })
        });
        copies
    }
}

/// Reused from copy to copy.
#[derive(Default)]
struct ColumnBuffer {
    heights: Vec<f64>,
    held: Vec<bool>,
}

fn along(d: usize, length: f64) -> Vec3 {
    let mut vector = ZERO;
    vector[d] = length;
    vector
}

fn bar(cylinder: &Cylinder) -> Form {
    let axis = sub(cylinder.to_m, cylinder.from_m);
    let length = dot(axis, axis).sqrt();
    Form::Cylinder {
        from: cylinder.from_m,
        axis: scale(1.0 / length, axis),
        length,
        radius: cylinder.radius_m,
    }
}

fn plane(half: &HalfSpace) -> Form {
    let length = dot(half.normal, half.normal).sqrt();
    Form::HalfSpace { point: half.point_m, normal: scale(1.0 / length, half.normal) }
}

fn surface(spec: &Stl, l0: f64, reach: f64, file: &str, key: &str) -> Result<Columns, InputError> {
    let path = stl::beside(file, &spec.file);
    let mesh = stl::read(&path).map_err(|error| {
        let found = format!("`{}`, {error}", path.display());
        InputError::new(file, &format!("{key}.stl.file"), found, error.allowed())
    })?;
    Ok(Columns::new(mesh.placed(spec.scale, spec.translate_m), l0, reach))
}
