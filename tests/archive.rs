//! What a finished run leaves for reviewers: checksums, what each part took, and one file with everything.

#![cfg(feature = "driver")]

#[path = "common/small_run.rs"]
mod small_run;

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::Read;
use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};
use zip::ZipArchive;

use small_run::{copied, copy, edit, files, repro, text};

/// The files of an archive.
fn unpacked(zip: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut archive = ZipArchive::new(File::open(zip).unwrap()).unwrap();
    let mut files = BTreeMap::new();
    for place in 0..archive.len() {
        let mut file = archive.by_index(place).unwrap();
        let (name, mut content) = (file.name().unwrap().to_string(), Vec::new());
        assert!(file.enclosed_name().is_some() && file.is_file(), "{name}");
        file.read_to_end(&mut content).unwrap();
        files.insert(name, content);
    }
    files
}

fn archive(run: &Path, more: &[&str]) -> (Option<i32>, String) {
    let output = repro(&[&["archive", run.to_str().unwrap()], more].concat());
    (output.status.code(), text(&output.stderr))
}

#[test]
fn an_archive_holds_the_run_and_how_to_do_it_again() {
    let place = tempfile::tempdir().unwrap();
    let run = copied(place.path(), "one");
    assert_eq!(archive(&run, &[]), (Some(0), String::new()));
    let packed = unpacked(&place.path().join("one.zip"));
    let text = |name: &str| String::from_utf8(packed[name].clone()).unwrap();
    for file in files(&run) {
        let name = file.strip_prefix(&run).unwrap().to_str().unwrap();
        let inside = packed.get(&format!("run/{name}")).cloned();
        assert_eq!(inside, (name != ".lock").then(|| fs::read(&file).unwrap()), "{name}");
    }
    for name in ["paper/claims.toml", "paper/reproduction.md", "scenes/dam-break.toml", "run/manifest.sha256"]
    {
        assert!(packed.contains_key(name), "{name}");
    }
    let read_me = text("README.md");
    for words in ["repro run small --quick", "sha256sum -c", "repro run experiments/small.toml --quick"] {
        assert!(read_me.contains(words), "{words}: {read_me}");
    }

    // The experiment in the archive is the one that ran.
    let file = place.path().join("again.toml");
    fs::write(&file, text("experiments/small.toml")).unwrap();
    let again = place.path().join("again");
    let arguments = ["run", file.to_str().unwrap(), "--quick", "--output", again.to_str().unwrap()];
    assert!(repro(&arguments).status.success());
    let experiments = |run: &Path| {
        let info: Value = serde_json::from_str(&fs::read_to_string(run.join("run.json")).unwrap()).unwrap();
        info["experiments"].clone()
    };
    assert_eq!(experiments(&run), experiments(&again));

    // Packed elsewhere and later, it has the same bytes.
    let moved = place.path().join("moved");
    copy(&run, &moved);
    let other = place.path().join("other.zip");
    assert_eq!(archive(&moved, &["--output", other.to_str().unwrap()]).0, Some(0));
    assert_eq!(fs::read(place.path().join("one.zip")).unwrap(), fs::read(other).unwrap());
}

