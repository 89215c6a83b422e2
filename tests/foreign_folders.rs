//! Run folders from anywhere: what is doctored is refused by file, place and reason, and nothing in them is followed, run or
//! taken for markup.

#![cfg(feature = "driver")]

#[path = "common/small_run.rs"]
mod small_run;

use std::fs::{self, File};
use std::path::Path;

use serde_json::{Value, json};

use small_run::{EXPERIMENT, copied, copy, edit, files, repro, run, text};

const ROUND: &str = "rounds/small-paired-002.json";

/// A copy of a run, doctored, is refused by `report` and `compare`, which both say all of `words`.
fn refused(run: &Path, doctor: impl FnOnce(&Path), words: &[&str]) {
    let place = tempfile::tempdir().unwrap();
    let copied = place.path().join("copied");
    copy(run, &copied);
    doctor(&copied);
    let (run, copied) = (run.to_str().unwrap(), copied.to_str().unwrap());
    for arguments in [vec!["report", copied], vec!["compare", run, copied]] {
        let output = repro(&arguments);
        let complaint = text(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{words:?}: {complaint}{}", text(&output.stdout));
        for word in words {
            assert!(complaint.contains(word), "no `{word}` in: {complaint}");
        }
        assert!(complaint.len() < 1000 && complaint.lines().count() == 1, "{complaint}");
    }
}

/// The copy's round with one change to its first trial.
fn trial(change: impl FnOnce(&mut Value)) -> impl FnOnce(&Path) {
    move |folder| edit(&folder.join(ROUND), |round| change(&mut round["trials"][0]))
}

/// The same to the first step that it measured.
fn step(key: &'static str, value: Value) -> impl FnOnce(&Path) {
    trial(move |trial| trial["outcome"]["samples"][0][0]["steps"][0][key] = value)
}

fn replace(folder: &Path, file: &str, from: &str, to: &str) {
    let old = fs::read_to_string(folder.join(file)).unwrap();
    assert!(old.contains(from), "{file} has no {from}");
    fs::write(folder.join(file), old.replacen(from, to, 1)).unwrap();
}

#[test]
fn files_that_are_no_records_are_refused_where_they_go_wrong() {
    let place = tempfile::tempdir().unwrap();
    let run = &copied(place.path(), "one");
    for file in ["run.json", "machine.json", ROUND] {
        let halve = |folder: &Path| {
            let whole = fs::read(folder.join(file)).unwrap();
            fs::write(folder.join(file), &whole[..whole.len() / 2]).unwrap();
        };
        refused(run, halve, &[file, "line ", "column ", "EOF"]);
        let age = |folder: &Path| edit(&folder.join(file), |value| value["schema_version"] = json!(99));
        refused(run, age, &[file, "schema_version is 99; this program reads"]);
        let nest = |folder: &Path| fs::write(folder.join(file), "[".repeat(1_000_000)).unwrap();
        refused(run, nest, &[file, "line 1"]);
        let enlarge = |folder: &Path| File::create(folder.join(file)).unwrap().set_len(10 << 30).unwrap();
        refused(run, enlarge, &[file, "more than the 268435456 bytes"]);
        let garble = |folder: &Path| fs::write(folder.join(file), b"{\"schema_version\": 2, \"\xff").unwrap();
        refused(run, garble, &[file, "line 1, column"]);
    }
    let remove = |folder: &Path| fs::remove_file(folder.join("machine.json")).unwrap();
    refused(run, remove, &["cannot read", "machine.json"]);
    let more =
        |folder: &Path| replace(folder, ROUND, "\"round\":2", "\"round\":2,\"</script>\":\"\\u001b[2J\"");
    refused(run, more, &[ROUND, "unknown field"]);
}

#[test]
fn numbers_that_cannot_be_are_refused() {
    let place = tempfile::tempdir().unwrap();
    let run = &copied(place.path(), "one");
    let at_first = "trial at position 0";
    let set = |to: &'static str| {
        move |folder: &Path| {
            let file = folder.join(ROUND);
            let text = fs::read_to_string(&file).unwrap();
            let (before, after) = text.split_once("\"total_s\":").unwrap();
            let (_, rest) = after.split_once(',').unwrap();
            fs::write(file, format!("{before}\"total_s\":{to},{rest}")).unwrap();
        }
    };
    for not_a_number in ["NaN", "Infinity", "1e999", "null", "\"fast\""] {
        refused(run, set(not_a_number), &[ROUND, "line 1, column "]);
    }
    refused(run, step("total_s", json!(-1.0)), &[ROUND, "cannot be"]);
    refused(run, step("total_s", json!(1e-300)), &[ROUND, at_first, "step 3", "cannot be"]);
    refused(
        run,
        step("total_s", json!(1e300)),
        &[ROUND, at_first, "step 3: total_s", "allowed are 0 to 1e9"],
    );
    refused(run, step("cg_s", json!(1e6)), &[ROUND, at_first, "step 3: 1e6 s in CG of"]);
    refused(run, step("step", json!(7)), &[ROUND, at_first, "step 7 stands where 3 should"]);
    refused(run, trial(|t| t["wall_s"] = json!(-5)), &[ROUND, at_first, "wall_s is -5e0"]);
    let outcome = |key: &'static str, value: Value| trial(move |trial| trial["outcome"][key] = value);
    refused(run, outcome("particles", json!(0)), &[ROUND, at_first, "among 0 cannot be"]);
    refused(run, outcome("bytes", json!([])), &[ROUND, at_first, "bytes of 0"]);
    refused(run, outcome("samples", json!([])), &[ROUND, "samples of 0 variants"]);
    let observed = "rounds/small-observed-000.json";
    let stepping = |folder: &Path| {
        edit(&folder.join(observed), |round| round["trials"][0]["observation"]["stepping_s"] = json!(-1));
    };
    refused(run, stepping, &[observed, "stepping_s is -1e0"]);
    let cores = |folder: &Path| edit(&folder.join("run.json"), |info| info["usable_cores"] = json!(64_000));
    refused(run, cores, &["run.json", "usable_cores is 64000"]);
}

