//! Runs for a cluster, without one: what is handed to `sbatch`, and what tasks do, started by hand.

#![cfg(feature = "driver")]
#![cfg(unix)]

mod support;

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output};

use support::{BLOCKS, collect, essence, plain_run, repro, stderr, stdout, tiny};

/// A folder's name that a careless script would run, split or cut.
const HOSTILE: &str = "it's \"a\" $(touch owned) `touch owned`\n<script>;touch owned&%j é";

fn submit(experiment: Option<&Path>, folder: &Path, options: &[&str]) -> Output {
    let mut command = repro();
    command.arg("submit").args(experiment);
    command
        .args(["--slurm", "--quick", "--time", "5", "--output"])
        .arg(folder)
        .args(options)
        .output()
        .unwrap()
}

fn task(folder: &Path, block: Option<usize>) -> Output {
    repro().arg("task").arg(folder).args(block.map(|number| number.to_string())).output().unwrap()
}

fn runs(folder: &Path, block: Option<usize>, says: &str) {
    let output = task(folder, block);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stdout(&output).contains(says), "{}", stdout(&output));
}

/// A stand-in for `sbatch` that writes its arguments, each on a line after the call's number, with line ends made visible.
fn fake_sbatch(place: &Path) -> String {
    let bin = place.join("bin");
    fs::create_dir(&bin).unwrap();
    let script = "#!/bin/sh\necho call >> \"$CALLS\"\nfor word in \"$@\"; do printf '%s' \"$word\" | tr '\\n' '^' \
                  >> \"$CALLS\"; echo >> \"$CALLS\"; done\necho \"42;here\"\n";
    let path = bin.join("sbatch");
    fs::write(&path, script).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    format!("{}:{}", bin.display(), std::env::var("PATH").unwrap_or_default())
}

/// The calls that a stand-in wrote down, by word.
fn calls(file: &Path) -> Vec<Vec<String>> {
    let text = fs::read_to_string(file).unwrap();
    let calls = text.split("call\n").skip(1);
    calls.map(|call| call.lines().map(|line| line.replace('^', "\n")).collect()).collect()
}

#[test]
fn a_shell_reads_the_printed_commands_as_they_are_meant() {
    let place = tempfile::tempdir().unwrap();
    let experiment = tiny(place.path(), "an $(touch owned) 'experiment'.toml");
    let folder = place.path().canonicalize().unwrap().join(HOSTILE);
    let options = ["--max-array-size", "4", "--max-parallel", "2", "--partition", "a b$(touch owned)"];
    let output = submit(Some(&experiment), &folder, &options);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let (path, file) = (fake_sbatch(place.path()), place.path().join("calls"));
    let mut shell = Command::new("sh");
    let shell = shell.arg("-c").arg(stdout(&output)).current_dir(place.path());
    let ran = shell.env("PATH", path).env("CALLS", &file).output().unwrap();
    assert!(ran.status.success(), "{}", stderr(&ran));

    let calls = calls(&file);
    let name = folder.to_str().unwrap();
    let has = |call: &[String], word: &str| assert!(call.iter().any(|w| w == word), "{word}: {call:?}");
    assert_eq!(calls.len(), 3, "a first job and five blocks as arrays of four: {calls:?}");
    for call in &calls {
        has(call, "--partition=a b$(touch owned)");
        has(call, name);
        assert!(
            call.iter()
                .any(|word| word.starts_with(&format!("--output={}/slurm/logs/", name.replace('%', "%%"))))
        );
    }
    for (call, list, offset) in [(&calls[1], "--array=0-3%2", "0"), (&calls[2], "--array=0%2", "4")] {
        has(call, list);
        has(call, "--dependency=afterok:42");
        has(call, &format!("{name}/slurm/block.sh"));
        assert_eq!(call.last().unwrap(), offset);
    }
    let left: Vec<_> = fs::read_dir(place.path()).unwrap().flatten().map(|entry| entry.file_name()).collect();
    assert!(!left.iter().any(|name| name == "owned"), "something in a name was run: {left:?}");
}

#[test]
fn a_submission_is_refused_where_it_cannot_be_meant() {
    let place = tempfile::tempdir().unwrap();
    let experiment = tiny(place.path(), "tiny.toml");
    let folder = place.path().join("run");
    let refused = |output: Output, word: &str| {
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(word), "{}", stderr(&output));
    };
    refused(submit(None, &folder, &[]), "nothing was submitted");
    refused(collect(&folder), "nothing was submitted");
    assert!(submit(Some(&experiment), &folder, &[]).status.success());
    refused(submit(Some(Path::new("table2")), &folder, &[]), "other experiments");
    let foreign = place.path().join("foreign");
    fs::create_dir(&foreign).unwrap();
    fs::write(foreign.join("thesis.tex"), "mine").unwrap();
    refused(submit(Some(&experiment), &foreign, &[]), "no run's");
    assert_eq!(fs::read_dir(&foreign).unwrap().count(), 1);
    let nowhere = repro()
        .args(["submit", "--slurm", "--now", "--output"])
        .arg(&folder)
        .env("PATH", "/nonexistent")
        .output()
        .unwrap();
    refused(nowhere, "is not installed");
    let output = collect(&folder);
    assert_eq!(
        output.status.code(),
        Some(5),
        "nothing is measured before the first job: {}",
        stderr(&output)
    );
}