#[test]
fn what_is_not_what_it_was_is_not_packed() {
    let place = tempfile::tempdir().unwrap();
    let original = copied(place.path(), "one");
    let refused = |doctor: &dyn Fn(&Path), more: &[&str], code: i32, words: &[&str]| {
        let place = tempfile::tempdir().unwrap();
        let copied = place.path().join("copied");
        copy(&original, &copied);
        doctor(&copied);
        let (found, complaint) = archive(&copied, more);
        assert_eq!(found, Some(code), "{complaint}");
        assert!(words.iter().all(|word| complaint.contains(word)), "{words:?}: {complaint}");
        assert!(!place.path().join("copied.zip").exists());
    };
    let write = |name: &'static str| move |folder: &Path| fs::write(folder.join(name), "1\n").unwrap();
    refused(&write("claims.csv"), &[], 3, &["manifest.sha256", "claims.csv is not listed"]);
    refused(&write("summary.csv"), &[], 3, &["summary.csv has another content", "repro report"]);
    let record = "rounds/small-paired-001.json";
    let slower =
        |folder: &Path| edit(&folder.join(record), |round| round["trials"][0]["wall_s"] = json!(9.0));
    refused(&slower, &[], 3, &[record, "another content"]);
    let remove = |folder: &Path| fs::remove_file(folder.join("manifest.sha256")).unwrap();
    refused(&remove, &[], 3, &["manifest.sha256", "repro report"]);
    let unfinished =
        |folder: &Path| edit(&folder.join("run.json"), |info| info["finished_utc"] = Value::Null);
    refused(&unfinished, &[], 3, &["not finished", "--unfinished", "repro run small --quick"]);
    refused(&|_| {}, &["--output", "/no/such/folder/a.zip"], 2, &["--output"]);
    let inside = original.join("a.zip");
    refused(&|_| {}, &["--output", original.parent().unwrap().to_str().unwrap()], 2, &["is a folder"]);
    let (code, complaint) = archive(&original, &["--output", inside.to_str().unwrap()]);
    assert!(code == Some(2) && complaint.contains("lies in the run folder"), "{complaint}");

    let copied = place.path().join("half");
    copy(&original, &copied);
    unfinished(&copied);
    fs::remove_file(copied.join(record)).unwrap();
    assert!(repro(&["report", copied.to_str().unwrap()]).status.success());
    assert_eq!(archive(&copied, &["--unfinished"]), (Some(0), String::new()));
}

#[test]
fn checksums_are_the_systems_own_and_are_the_same_when_rendered_again() {
    let place = tempfile::tempdir().unwrap();
    let run = copied(place.path(), "one");
    let manifest = || fs::read_to_string(run.join("manifest.sha256")).unwrap();
    let before = manifest();
    assert!(repro(&["report", run.to_str().unwrap()]).status.success());
    assert_eq!(before, manifest());
    assert_eq!(before.lines().count(), files(&run).len() - 2, "all but itself and the lock");
    if let Ok(checked) = Command::new("sha256sum").args(["-c", "manifest.sha256"]).current_dir(&run).output()
    {
        assert!(checked.status.success(), "{}", text(&checked.stdout));
    }
    let effort = fs::read_to_string(run.join("effort.csv")).unwrap();
    let row = effort.lines().find(|line| line.starts_with("experiment,small,small,")).unwrap();
    let cells: Vec<&str> = row.split(',').collect();
    assert_eq!(cells[3], "repro run experiments/small.toml --quick");
    let rounds = files(&run.join("rounds"));
    let bytes: u64 = rounds.iter().map(|file| fs::metadata(file).unwrap().len()).sum();
    // One run for the states, six paired trials, one observed run.
    assert_eq!((cells[5], cells[7]), ("8", bytes.to_string().as_str()));
    assert!(cells[6].parse::<f64>().unwrap() > 0.0);
}

/// Neither the records nor anything derived from them says who measured, on which host, or in which folder.
#[test]
fn nothing_names_a_user_a_host_or_a_place() {
    let place = tempfile::tempdir().unwrap();
    let run = copied(place.path(), "one");
    assert_eq!(archive(&run, &[]).0, Some(0));
    let packed = unpacked(&place.path().join("one.zip"));
    let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default().trim().to_string();
    let home = std::env::var("HOME").unwrap_or_default();
    let temporary = place.path().to_str().unwrap().to_string();
    let project = env!("CARGO_MANIFEST_DIR").to_string();
    // A short name may stand in any text by chance.
    let names = [host, home, temporary, project].into_iter().filter(|name| name.len() > 4);
    for name in names {
        for (file, content) in &packed {
            let found = content.windows(name.len()).any(|bytes| bytes == name.as_bytes());
            assert!(!found, "{file} holds {name}");
        }
    }
}
