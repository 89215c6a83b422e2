//! What can be wrong with an STL file, and the way out.

use crate::base::vec3::Vec3;

/// The largest file that is read, bytes.
pub const MAX_BYTES: u64 = 1 << 30;
/// The most triangles a file may hold.
pub const MAX_TRIANGLES: usize = 10_000_000;

const REPAIR: &str = "repair the solid where it was made, or close and orient it with a mesh tool";

/// Why an STL file is no solid. Triangles count from 1 in the order of the file, corners are in its units.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StlError {
    #[error("which cannot be read ({why})")]
    Unreadable { why: String },
    #[error("which has {bytes} bytes")]
    TooLarge { bytes: u64 },
    #[error("whose header says {triangles} triangles")]
    TooManyTriangles { triangles: usize },
    #[error("which holds no triangle")]
    NoTriangles,
    #[error("which has {bytes} bytes where its header says {triangles} triangles, which take {needed}")]
    WrongSize { bytes: usize, triangles: usize, needed: usize },
    #[error("which has {bytes} bytes and does not begin with `solid`")]
    NoStl { bytes: usize },
    #[error("which ends before `{missing}`")]
    Unfinished { missing: &'static str },
    #[error("whose line {line} is `{found}` where {expected} is due")]
    Syntax { line: usize, found: String, expected: &'static str },
    #[error("whose triangle {triangle} has the corner {corner:?}")]
    NotFinite { triangle: usize, corner: Vec3 },
    #[error(
        "whose triangle {triangle} with the corners {corners:?} is thinner than {tolerance:e}, a millionth of the solid"
    )]
    Degenerate { triangle: usize, corners: [Vec3; 3], tolerance: f64 },
    #[error(
        "whose triangle {triangle} has no neighbour at its edge from {from:?} to {to:?}: there is a hole"
    )]
    Hole { triangle: usize, from: Vec3, to: Vec3 },
    #[error(
        "whose triangles {first} and {second} both run from {from:?} to {to:?}: one of them shows its other side"
    )]
    Flipped { first: usize, second: usize, from: Vec3, to: Vec3 },
    #[error("whose triangle {triangle} shares its edge from {from:?} to {to:?} with {others} others")]
    Crowded { triangle: usize, from: Vec3, to: Vec3, others: usize },
}

impl StlError {
    /// What is allowed, and the way out.
    pub fn allowed(&self) -> String {
        let solid = "every edge of a solid belongs to two triangles that run along it in opposite directions";
        match self {
            StlError::Unreadable { .. } => {
                "allowed is the path of an STL file, from the scene file's folder".into()
            }
            StlError::TooLarge { .. } => {
                format!("allowed are at most {MAX_BYTES} bytes: simplify the surface")
            }
            StlError::TooManyTriangles { .. } => {
                format!("allowed are at most {MAX_TRIANGLES}: simplify the surface")
            }
            StlError::NoTriangles => "allowed are solids of at least 4 triangles".into(),
            StlError::WrongSize { .. } => "the file is cut off or no STL file: copy or export it anew".into(),
            StlError::NoStl { .. } => {
                "allowed are binary files, of at least 84 bytes, and ASCII files: export it anew".into()
            }
            StlError::Unfinished { .. } => "the file is cut off: copy or export it anew".into(),
            StlError::Syntax { .. } => "the file is no ASCII STL file: export it anew, best in binary".into(),
            StlError::NotFinite { .. } => "allowed are finite numbers: export the file anew".into(),
            StlError::Degenerate { .. } => {
                format!("allowed are triangles with an area: {REPAIR}, which removes faces without area")
            }
            StlError::Hole { .. } | StlError::Flipped { .. } => format!("{solid}: {REPAIR}"),
            StlError::Crowded { .. } => {
                format!("{solid}: {REPAIR}, or give bodies that touch a file and a region each")
            }
        }
    }
}