#[test]
fn rounds_that_do_not_fit_their_plan_are_refused() {
    let place = tempfile::tempdir().unwrap();
    let run = &copied(place.path(), "one");
    let round = |change: fn(&mut Value)| move |folder: &Path| edit(&folder.join(ROUND), change);
    let twice = round(|round| {
        let mut again = round["trials"][0].clone();
        again["position"] = json!(1);
        round["trials"].as_array_mut().unwrap().push(again);
    });
    refused(run, twice, &[ROUND, "position 1", "there twice"]);
    let position = round(|round| round["trials"][0]["position"] = json!(7));
    refused(run, position, &[ROUND, "position 7", "each once"]);
    let none = round(|round| round["trials"] = json!([]));
    refused(run, none, &[ROUND, "1 planned trials are missing"]);
    refused(run, trial(|t| t["variants"][0]["preset"] = json!("magic")), &[ROUND, "not planned"]);
    refused(run, trial(|t| t["threads"] = json!(32)), &[ROUND, "on 32 thread(s) is not planned"]);
    refused(run, trial(|t| t["subject"] = json!("<b>")), &[ROUND, "\"<b>\"", "not planned"]);
    refused(
        run,
        trial(|t| t["status"] = json!("failed")),
        &[ROUND, "`failed`", "may not have these results"],
    );
    let window = |t: &mut Value| t["outcome"]["samples"][1][0]["window"]["start_step"] = json!(1);
    refused(run, trial(window), &[ROUND, "not those of the trial's other variants"]);

    let gap = |folder: &Path| fs::remove_file(folder.join(ROUND)).unwrap();
    refused(run, gap, &[ROUND, "is missing, though the run is finished"]);
    let copied = |to: &'static str| {
        move |folder: &Path| {
            fs::create_dir_all(folder.join("rounds/more")).unwrap();
            fs::copy(folder.join(ROUND), folder.join(to)).unwrap();
        }
    };
    refused(run, copied("rounds/small-paired-0002.json"), &["another round than its name says"]);
    refused(run, copied("rounds/more/small-paired-002.json"), &["not where it belongs"]);
}

#[test]
fn names_lead_nowhere() {
    let place = tempfile::tempdir().unwrap();
    let run = &copied(place.path(), "one");
    for (name, words) in [
        ("../small", "not where it belongs"),
        ("/tmp/small", "not where it belongs"),
        ("other", "another round than its name says"),
    ] {
        refused(
            run,
            |folder| edit(&folder.join(ROUND), |round| round["experiment"] = json!(name)),
            &[ROUND, words],
        );
    }
    for name in ["../../small", "/etc/passwd", "a/b", "", "<script>", "a\nb", "$(touch pwned)"] {
        let rename =
            |folder: &Path| edit(&folder.join("run.json"), |i| i["experiments"][0]["id"] = json!(name));
        refused(run, rename, &["run.json", "`id`", "lower-case letters"]);
    }
    let twice = |folder: &Path| {
        edit(&folder.join("run.json"), |info| {
            let again = info["experiments"][0].clone();
            info["experiments"].as_array_mut().unwrap().push(again);
        });
    };
    refused(run, twice, &["run.json", "`small` is there twice"]);
    let explode = |folder: &Path| {
        edit(&folder.join("run.json"), |info| {
            let many: Vec<String> = (1..1000).map(|chunk| format!("dynamic:{chunk}")).collect();
            let factors = &mut info["experiments"][0]["factors"][0];
            factors["schedule"] = json!(many);
            factors["storage"] = json!(vec!["ell"; 1000]);
        });
    };
    refused(run, explode, &["run.json", "factors[0]", "combinations"]);
}

