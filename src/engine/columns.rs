//! All columns of a simulation by name: one walk for restarts, for steps that are taken back, and for counting bytes.

use crate::base::vec3::Vec3;
use crate::engine::particles::Kind;

/// A column, or a number, that the next step depends on.
#[derive(Debug)]
pub enum Column<'a> {
    Kinds(&'a mut Vec<Kind>),
    Groups(&'a mut Vec<u8>),
    Indices(&'a mut Vec<u32>),
    Scalars(&'a mut Vec<f64>),
    Vectors(&'a mut Vec<Vec3>),
    Number(&'a mut f64),
    Count(&'a mut usize),
}

/// Is shown one column after another, always in the same order.
pub type Visitor<'v> = dyn FnMut(&'static str, Column<'_>) + 'v;

/// A copy of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum Saved {
    Kinds(Vec<Kind>),
    Groups(Vec<u8>),
    Indices(Vec<u32>),
    Scalars(Vec<f64>),
    Vectors(Vec<Vec3>),
    Number(f64),
    Count(usize),
}

/// A state to go back to. The copies are made once and written over, so that keeping one allocates nothing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SavedState {
    columns: Vec<(&'static str, Saved)>,
}

impl Saved {
    /// A copy of `column`.
    pub fn of(column: &Column<'_>) -> Saved {
        match column {
            Column::Kinds(c) => Saved::Kinds(c.to_vec()),
            Column::Groups(c) => Saved::Groups(c.to_vec()),
            Column::Indices(c) => Saved::Indices(c.to_vec()),
            Column::Scalars(c) => Saved::Scalars(c.to_vec()),
            Column::Vectors(c) => Saved::Vectors(c.to_vec()),
            Column::Number(value) => Saved::Number(**value),
            Column::Count(value) => Saved::Count(**value),
        }
    }

    /// Writes `column` over this copy; tells whether it is of the same type.
    pub fn keep(&mut self, column: &Column<'_>) -> bool {
        match (self, column) {
            (Saved::Kinds(to), Column::Kinds(from)) => to.clone_from(from),
            (Saved::Groups(to), Column::Groups(from)) => to.clone_from(from),
            (Saved::Indices(to), Column::Indices(from)) => to.clone_from(from),
            (Saved::Scalars(to), Column::Scalars(from)) => to.clone_from(from),
            (Saved::Vectors(to), Column::Vectors(from)) => to.clone_from(from),
            (Saved::Number(to), Column::Number(from)) => *to = **from,
            (Saved::Count(to), Column::Count(from)) => *to = **from,
            _ => return false,
        }
        true
    }

    /// Writes this copy over `column`; tells whether it is of the same type.
    pub fn put_back(&self, column: Column<'_>) -> bool {
        match (self, column) {
            (Saved::Kinds(from), Column::Kinds(to)) => to.clone_from(from),
            (Saved::Groups(from), Column::Groups(to)) => to.clone_from(from),
            (Saved::Indices(from), Column::Indices(to)) => to.clone_from(from),
            (Saved::Scalars(from), Column::Scalars(to)) => to.clone_from(from),
            (Saved::Vectors(from), Column::Vectors(to)) => to.clone_from(from),
            (Saved::Number(from), Column::Number(to)) => *to = *from,
            (Saved::Count(from), Column::Count(to)) => *to = *from,
            _ => return false,
        }
        true
    }
}

impl SavedState {
    /// Keeps what `visit` shows.
    pub fn keep(&mut self, visit: impl FnOnce(&mut Visitor<'_>)) {
        let mut next = 0;
        visit(&mut |name, column| {
            match self.columns.get_mut(next) {
                Some((kept, saved)) => {
                    let same = *kept == name && saved.keep(&column);
                    assert!(same, "columns are shown in the same order every time");
                }
                None => self.columns.push((name, Saved::of(&column))),
            }
            next += 1;
        });
    }

    /// The kept column of vectors of that name; empty where there is none.
    pub fn vectors(&self, name: &str) -> &[Vec3] {
        let named = self.columns.iter().find(|(kept, _)| *kept == name);
        match named {
            Some((_, Saved::Vectors(column))) => column,
            _ => &[],
        }
    }

    /// Puts back what was kept.
    pub fn restore(&self, visit: impl FnOnce(&mut Visitor<'_>)) {
        let mut kept = self.columns.iter();
        visit(&mut |name, column| {
            let same = kept.next().is_some_and(|(saved, copy)| *saved == name && copy.put_back(column));
            assert!(same, "columns are shown in the same order every time");
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_comes_back() {
        let (mut scalars, mut count) = (vec![1.0, 2.0], 3);
        let mut saved = SavedState::default();
        for _ in 0..2 {
            saved.keep(|visitor| {
                visitor("scalars", Column::Scalars(&mut scalars));
                visitor("count", Column::Count(&mut count));
            });
        }
        (scalars[1], count) = (9.0, 4);
        saved.restore(|visitor| {
            visitor("scalars", Column::Scalars(&mut scalars));
            visitor("count", Column::Count(&mut count));
        });
        assert_eq!((scalars, count), (vec![1.0, 2.0], 3));
    }
}
