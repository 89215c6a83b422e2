//! A simulation's whole state in a file, from which it goes on to the same bits.
//!
//! Layout, little-endian: the magic, a version, the digest of the scene's parameters, the number of columns; then each
//! column as the length of its name, the name, a type, the number of elements and the elements; at the end the SHA-256
//! of everything before it. A file that is cut off, changed, of another scene or of another version is refused before
//! anything is taken from it.

use std::path::Path;

use anyhow::{Context, Result};
use sha2::{Digest, Sha256};

use crate::base::files::write_whole;
use crate::base::input::InputError;
use crate::engine::columns::Column;
use crate::engine::parameters::Parameters;
use crate::engine::particles::Kind;
use crate::engine::simulation::Simulation;

const MAGIC: [u8; 8] = *b"MPSSTATE";
/// Raised whenever a column is added, renamed or moved.
const VERSION: u32 = 1;
const CHECKSUM: usize = 32;
/// The largest file that is read.
const MAX_BYTES: u64 = 1 << 36;

/// Writes the state after the last step to `path`, whole or not at all.
pub fn write(path: &Path, simulation: &mut dyn Simulation, parameters: &Parameters) -> Result<()> {
    let (mut body, mut count) = (Vec::new(), 0_u32);
    simulation.visit(&mut |name, column| {
        count += 1;
        body.push(name.len() as u8);
        body.extend(name.as_bytes());
        put_column(&mut body, &column);
    });
    let mut bytes = MAGIC.to_vec();
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(scene_digest(parameters));
    bytes.extend(count.to_le_bytes());
    bytes.append(&mut body);
    let checksum = Sha256::digest(&bytes);
    bytes.extend(checksum);
    write_whole(path, &bytes).with_context(|| format!("cannot write {}", path.display()))
}

/// Lets `simulation`, built from the same scene, go on from the state in `path`.
pub fn restore(path: &Path, simulation: &mut dyn Simulation, parameters: &Parameters) -> Result<()> {
    let name = path.display().to_string();
    let refused = |found: &str, allowed: &str| InputError::new(&name, "checkpoint", found, allowed);
    let length = std::fs::metadata(path).with_context(|| format!("cannot read {name}"))?.len();
    if length > MAX_BYTES {
        return Err(refused(&format!("{length} bytes long"), "no checkpoint is as long").into());
    }
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {name}"))?;
    let again = "write a new one with `repro simulate SCENE --checkpoint-every STEPS --output FOLDER`";
    if !bytes.starts_with(&MAGIC) {
        return Err(refused("no checkpoint of a simulation", again).into());
    }
    let body = bytes
        .len()
        .checked_sub(CHECKSUM)
        .filter(|&end| Sha256::digest(&bytes[..end])[..] == bytes[end..])
        .map(|end| &bytes[MAGIC.len()..end])
        .ok_or_else(|| refused("cut off or changed: its checksum does not fit", again))?;
    let mut rest = Reader { bytes: body };
    let version = rest.number().ok_or_else(|| refused("cut off", again))?;
    if version != VERSION {
        let found = format!("of version {version}");
        return Err(refused(&found, &format!("this program reads version {VERSION}: {again}")).into());
    }
    if rest.take(32) != Some(&scene_digest(parameters)[..]) {
        let allowed = "restart the scene with the same file and the same `--set` as the run that wrote it";
        return Err(refused("of another scene", allowed).into());
    }
    // Read twice: first to see whether everything fits, then to take it, so that a misfit leaves the simulation alone.
    for dry in [true, false] {
        let mut rest = Reader { bytes: rest.bytes };
        let (mut count, mut misfit) = (rest.number(), None);
        simulation.visit(&mut |name, column| {
            count = count.and_then(|left| left.checked_sub(1));
            if misfit.is_none() && (count.is_none() || rest.column(name, column, dry).is_none()) {
                misfit = Some(name);
            }
        });
        if let Some(column) = misfit {
            return Err(refused(&format!("without a fitting column `{column}`"), again).into());
        }
        if count != Some(0) || !rest.bytes.is_empty() {
            return Err(refused("with columns that this scene does not have", again).into());
        }
    }
    Ok(())
}

