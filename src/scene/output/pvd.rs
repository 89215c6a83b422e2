//! The list of a series of VTU files with their times, which ParaView opens as one animation.
//!
//! After "ParaView data (.pvd) file format" (paraview.org/Wiki). The list is written anew, whole, after each file, so that
//! a run that is interrupted leaves a series that is valid as far as it got.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::base::files::write_whole;
use crate::scene::output::{Moment, vtu};

/// The list's name in its folder.
pub const FILE_NAME: &str = "particles.pvd";

/// A folder of VTU files and their list.
#[derive(Debug)]
pub struct Series {
    folder: PathBuf,
    with_ghosts: bool,
    elements: String,
}

impl Series {
    /// A series in `folder`, which must be there.
    pub fn new(folder: &Path, with_ghosts: bool) -> Series {
        Series { folder: folder.to_path_buf(), with_ghosts, elements: String::new() }
    }

    /// Writes the particles of a moment, later than all before it, and then the list.
    pub fn add(&mut self, moment: &Moment<'_>) -> Result<()> {
        let name = vtu::file_name(moment.step);
        vtu::write(&self.folder.join(&name), moment, self.with_ghosts)?;
        let time_s = moment.time_s;
        let _infallible =
            writeln!(self.elements, "<DataSet timestep=\"{time_s}\" part=\"0\" file=\"{name}\"/>");
        let list = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n\
             <Collection>\n{}</Collection>\n</VTKFile>\n",
            self.elements
        );
        let path = self.folder.join(FILE_NAME);
        write_whole(&path, list.as_bytes()).with_context(|| format!("cannot write {}", path.display()))
    }
}
