//! Solids from STL files.

mod columns;
mod error;
mod mesh;
mod read;

use std::path::{Path, PathBuf};

pub use columns::Columns;
pub use error::{MAX_BYTES, MAX_TRIANGLES, StlError};
pub use mesh::Mesh;

/// The closed surface that the bytes of an STL file describe, in the file's units.
pub fn parse(bytes: &[u8]) -> Result<Mesh, StlError> {
    Mesh::new(&read::triangles(bytes)?)
}

/// Reads and checks a file.
pub fn read(path: &Path) -> Result<Mesh, StlError> {
    let unreadable = |error: std::io::Error| StlError::Unreadable { why: error.to_string() };
    let metadata = std::fs::metadata(path).map_err(unreadable)?;
    if !metadata.is_file() {
        return Err(StlError::Unreadable { why: "it is no file".to_string() });
    }
    if metadata.len() > MAX_BYTES {
        return Err(StlError::TooLarge { bytes: metadata.len() });
    }
    parse(&std::fs::read(path).map_err(unreadable)?)
}

/// The path of a file that a scene file names: from the scene file's folder.
pub fn beside(scene_file: &str, name: &str) -> PathBuf {
    Path::new(scene_file).parent().unwrap_or(Path::new("")).join(name)
}
