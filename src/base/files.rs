//! Files that are either whole or not there.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;

/// Writes `bytes` to a temporary file beside `path`, syncs it and renames it, so that `path` never holds half of them.
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let name = path.file_name().ok_or_else(|| io::Error::other("a file needs a name"))?;
    let mut temporary = name.to_os_string();
    temporary.push(format!(".{}.part", std::process::id()));
    let temporary = path.with_file_name(temporary);
    let written = File::create(&temporary).and_then(|mut file| {
        file.write_all(bytes)?;
        file.sync_all()
    });
    let result = written.and_then(|()| fs::rename(&temporary, path));
    if result.is_err() {
        let _ = fs::remove_file(&temporary);
    }
    result
}

/// Whether a file's name is one that [`write_whole`] left behind when it was killed.
pub fn is_leftover(name: &str) -> bool {
    name.ends_with(".part")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_nothing() {
        let folder = std::env::temp_dir().join(format!("repro-files-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        write_whole(&folder.join("a.csv"), b"1\n").unwrap();
        write_whole(&folder.join("a.csv"), b"2\n").unwrap();
        assert_eq!(fs::read(folder.join("a.csv")).unwrap(), b"2\n");
        fs::create_dir(folder.join("taken")).unwrap();
        fs::write(folder.join("taken/x"), "").unwrap();
        assert!(write_whole(&folder.join("taken"), b"3").is_err());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
        fs::remove_dir_all(folder).unwrap();
    }
}