/// What must be the same for a run to go on: everything but its end.
fn scene_digest(parameters: &Parameters) -> [u8; 32] {
    Sha256::digest(format!("{parameters:?}")).into()
}

fn put_column(bytes: &mut Vec<u8>, column: &Column<'_>) {
    let mut head = |kind: u8, len: usize| {
        bytes.push(kind);
        bytes.extend((len as u64).to_le_bytes());
    };
    match column {
        Column::Kinds(values) => {
            head(0, values.len());
            bytes.extend(values.iter().map(|&kind| kind as u8));
        }
        Column::Groups(values) => {
            head(1, values.len());
            bytes.extend(values.iter());
        }
        Column::Indices(values) => {
            head(2, values.len());
            bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        }
        Column::Scalars(values) => {
            head(3, values.len());
            bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        }
        Column::Vectors(values) => {
            head(4, values.len());
            bytes.extend(values.iter().flatten().flat_map(|value| value.to_le_bytes()));
        }
        Column::Number(value) => {
            head(5, 1);
            bytes.extend(value.to_le_bytes());
        }
        Column::Count(value) => {
            head(6, 1);
            bytes.extend((**value as u64).to_le_bytes());
        }
    }
}

/// What is left of a file.
struct Reader<'a> {
    bytes: &'a [u8],
}

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.bytes.split_at_checked(count)?;
        self.bytes = rest;
        Some(taken)
    }

    fn number(&mut self) -> Option<u32> {
        self.take(4).map(|bytes| u32::from_le_bytes(bytes.try_into().expect("four bytes")))
    }

    /// Reads the next column into `column`, or only sees whether it would fit; `None` if it is another one. All columns
    /// but those that hold indices have as many elements as before.
    fn column(&mut self, name: &str, column: Column<'_>, dry: bool) -> Option<()> {
        let len = self.take(1)?[0] as usize;
        if self.take(len)? != name.as_bytes() {
            return None;
        }
        let kind = self.take(1)?[0];
        let count = usize::try_from(u64::from_le_bytes(self.take(8)?.try_into().ok()?)).ok()?;
        let mut values = |expected: u8, len: usize, size: usize| {
            let fits = kind == expected && count == len;
            self.take(count.checked_mul(size)?).filter(|_| fits)
        };
        match column {
            Column::Kinds(to) => {
                let values = values(0, to.len(), 1)?;
                let kinds = values.iter().map(|&k| Kind::ALL.into_iter().find(|kind| *kind as u8 == k));
                let kinds: Vec<Kind> = kinds.collect::<Option<_>>()?;
                if !dry {
                    to.copy_from_slice(&kinds);
                }
            }
            Column::Groups(to) => {
                let values = values(1, to.len(), 1)?;
                if !dry {
                    to.copy_from_slice(values);
                }
            }
            Column::Indices(to) => {
                let values = values(2, count, 4)?;
                if !dry {
                    to.clear();
                    to.extend(values.as_chunks::<4>().0.iter().map(|&bytes| u32::from_le_bytes(bytes)));
                }
            }
            Column::Scalars(to) => {
                let values = values(3, to.len(), 8)?;
                if !dry {
                    floats(values).zip(to).for_each(|(value, to)| *to = value);
                }
            }
            Column::Vectors(to) => {
                let values = values(4, to.len(), 24)?;
                if !dry {
                    floats(values).zip(to.as_flattened_mut()).for_each(|(value, to)| *to = value);
                }
            }
            Column::Number(to) => {
                let value = floats(values(5, 1, 8)?).next()?;
                if !dry {
                    *to = value;
                }
            }
            Column::Count(to) => {
                let value = u64::from_le_bytes(values(6, 1, 8)?.try_into().ok()?);
                let value = usize::try_from(value).ok()?;
                if !dry {
                    *to = value;
                }
            }
        }
        Some(())
    }
}

fn floats(bytes: &[u8]) -> impl Iterator<Item = f64> + '_ {
    bytes.as_chunks::<8>().0.iter().map(|&bytes| f64::from_le_bytes(bytes))
}
