//! The triangles of an STL file, binary or ASCII, as they stand there.
//!
//! Numbers are single precision in both forms, so that both forms of a solid give the same particles. The normals are not
//! looked at: the order of the corners says which side is outside.

use super::error::{MAX_TRIANGLES, StlError};
use crate::base::vec3::{Vec3, is_finite};

/// A header of 80 bytes and the number of triangles.
const BINARY_START: usize = 84;
/// Twelve single-precision numbers and two bytes of attributes.
const BINARY_TRIANGLE: usize = 50;

/// The corners of each triangle, in the file's units.
pub fn triangles(bytes: &[u8]) -> Result<Vec<[Vec3; 3]>, StlError> {
    // A binary file may begin with `solid`, too, but no text has exactly the length that its bytes 80 to 83 say.
    let declared = declared_triangles(bytes);
    let needed = declared.map(|count| BINARY_START + BINARY_TRIANGLE * count);
    let triangles = if needed == Some(bytes.len()) {
        binary(&bytes[BINARY_START..])?
    } else if bytes.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) {
        ascii(bytes)?
    } else {
        return Err(match (declared, needed) {
            (Some(triangles), Some(needed)) => StlError::WrongSize { bytes: bytes.len(), triangles, needed },
            _ => StlError::NoStl { bytes: bytes.len() },
        });
    };
    if triangles.is_empty() {
        return Err(StlError::NoTriangles);
    }
    for (k, corner) in triangles.iter().enumerate().flat_map(|(k, corners)| corners.map(|corner| (k, corner)))
    {
        if !is_finite(corner) {
            return Err(StlError::NotFinite { triangle: k + 1, corner });
        }
    }
    Ok(triangles)
}

fn declared_triangles(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(80..BINARY_START)?;
    Some(u32::from_le_bytes(count.try_into().ok()?) as usize)
}

fn binary(records: &[u8]) -> Result<Vec<[Vec3; 3]>, StlError> {
    let count = records.len() / BINARY_TRIANGLE;
    if count > MAX_TRIANGLES {
        return Err(StlError::TooManyTriangles { triangles: count });
    }
    let number = |bytes: &[u8]| f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
    let corner = |bytes: &[u8]| [0, 4, 8].map(|at| number(&bytes[at..at + 4]));
    // The first twelve bytes of a record are the normal.
    let corners = |record: &[u8]| [12, 24, 36].map(|at| corner(&record[at..at + 12]));
    Ok(records.chunks_exact(BINARY_TRIANGLE).map(corners).collect())
}

/// Reads lines, each of which begins with a keyword. Several solids in one file are one set of triangles.
fn ascii(bytes: &[u8]) -> Result<Vec<[Vec3; 3]>, StlError> {
    let mut triangles = Vec::new();
    let (mut facet, mut open): (Option<Vec<Vec3>>, bool) = (None, false);
    for (k, line) in bytes.split(|byte| *byte == b'\n').enumerate() {
        let text = String::from_utf8_lossy(line);
        let mut words = text.split_ascii_whitespace();
        let Some(keyword) = words.next() else { continue };
        let wrong = |expected| StlError::Syntax { line: k + 1, found: shortened(&text), expected };
        match (keyword.to_ascii_lowercase().as_str(), &mut facet) {
            ("solid", None) => open = true,
            ("endsolid", None) => open = false,
            ("facet", None) => facet = Some(Vec::with_capacity(3)),
            ("outer" | "endloop", Some(_)) => {}
            ("vertex", Some(corners)) => {
                let corner = numbers(words).ok_or_else(|| wrong("`vertex` and three numbers"))?;
                corners.push(corner);
            }
            ("endfacet", Some(corners)) => {
                let corners: [Vec3; 3] =
                    corners.as_slice().try_into().map_err(|_| wrong("a third `vertex`"))?;
                triangles.push(corners);
                facet = None;
            }
            (_, None) => return Err(wrong("`facet` or `endsolid`")),
            (_, Some(_)) => return Err(wrong("`vertex` or `endfacet`")),
        }
        if triangles.len() > MAX_TRIANGLES {
            return Err(StlError::TooManyTriangles { triangles: triangles.len() });
        }
    }
    match (facet, open) {
        (Some(_), _) => Err(StlError::Unfinished { missing: "endfacet" }),
        (None, true) => Err(StlError::Unfinished { missing: "endsolid" }),
        (None, false) => Ok(triangles),
    }
}

/// Three numbers and nothing else.
fn numbers<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Vec3> {
    let mut vector = [0.0; 3];
    for component in &mut vector {
        *component = f64::from(words.next()?.parse::<f32>().ok()?);
    }
    words.next().is_none().then_some(vector)
}

/// The start of a line, for a message.
fn shortened(line: &str) -> String {
    line.trim().chars().take(40).filter(|c| !c.is_control()).collect()
}
