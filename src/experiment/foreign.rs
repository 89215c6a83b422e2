//! Run folders as foreign data: anyone may have written them. Nothing in them is followed out of the folder, and nothing is
//! read without bounds.

use std::fs::{self, File};
use std::io::Read;
use std::path::Path;

use anyhow::{Context, Result, anyhow, bail, ensure};
use serde::Deserialize;
use serde::de::DeserializeOwned;

/// The largest file that is read, bytes. Records of long runs have a few MB.
pub const LARGEST_FILE: u64 = 256 << 20;
/// More entries than any run leaves.
const MOST_ENTRIES: usize = 100_000;
/// Deeper than any run's folders are.
const DEEPEST: usize = 8;
/// The longest complaint that is shown, characters.
const LONGEST_REASON: usize = 300;

/// Every file below `folder`, with forward slashes and sorted. A link, or anything else that is neither a file nor a
/// folder, is refused: writing to it or reading from it would leave the run folder.
pub fn plain_files(folder: &Path) -> Result<Vec<String>> {
    let mut files = Vec::new();
    add_files(folder, "", 0, &mut files)?;
    files.sort();
    Ok(files)
}

fn add_files(folder: &Path, below: &str, depth: usize, files: &mut Vec<String>) -> Result<()> {
    let place = folder.join(below);
    ensure!(depth <= DEEPEST, "{}: folders lie deeper than {DEEPEST} in one another", place.display());
    let entries = fs::read_dir(&place).with_context(|| format!("cannot list {}", place.display()))?;
    for entry in entries {
        let entry = entry.with_context(|| format!("cannot list {}", place.display()))?;
        let name = entry.file_name();
        let odd = || format!("{}: the name {name:?} is not plain text", place.display());
        let name = name.to_str().with_context(odd)?;
        ensure!(!name.contains(|c: char| c.is_control() || c == '\\'), odd());
        let path = if below.is_empty() { name.to_string() } else { format!("{below}/{name}") };
        let kind = entry.file_type().with_context(|| format!("cannot look at {path}"))?;
        if kind.is_dir() {
            add_files(folder, &path, depth + 1, files)?;
        } else if kind.is_file() {
            files.push(path);
        } else {
            bail!("{}: {}", folder.join(path).display(), not_followed(kind.is_symlink()));
        }
        ensure!(files.len() <= MOST_ENTRIES, "{}: more than {MOST_ENTRIES} files", folder.display());
    }
    Ok(())
}

fn not_followed(is_link: bool) -> &'static str {
    match is_link {
        true => "is a symbolic link, which a run folder may not have: it is not followed",
        false => "is neither a file nor a folder",
    }
}

/// The bytes of a plain file of at most [`LARGEST_FILE`] bytes. A link or a pipe is refused before it is opened.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    let name = path.display();
    let found = fs::symlink_metadata(path).with_context(|| format!("cannot read {name}"))?;
    ensure!(found.is_file(), "{name}: {}", not_followed(found.is_symlink()));
    let too_large = || anyhow!("{name}: has more than the {LARGEST_FILE} bytes that are read");
    ensure!(found.len() <= LARGEST_FILE, too_large());
    let mut bytes = Vec::new();
    let file = File::open(path).with_context(|| format!("cannot read {name}"))?;
    file.take(LARGEST_FILE + 1).read_to_end(&mut bytes).with_context(|| format!("cannot read {name}"))?;
    ensure!(bytes.len() as u64 <= LARGEST_FILE, too_large());
    Ok(bytes)
}

/// What every record says first.
#[derive(Deserialize)]
struct Versioned {
    schema_version: u32,
}

/// Reads a JSON record of this schema; `what` says what it should be, as in "a round's record".
pub fn read_record<T: DeserializeOwned>(path: &Path, what: &str, schema: u32) -> Result<T> {
    let (name, bytes) = (path.display(), read(path)?);
    let wrong = |error: serde_json::Error| {
        anyhow!("{name}: line {}, column {}: not {what}: {}", error.line(), error.column(), reason(&error))
    };
    let Versioned { schema_version } = serde_json::from_slice(&bytes).map_err(wrong)?;
    ensure!(
        schema_version == schema,
        "{name}: schema_version is {schema_version}; this program reads {schema}"
    );
    serde_json::from_slice(&bytes).map_err(wrong)
}

/// The parser's complaint without the place, which stands before it.
fn reason(error: &serde_json::Error) -> String {
    let text = error.to_string();
    let place = format!(" at line {} column {}", error.line(), error.column());
    presentable(text.strip_suffix(&place).unwrap_or(&text))
}

/// A complaint that may quote what was found: one line, of bounded length, without control characters.
pub fn presentable(text: &str) -> String {
    let mut letters = text.chars().map(|c| if c.is_control() { ' ' } else { c });
    let mut plain: String = letters.by_ref().take(LONGEST_REASON).collect();
    if letters.next().is_some() {
        plain.push_str(" ...");
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_listed_in_order_whatever_the_system_says_first() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir_all(folder.path().join("b/c")).unwrap();
        for name in ["z", "b/c/y", "a", "b.txt"] {
            fs::write(folder.path().join(name), name).unwrap();
        }
        assert_eq!(plain_files(folder.path()).unwrap(), ["a", "b.txt", "b/c/y", "z"]);
        fs::create_dir_all(folder.path().join("1/2/3/4/5/6/7/8/9")).unwrap();
        assert!(plain_files(folder.path()).unwrap_err().to_string().contains("deeper"));
    }

    #[cfg(unix)]
    #[test]
    fn links_and_odd_names_are_refused_unopened() {
        let folder = tempfile::tempdir().unwrap();
        let (link, odd) = (folder.path().join("link"), folder.path().join("two\nlines"));
        std::os::unix::fs::symlink("/etc/hostname", &link).unwrap();
        for error in [plain_files(folder.path()).unwrap_err(), read(&link).unwrap_err()] {
            let text = error.to_string();
            assert!(text.contains("symbolic link") && text.contains("link: is"), "{text}");
        }
        fs::remove_file(link).unwrap();
        fs::write(odd, "").unwrap();
        let text = plain_files(folder.path()).unwrap_err().to_string();
        assert!(text.contains(r#""two\nlines""#) && !text.contains('\n'), "{text}");
    }

    /// A file of this size without content takes no room on a disk.
    #[test]
    fn a_file_too_large_is_refused_unread() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.json");
        File::create(&path).unwrap().set_len(10 << 30).unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("268435456 bytes"));
    }

    #[test]
    fn errors_say_where_and_stay_short() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.json");
        let error = |text: &str| {
            fs::write(&path, text).unwrap();
            read_record::<Versioned>(&path, "a test", 2).err().map(|error| error.to_string())
        };
        assert_eq!(error("{\"schema_version\": 2}"), None);
        assert!(
            error("{\n\"schema_version\": 2")
                .unwrap()
                .contains("run.json: line 2, column 19: not a test: EOF")
        );
        assert!(
            error("{\"schema_version\": 7}").unwrap().contains("schema_version is 7; this program reads 2")
        );
        assert!(error("{\"schema_version\": NaN}").unwrap().contains("line 1, column"));
        let long = format!("{{\"schema_version\": \"\\u001b{}\"}}", "x".repeat(100_000));
        let text = error(&long).unwrap();
        assert!(text.len() < 600 && !text.contains('\u{1b}'), "{text}");
    }
}