#[cfg(unix)]
#[test]
fn links_are_neither_read_nor_written_through() {
    use std::os::unix::fs::symlink;
    let place = tempfile::tempdir().unwrap();
    let run = &copied(place.path(), "one");
    let outside = place.path().join("outside");
    fs::create_dir(&outside).unwrap();
    for file in ["run.json", "machine.json", ROUND, "report.html", "rounds", "figures", "tables"] {
        let link = |folder: &Path| {
            let (inside, target) = (folder.join(file), outside.join(file.replace('/', "-")));
            // What the link names is a good file or folder: only that it is a link is wrong.
            fs::rename(&inside, &target).unwrap();
            symlink(&target, &inside).unwrap();
        };
        refused(run, link, &[file, "symbolic link"]);
    }
    let before = files(&outside);
    let dangling = |folder: &Path| symlink(outside.join("new"), folder.join("notes")).unwrap();
    refused(run, dangling, &["notes", "symbolic link"]);
    assert_eq!(files(&outside), before, "nothing was written outside");

    // The same folder is no place for a run to go on in.
    fs::remove_file(run.join("manifest.sha256")).unwrap();
    symlink(&outside, run.join("states")).unwrap();
    let file = place.path().join("one.toml");
    let arguments = ["run", file.to_str().unwrap(), "--quick", "--output", run.to_str().unwrap()];
    let output = repro(&arguments);
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("states: is a symbolic link"), "{}", text(&output.stderr));
}

/// What others wrote reaches pages, tables, figures and archives as text.
#[test]
fn names_of_others_are_text_everywhere() {
    const HOSTILE: &str = "</title></svg><script>alert(1)</script><img src=x onerror=alert(2)> 'q' \\\"d\\\" $(touch pwned) \
                           `rm` | =1+1 ![x](http://x.invalid) 粒子";
    let place = tempfile::tempdir().unwrap();
    let mut experiment = EXPERIMENT.to_string();
    for word in ["TITLE", "QUESTION", "ANALYSIS", "CASE"] {
        experiment = experiment.replace(word, &format!("{word} {HOSTILE}\\n# line {{{{ 7 * 7 }}}}"));
    }
    let run = run(place.path(), "one", &experiment);
    let hostile = HOSTILE.replace("\\\"", "\"") + "\n\u{1b}[2J]: http://x.invalid";
    edit(&run.join("run.json"), |info| {
        for key in
            ["run_id", "command", "machine_alias", "machine_id", "commit", "source_hash", "created_utc"]
        {
            info[key] = json!(hostile);
        }
    });
    edit(&run.join("machine.json"), |machine| machine["facts"][0]["value"] = json!(hostile));
    edit(&run.join(ROUND), |round| {
        round["trials"][0]["status"] = json!("failed");
        round["trials"][0]["reason"] = json!(hostile);
        round["trials"][0]["outcome"] = Value::Null;
    });
    let (folder, zip) = (run.to_str().unwrap(), place.path().join("one.zip"));
    let write_up = place.path().join("write-up.md");
    let done = repro(&["report", folder, "--write-up", write_up.to_str().unwrap()]);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let done = repro(&["compare", folder, folder, "--output", place.path().join("both").to_str().unwrap()]);
    let printed = text(&done.stdout);
    assert!(!printed.contains('\u{1b}') && !printed.contains("<script"), "{printed}");
    let done = repro(&["archive", folder, "--output", zip.to_str().unwrap()]);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));

    let page = fs::read_to_string(run.join("report.html")).unwrap();
    assert_eq!(page.matches("<script").count(), 1, "the page's own");
    assert_eq!(page.matches("</title>").count(), 1 + page.matches("<svg").count());
    assert!(!page.contains("<img") && page.contains("{{ 7 * 7 }}"), "no markup, no template of theirs");
    assert!(page.contains("&lt;script&gt;alert(1)&lt;&#x2f;script&gt;") && page.contains("粒子"));
    let mut markdown = vec![run.join("report.md"), write_up];
    markdown.extend(files(&place.path().join("both")).into_iter().filter(|f| f.extension().unwrap() == "md"));
    for file in markdown {
        let text = fs::read_to_string(&file).unwrap();
        assert!(!text.contains("<script") && !text.contains("<img"), "{}", file.display());
        assert!(!text.contains("](http") && !text.contains('\u{1b}'), "{}", file.display());
    }
    assert!(!Path::new("pwned").exists() && !run.join("pwned").exists());
}
