//! A small run, doctored as a foreign run folder may be, and its tables read back.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;

use serde_json::Value;

/// Timed cells on one and two threads, and an observed run with a front.
const EXPERIMENT: &str = r#"
schema = 2
id = "small"
title = "Small"
question = "Can it be exported?"
analysis = "Open it."
scene = "dam-break"
seed = 1
pin = "off"
[[factors]]
threads = [1, 2]
preset = ["paper-linked-list", "paper-aos-relocation"]
[[case]]
id = "dam-break"
title = "dam break"
scene = "dam-break"
set = { end_time_s = 0.12, particle_distance_m = 0.075 }
pass = [{ quantity = "left", at_most = 0 }]
[mode.quick]
scene = { particle_distance_m = 0.075, end_time_s = 0.03 }
paired = { rounds = 6, windows = [2], warmup_steps = 0, steps = 1 }
observed = { rounds = 1 }
[mode.default]
paired = { rounds = 1, windows = [2], warmup_steps = 0, steps = 1 }
observed = { rounds = 1 }
[mode.full]
paired = { rounds = 1, windows = [2], warmup_steps = 0, steps = 1 }
observed = { rounds = 1 }
"#;

/// What a foreign run folder may say.
pub const TITLE: &str = "=cmd|' /C calc'!A0 <script>alert(\"x\")</script> $(touch /tmp/x) 水柱崩壊";
pub const REASON: &str = "＝1+1,\"0,5\"\n;=HYPERLINK(\"http://example.org\") _x0041_ \u{1}";
pub const COMMIT: &str = "12345e67";
pub const ALIAS: &str = "1-2";

/// The run that all tests doctor copies of.
static RUN: LazyLock<PathBuf> = LazyLock::new(|| {
    let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("export-run");
    let _ = fs::remove_dir_all(&place);
    fs::create_dir_all(&place).unwrap();
    let (file, folder) = (place.join("small.toml"), place.join("run"));
    fs::write(&file, EXPERIMENT).unwrap();
    let (file, output) = (file.to_str().unwrap(), folder.to_str().unwrap());
    let done = repro(&["run", file, "--quick", "--alias", "small", "--output", output]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    folder
});

pub fn repro(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_repro")).args(arguments).output().unwrap()
}

/// Exit code, what was printed and what was complained of.
pub fn export(run: &Path, flags: &[&str]) -> (Option<i32>, String, String) {
    let output = repro(&[&["export", run.to_str().unwrap()], flags].concat());
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

/// Rewrites a JSON file.
pub fn change(path: &Path, change: impl FnOnce(&mut Value)) {
    let mut value: Value = serde_json::from_slice(&fs::read(path).unwrap()).unwrap();
    change(&mut value);
    fs::write(path, serde_json::to_vec(&value).unwrap()).unwrap();
}

/// A copy of the run in `place`, as an experiment of that id, with names and texts that no honest run has.
pub fn hostile_run(place: &Path, id: &str) -> PathBuf {
    let folder = place.join("run");
    fs::create_dir_all(folder.join("rounds")).unwrap();
    for name in ["run.json", "machine.json"] {
        fs::copy(RUN.join(name), folder.join(name)).unwrap();
    }
    for entry in fs::read_dir(RUN.join("rounds")).unwrap().flatten() {
        let name = entry.file_name().into_string().unwrap().replace("small", id);
        let path = folder.join("rounds").join(name);
        fs::copy(entry.path(), &path).unwrap();
        change(&path, |round| round["experiment"] = id.into());
    }
    change(&folder.join("run.json"), |info| {
        info["experiments"][0]["id"] = id.into();
        info["experiments"][0]["title"] = TITLE.into();
        info["commit"] = COMMIT.into();
        info["machine_alias"] = ALIAS.into();
    });
    change(&folder.join(format!("rounds/{id}-paired-005.json")), |round| {
        let trial = &mut round["trials"][0];
        trial["status"] = "failed".into();
        trial["reason"] = REASON.into();
        trial["outcome"] = Value::Null;
    });
    folder
}

/// A CSV file as text.
pub struct Table {
    pub header: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

pub fn read_csv(path: &Path, delimiter: u8) -> Table {
    let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let bytes = bytes.strip_prefix("\u{FEFF}".as_bytes()).unwrap_or(&bytes);
    let mut reader = csv::ReaderBuilder::new().delimiter(delimiter).from_reader(bytes);
    let texts = |record: &csv::StringRecord| record.iter().map(String::from).collect::<Vec<String>>();
    let header = texts(reader.headers().unwrap());
    Table { header, rows: reader.records().map(|record| texts(&record.unwrap())).collect() }
}

impl Table {
    pub fn column(&self, name: &str) -> Vec<&str> {
        let place = self.header.iter().position(|column| column == name).unwrap();
        self.rows.iter().map(|row| row[place].as_str()).collect()
    }

    pub fn cell(&self, row: usize, name: &str) -> &str {
        self.column(name)[row]
    }
}
