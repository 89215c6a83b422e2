//! The columns of particles by name, unit and shape, so that a format or a picture needs to know none of them.

use crate::base::vec3::{Vec3, dot};
use crate::engine::particles::{Kind, Particles};

/// One column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field<'a> {
    pub name: &'static str,
    /// As people write it, such as `m/s`; empty for what has none.
    pub unit: &'static str,
    pub values: Values<'a>,
}

/// The entries of a column, one a particle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Values<'a> {
    Scalars(&'a [f64]),
    Vectors(&'a [Vec3]),
    Kinds(&'a [Kind]),
    /// Small numbers that name something, such as the group of a particle.
    Labels(&'a [u8]),
}

impl Values<'_> {
    pub fn len(&self) -> usize {
        match self {
            Values::Scalars(values) => values.len(),
            Values::Vectors(values) => values.len(),
            Values::Kinds(values) => values.len(),
            Values::Labels(values) => values.len(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One number for particle `i`: the value itself, the magnitude of a vector, the number of a kind.
    pub fn magnitude(&self, i: usize) -> f64 {
        match self {
            Values::Scalars(values) => values[i],
            Values::Vectors(values) => dot(values[i], values[i]).sqrt(),
            Values::Kinds(values) => f64::from(values[i] as u8),
            Values::Labels(values) => f64::from(values[i]),
        }
    }
}

impl Field<'_> {
    /// The name with its unit at the end, as columns of files are named: `velocity_m_s`.
    pub fn column(&self) -> String {
        match suffix(self.unit).as_str() {
            "" => self.name.to_string(),
            suffix => format!("{}_{suffix}", self.name),
        }
    }
}

/// A unit as the end of a name: letters, digits and `_` only; `m/s` gives `m_s`.
pub fn suffix(unit: &str) -> String {
    unit.to_lowercase()
        .chars()
        .map(|letter| if letter.is_ascii_alphanumeric() { letter } else { '_' })
        .collect()
}

/// All columns beside the positions that the scene has. A new column is one line here.
pub fn fields(particles: &Particles) -> Vec<Field<'_>> {
    let columns = [
        Field { name: "kind", unit: "", values: Values::Kinds(&particles.kind) },
        Field { name: "velocity", unit: "m/s", values: Values::Vectors(&particles.velocity) },
        Field { name: "pressure", unit: "Pa", values: Values::Scalars(&particles.pressure) },
        Field { name: "number_density", unit: "", values: Values::Scalars(&particles.number_density) },
        Field { name: "temperature", unit: "K", values: Values::Scalars(&particles.temperature) },
        Field { name: "concentration", unit: "", values: Values::Scalars(&particles.concentration) },
        Field { name: "group", unit: "", values: Values::Labels(&particles.group) },
    ];
    columns.into_iter().filter(|field| !field.values.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_that_a_scene_lacks_are_absent() {
        let mut particles = Particles {
            kind: vec![Kind::Fluid, Kind::Wall],
            position: vec![[0.0; 3]; 2],
            velocity: vec![[3.0, 0.0, 4.0], [0.0; 3]],
            ..Particles::default()
        };
        let names = |particles: &Particles| fields(particles).iter().map(Field::column).collect::<Vec<_>>();
        assert_eq!(names(&particles), ["kind", "velocity_m_s"]);
        assert_eq!(fields(&particles)[1].values.magnitude(0), 5.0);
        (particles.pressure, particles.number_density) = (vec![1.0; 2], vec![2.0; 2]);
        assert_eq!(names(&particles), ["kind", "velocity_m_s", "pressure_pa", "number_density"]);
    }

    #[test]
    fn units_end_names_as_words() {
        assert_eq!((suffix("kg/m3"), suffix("Pa"), suffix("")), ("kg_m3".into(), "pa".into(), String::new()));
    }
}
