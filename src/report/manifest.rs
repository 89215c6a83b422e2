//! `manifest.sha256` and `manifest.csv`: the checksum of every file of a run folder, written after all of them.
//!
//! `sha256sum -c manifest.sha256` checks a folder without this program.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::base::files::{is_leftover, write_whole};
use crate::experiment::foreign;
use crate::experiment::run::LAST_FILE;
use crate::report::samples::csv_bytes;

const TABLE: &str = "manifest.csv";
/// Differences that an error names; further ones are counted.
const MOST_NAMED: usize = 5;

/// A row of `manifest.csv`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Entry {
    /// The path below the run folder.
    pub file: String,
    /// `record`, which nothing can make again, or `derived`, which `repro report` can.
    pub kind: &'static str,
    pub bytes: u64,
    pub sha256: String,
}

/// Whether a file belongs to the run: not the lock, not a half-written file, and not a state, which only an unfinished run
/// needs.
fn belongs(file: &str) -> bool {
    !(file == ".lock"
        || file == TABLE
        || file == LAST_FILE
        || is_leftover(file)
        || ["states/", "slurm/", "export/"].iter().any(|folder| file.starts_with(folder)))
}

fn entry(folder: &Path, file: String) -> Result<Entry> {
    let path = folder.join(&file);
    let cannot = || format!("cannot read {}", path.display());
    let mut content = File::open(&path).with_context(cannot)?;
    let (mut hash, mut bytes, mut buffer) = (Sha256::new(), 0, vec![0; 1 << 16]);
    loop {
        let count = content.read(&mut buffer).with_context(cannot)?;
        if count == 0 {
            break;
        }
        hash.update(&buffer[..count]);
        bytes += count as u64;
    }
    let recorded = ["rounds/", "logs/", "scenes/", "run.json", "machine.json"];
    let kind = if recorded.iter().any(|start| file.starts_with(start)) { "record" } else { "derived" };
    Ok(Entry { file, kind, bytes, sha256: hexadecimal(&hash.finalize()) })
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Writes both files.
pub fn write(folder: &Path) -> Result<()> {
    let files = foreign::plain_files(folder)?.into_iter().filter(|file| belongs(file));
    let mut entries = files.map(|file| entry(folder, file)).collect::<Result<Vec<_>>>()?;
    let cannot = |name: &str| format!("cannot write {name}");
    write_whole(&folder.join(TABLE), &csv_bytes(&entries)?).with_context(|| cannot(TABLE))?;
    entries.push(entry(folder, TABLE.to_string())?);
    let lines: String = entries.iter().map(|e| format!("{}  {}\n", e.sha256, e.file)).collect();
    write_whole(&folder.join(LAST_FILE), lines.as_bytes()).with_context(|| cannot(LAST_FILE))
}

/// Checks every file of a run folder and returns their paths, `manifest.sha256` last. A file that differs, is missing or is
/// not listed is named.
pub fn verify(folder: &Path) -> Result<Vec<String>> {
    let listed = read(folder)?;
    let files = foreign::plain_files(folder)?;
    let mut files: Vec<String> = files.into_iter().filter(|file| belongs(file) || file == TABLE).collect();
    let mut wrong = Vec::new();
    for file in &files {
        match listed.get(file) {
            None => wrong.push(format!("{file} is not listed")),
            Some(sha256) if *sha256 != entry(folder, file.clone())?.sha256 => {
                wrong.push(format!("{file} has another content"));
            }
            Some(_) => {}
        }
    }
    let missing = listed.keys().filter(|file| !files.contains(file));
    wrong.extend(missing.map(|file| format!("{file} is missing")));
    if !wrong.is_empty() {
        let more = wrong.len().saturating_sub(MOST_NAMED);
        let more = if more > 0 { format!("; and {more} more") } else { String::new() };
        let named = wrong[..wrong.len().min(MOST_NAMED)].join("; ");
        bail!(
            "{}: {named}{more}. If the change is meant, `repro report` writes a new manifest",
            folder.join(LAST_FILE).display()
        );
    }
    files.push(LAST_FILE.to_string());
    Ok(files)
}

/// Checksums by file, as listed. The names are compared with those that are there, and never opened.
fn read(folder: &Path) -> Result<BTreeMap<String, String>> {
    let path = folder.join(LAST_FILE);
    let bytes = foreign::read(&path).context("`repro report` writes the manifest")?;
    let text = String::from_utf8(bytes).with_context(|| format!("{}: not text", path.display()))?;
    let mut listed = BTreeMap::new();
    for (number, line) in text.lines().enumerate() {
        let found = line.split_once("  ").filter(|(hash, _)| hash.len() == 64);
        let (hash, file) = found.with_context(|| {
            format!("{}: line {}: allowed is a checksum, two blanks and a file", path.display(), number + 1)
        })?;
        let first = listed.insert(file.to_string(), hash.to_string()).is_none();
        ensure!(first, "{}: line {}: {file:?} is listed twice", path.display(), number + 1);
    }
    Ok(listed)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_change_to_any_file_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        fs::create_dir(folder.join("rounds")).unwrap();
        for name in ["run.json", "rounds/a.json", "report.md", ".lock", "x.csv.7.part"] {
            fs::write(folder.join(name), "abc").unwrap();
        }
        write(folder).unwrap();
        let text = fs::read_to_string(folder.join(LAST_FILE)).unwrap();
        // The standard's example: the SHA-256 of "abc".
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert!(text.starts_with(&format!("{abc}  report.md\n{abc}  rounds/a.json\n{abc}  run.json\n")));
        assert_eq!(text.lines().count(), 4);
        let table = fs::read_to_string(folder.join(TABLE)).unwrap();
        assert!(table.contains(&format!("rounds/a.json,record,3,{abc}\n")), "{table}");
        let files = verify(folder).unwrap();
        assert_eq!(files, ["manifest.csv", "report.md", "rounds/a.json", "run.json", LAST_FILE]);

        let complaint = |change: &dyn Fn()| {
            write(folder).unwrap();
            change();
            format!("{:#}", verify(folder).unwrap_err())
        };
        let text = complaint(&|| fs::write(folder.join("rounds/a.json"), "abd").unwrap());
        assert!(
            text.contains("rounds/a.json has another content") && text.contains("repro report"),
            "{text}"
        );
        let text = complaint(&|| fs::write(folder.join("rounds/b.json"), "abc").unwrap());
        assert!(text.contains("rounds/b.json is not listed"), "{text}");
        let text = complaint(&|| fs::remove_file(folder.join("rounds/b.json")).unwrap());
        assert!(text.contains("rounds/b.json is missing"), "{text}");
        let text = complaint(&|| fs::write(folder.join(LAST_FILE), format!("{abc}  a\nabc")).unwrap());
        assert!(text.contains("manifest.sha256: line 2"), "{text}");
        let text = complaint(&|| fs::remove_file(folder.join(LAST_FILE)).unwrap());
        assert!(text.contains("manifest.sha256") && text.contains("repro report"), "{text}");
    }
}
