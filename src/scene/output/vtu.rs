//! Particles as a VTK XML file, which ParaView, VTK and meshio open: an unstructured grid of vertices.
//!
//! After "VTK XML file formats" (Kitware, docs.vtk.org, file format version 1.0 with 64-bit headers). All numbers are
//! little endian, in one appended section of raw bytes. An array there is a header of 64-bit numbers - blocks, bytes of a
//! block, bytes of the last block where it is shorter and 0 otherwise, compressed bytes of each block - and then the
//! blocks, each a zlib stream of its own.

use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::path::Path;

use anyhow::{Context, Result};
use flate2::Compression;
use flate2::write::ZlibEncoder;

use crate::base::files::write_whole;
use crate::engine::particles::Kind;
use crate::scene::output::Moment;
use crate::scene::output::field::{Field, Values, fields};

/// Bytes of a block before compression.
const BLOCK: usize = 1 << 16;
/// The cell type of a single point in VTK.
const VTK_VERTEX: u8 = 1;

/// The file's name for a step.
pub fn file_name(step: usize) -> String {
    format!("particles-{step:06}.vtu")
}

/// Writes the particles to `path`, whole or not at all; ghosts, which take part in nothing, only where they are asked for.
pub fn write(path: &Path, moment: &Moment<'_>, with_ghosts: bool) -> Result<()> {
    let bytes = encode(moment, with_ghosts)?;
    write_whole(path, &bytes).with_context(|| format!("cannot write {}", path.display()))
}

/// The bytes of the file.
pub fn encode(moment: &Moment<'_>, with_ghosts: bool) -> io::Result<Vec<u8>> {
    let particles = moment.particles;
    let kept: Vec<usize> =
        (0..particles.len()).filter(|&i| with_ghosts || particles.kind[i] != Kind::Ghost).collect();
    let mut appended = Appended::default();
    let mut point_data = appended.array("Int64", "id", 1, kept.iter().map(|&i| (i as i64).to_le_bytes()))?;
    for field in fields(particles) {
        point_data += &appended.field(&field, &kept)?;
    }
    let position = kept.iter().map(|&i| doubles(particles.position[i]));
    let points = appended.array("Float64", "Points", 3, position)?;
    let cells = vertices(kept.len(), &mut appended)?;
    let time = appended.time(moment.time_s)?;
    let mut file = format!(
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\" \
         compressor=\"vtkZLibDataCompressor\">\n\
         <UnstructuredGrid>\n<FieldData>\n{time}</FieldData>\n\
         <Piece NumberOfPoints=\"{count}\" NumberOfCells=\"{count}\">\n\
         <PointData>\n{point_data}</PointData>\n<Points>\n{points}</Points>\n<Cells>\n{cells}</Cells>\n\
         </Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_",
        count = kept.len(),
    )
    .into_bytes();
    file.extend_from_slice(&appended.bytes);
    file.extend_from_slice(b"\n</AppendedData>\n</VTKFile>\n");
    Ok(file)
}

/// A cell for each of `count` points, so that every program shows them.
fn vertices(count: usize, appended: &mut Appended) -> io::Result<String> {
    let index = |i: usize| (i as i64).to_le_bytes();
    let connectivity = appended.array("Int64", "connectivity", 1, (0..count).map(index))?;
    let offsets = appended.array("Int64", "offsets", 1, (1..=count).map(index))?;
    let types = appended.array("UInt8", "types", 1, (0..count).map(|_| [VTK_VERTEX]))?;
    Ok(connectivity + &offsets + &types)
}

fn doubles(vector: [f64; 3]) -> [u8; 24] {
    let mut bytes = [0; 24];
    for (place, component) in bytes.chunks_exact_mut(8).zip(vector) {
        place.copy_from_slice(&component.to_le_bytes());
    }
    bytes
}

/// The appended section so far.
#[derive(Debug, Default)]
struct Appended {
    bytes: Vec<u8>,
}

impl Appended {
    fn field(&mut self, field: &Field<'_>, kept: &[usize]) -> io::Result<String> {
        let name = field.column();
        match field.values {
            Values::Scalars(values) => {
                self.array("Float64", &name, 1, kept.iter().map(|&i| values[i].to_le_bytes()))
            }
            Values::Vectors(values) => {
                self.array("Float64", &name, 3, kept.iter().map(|&i| doubles(values[i])))
            }
            Values::Kinds(values) => self.array("UInt8", &name, 1, kept.iter().map(|&i| [values[i] as u8])),
            Values::Labels(values) => self.array("UInt8", &name, 1, kept.iter().map(|&i| [values[i]])),
        }
    }

    /// Adds an array and returns the element that describes it.
    fn array<const N: usize>(
        &mut self,
        kind: &str,
        name: &str,
        components: usize,
        entries: impl Iterator<Item = [u8; N]>,
    ) -> io::Result<String> {
        let offset = self.add(&entries.flatten().collect::<Vec<u8>>())?;
        // meshio takes a column of single numbers for a matrix if their number of components is spelt out.
        let components = match components {
            1 => String::new(),
            _ => format!(" NumberOfComponents=\"{components}\""),
        };
        Ok(format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\"{components} format=\"appended\" offset=\"{offset}\"/>\n"
        ))
    }

    /// The simulated time, under the name by which VTK's readers look for it.
    fn time(&mut self, time_s: f64) -> io::Result<String> {
        let offset = self.add(&time_s.to_le_bytes())?;
        let mut element = String::new();
        let _infallible = writeln!(
            element,
            "<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"appended\" offset=\"{offset}\"/>"
        );
        Ok(element)
    }

    /// Adds bytes in compressed blocks and returns where they begin.
    fn add(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let offset = self.bytes.len();
        let blocks: Vec<Vec<u8>> = bytes.chunks(BLOCK).map(compressed).collect::<io::Result<_>>()?;
        let header = [blocks.len(), BLOCK, bytes.len() % BLOCK];
        for number in header.into_iter().chain(blocks.iter().map(Vec::len)) {
            self.bytes.extend_from_slice(&(number as u64).to_le_bytes());
        }
        self.bytes.extend(blocks.into_iter().flatten());
        Ok(offset)
    }
}

fn compressed(block: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(block)?;
    encoder.finish()
}
