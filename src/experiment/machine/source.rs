//! Bounded reading of small kernel files below a root, which is `/` or a recorded tree.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::reading::Reading;

/// The most that is read of any file, in bytes: the sizes that kernel files state mean nothing.
const LONGEST_READ: u64 = 64 * 1024;

/// The largest CPU, node or thread number believed, so that a broken list cannot fill the memory.
pub(super) const MOST_NUMBERS: usize = 1 << 16;

/// The place that facts are read from.
pub(super) struct Source {
    root: PathBuf,
}

impl Source {
    pub(super) fn new(root: &Path) -> Source {
        Source { root: root.to_owned() }
    }

    /// The text of a file without surrounding blanks; an empty file holds no value.
    pub(super) fn text(&self, path: &str) -> Reading {
        match read_start(&self.root.join(path)) {
            Ok(text) => Reading::found(Some(text.trim()).filter(|text| !text.is_empty())),
            Err(error) => Reading::from_error(&error),
        }
    }

    /// The number that a file holds alone.
    pub(super) fn number<T: FromStr>(&self, path: &str) -> Option<T> {
        self.text(path).value()?.parse().ok()
    }

    /// `yes` or `no` for a kernel switch, which reads 1 for on and 0 for off.
    pub(super) fn switch(&self, path: &str) -> Reading {
        self.text(path).extract(|text| match text {
            "1" => Some("yes"),
            "0" => Some("no"),
            _ => None,
        })
    }

    /// A set of CPUs in the kernel's notation, such as `0-3,8`.
    pub(super) fn cpu_list(&self, path: &str) -> BTreeSet<usize> {
        parse_cpu_list(self.text(path).value().unwrap_or(""))
    }

    pub(super) fn exists(&self, path: &str) -> bool {
        self.root.join(path).exists()
    }

    /// The numbers `n` of the entries named `<prefix>n` in a directory, in ascending order.
    pub(super) fn numbered_entries(&self, directory: &str, prefix: &str) -> BTreeSet<usize> {
        let Ok(entries) = fs::read_dir(self.root.join(directory)) else {
            return BTreeSet::new();
        };
        entries
            .take(MOST_NUMBERS)
            .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
            .filter_map(|name| name.strip_prefix(prefix)?.parse().ok())
            .collect()
    }
}

/// Only regular files are read: opening a pipe in a recorded tree would wait for ever.
fn read_start(path: &Path) -> io::Result<String> {
    if !fs::metadata(path)?.is_file() {
        return Err(io::ErrorKind::NotFound.into());
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(LONGEST_READ).read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Reads the kernel's notation for sets of CPUs, leaving out the parts that make no sense.
pub(super) fn parse_cpu_list(text: &str) -> BTreeSet<usize> {
    text.split(',').filter_map(parse_range).flatten().take(MOST_NUMBERS).collect()
}

fn parse_range(text: &str) -> Option<std::ops::RangeInclusive<usize>> {
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    let first: usize = first.trim().parse().ok()?;
    let last: usize = last.trim().parse().ok()?;
    (last < MOST_NUMBERS).then_some(first..=last)
}

/// The value on the first line `key: value`, where blanks may surround the colon.
pub(super) fn field<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    fields(text, key).next()
}

/// The values on all the lines `key: value`, in the order of the text.
pub(super) fn fields<'a>(text: &'a str, key: &str) -> impl Iterator<Item = &'a str> {
    text.lines()
        .filter_map(|line| line.split_once(':'))
        .filter(move |(name, value)| name.trim() == key && !value.trim().is_empty())
        .map(|(_, value)| value.trim())
}

#[cfg(test)]
mod tests {
    use super::super::fixture::Tree;
    use super::*;

    #[test]
    fn cpu_lists_are_read_and_their_broken_parts_left_out() {
        let list = |text| parse_cpu_list(text).into_iter().collect::<Vec<_>>();
        assert_eq!(list("0-2,8,10-11"), [0, 1, 2, 8, 10, 11]);
        assert_eq!(list("x,-1,3-,5-4,7"), [7]);
        assert_eq!(list("0-18446744073709551615,1"), [1]);
        assert!(list("").is_empty());
        let repeated = "0-65535,".repeat(8000);
        assert_eq!(list(&repeated).len(), MOST_NUMBERS);
    }

    #[test]
    fn long_files_are_cut_and_strange_bytes_survive() {
        let tree = Tree::new();
        tree.write("long", &"7".repeat(1 << 20));
        tree.write_bytes("strange", &[0xff, 0xfe, b'4']);
        let source = tree.source();
        let read = source.text("long").value().map(str::len);
        assert_eq!(read, Some(LONGEST_READ as usize));
        assert_eq!(source.number::<u64>("long"), None);
        assert!(source.text("strange").value().is_some());
        assert_eq!(source.number::<u64>("strange"), None);
    }

    #[test]
    fn missing_empty_and_directory_are_unavailable() {
        let tree = Tree::new();
        tree.write("directory/empty", "\n");
        for path in ["missing", "directory", "directory/empty"] {
            assert_eq!(tree.source().text(path), Reading::Unavailable);
        }
    }

    #[test]
    fn fields_are_found_by_their_whole_key() {
        let text = "cpu MHz\t\t: 2400.0\ncpu\t: POWER9\nempty:\nmodel name : X: y";
        assert_eq!(field(text, "cpu"), Some("POWER9"));
        assert_eq!(field(text, "model name"), Some("X: y"));
        assert_eq!(field(text, "empty"), None);
    }
}