#[test]
fn tasks_in_any_order_end_like_a_plain_run() {
    let place = tempfile::tempdir().unwrap();
    let experiment = tiny(place.path(), "tiny.toml");
    let (plain, folder) = (place.path().join("plain"), place.path().join("spread"));
    plain_run(&experiment, &plain);
    assert!(submit(Some(&experiment), &folder, &[]).status.success());
    fs::remove_file(&experiment).unwrap();

    assert_ne!(task(&folder, Some(3)).status.code(), Some(0), "no block runs before the first job");
    runs(&folder, None, "the states are there");
    runs(&folder, None, "the states are there");
    runs(&folder, Some(0), "was there already");
    for block in [3, 1] {
        runs(&folder, Some(block), "is recorded");
    }
    let output = collect(&folder);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    for missing in ["tiny paired 0\n", "tiny observed 0\n", "missing are 2 of 5"] {
        assert!(stdout(&output).contains(missing), "{}", stdout(&output));
    }
    let page = fs::read_to_string(folder.join("report.md")).unwrap();
    assert!(
        page.contains("missing are the rounds tiny paired 0; tiny observed 0."),
        "the report says so, too"
    );

    let again = submit(None, &folder, &[]);
    let commands = stdout(&again);
    assert!(
        commands.contains("--array=2,4") && !commands.contains("first.sh"),
        "{commands}{}",
        stderr(&again)
    );
    fs::remove_dir_all(folder.join("states")).unwrap();
    assert!(stdout(&submit(None, &folder, &[])).contains("first.sh"), "lost states are made again");
    runs(&folder, None, "the states are there");
    for block in [2, 4] {
        runs(&folder, Some(block), "is recorded");
    }
    let output = collect(&folder);
    assert_eq!(output.status.code(), Some(0), "{}{}", stdout(&output), stderr(&output));
    assert_eq!(essence(&folder), essence(&plain));
    assert!(!folder.join("states").exists() && !folder.join("slurm/locks").exists());
    assert!(stderr(&submit(None, &folder, &[])).contains("nothing is missing"));
    for name in BLOCKS {
        assert!(folder.join(format!("rounds/tiny-{name}.json")).is_file(), "{name}");
    }
}

#[test]
fn another_machine_and_another_process_are_kept_out() {
    let place = tempfile::tempdir().unwrap();
    let experiment = tiny(place.path(), "tiny.toml");
    let folder = place.path().join("run");
    assert!(submit(Some(&experiment), &folder, &[]).status.success());
    runs(&folder, None, "the states are there");

    let shared = fs::File::options().read(true).open(folder.join(".lock")).unwrap();
    shared.lock_shared().unwrap();
    let plain =
        repro().arg("run").arg(&experiment).args(["--quick", "--output"]).arg(&folder).output().unwrap();
    assert_eq!(plain.status.code(), Some(2), "nobody has the folder alone while tasks work");
    assert!(stderr(&plain).contains("another process"), "{}", stderr(&plain));
    let locks = folder.join("slurm/locks");
    fs::create_dir_all(&locks).unwrap();
    let claimed = fs::File::create(locks.join("tiny-paired-000.lock")).unwrap();
    claimed.lock().unwrap();
    runs(&folder, Some(2), "by another task");
    assert!(!folder.join("rounds/tiny-paired-000.json").exists());
    drop((shared, claimed));

    let path = folder.join("run.json");
    let text = fs::read_to_string(&path).unwrap();
    let (id, machine) = (field(&text, "plan_id"), field(&text, "machine_id"));
    fs::write(&path, text.replace(&id, "0123456789abcdef").replace(&machine, "000000000000")).unwrap();
    for block in [None, Some(2)] {
        let output = task(&folder, block);
        assert_eq!(output.status.code(), Some(4), "{}", stderr(&output));
        assert!(stderr(&output).contains("machine is refused") && stderr(&output).contains("000000000000"));
    }
    assert!(!folder.join("rounds/tiny-paired-000.json").exists());
}

#[test]
fn a_record_of_something_else_is_refused() {
    let place = tempfile::tempdir().unwrap();
    let experiment = tiny(place.path(), "tiny.toml");
    let folder = place.path().join("run");
    assert!(submit(Some(&experiment), &folder, &[]).status.success());
    runs(&folder, None, "the states are there");
    runs(&folder, Some(1), "is recorded");
    let path = folder.join("rounds/tiny-whole-001.json");
    let text = fs::read_to_string(&path).unwrap();
    let digest = field(&text, "digest");
    let doctored = [
        (text.replace(&digest, &"0".repeat(32)), "computed something else"),
        (text.replacen("\"position\":0", "\"position\":7", 1), "trial 0 is not the plan's"),
        (text[..text.len() / 2].to_string(), "not a round's record"),
    ];
    for (text, reason) in doctored {
        fs::write(&path, text).unwrap();
        let output = collect(&folder);
        assert_eq!(output.status.code(), Some(3), "{}", stdout(&output));
        let text = stderr(&output);
        assert!(text.contains("tiny-whole-001.json") && text.contains(reason), "{text}");
        assert!(text.contains("remove the file"), "the way out: {text}");
    }
}

/// The first value of a text field in a JSON file.
fn field(text: &str, name: &str) -> String {
    let rest = text.split_once(&format!("\"{name}\"")).unwrap().1;
    rest.split('"').nth(1).unwrap().to_string()
}
