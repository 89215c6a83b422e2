//! The page as a reader's browser shows it: silent, alone, sortable, and no wider than a phone.
//!
//! Where no Chromium is installed, only what can be read from the file is tested.

#![cfg(feature = "driver")]

#[path = "common/small_run.rs"]
mod small_run;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use small_run::{copy, repro, text};

/// The reference run's page, rendered by this program.
fn page(place: &Path) -> PathBuf {
    let folder = place.join("run");
    copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("results/reference"), &folder);
    let done = repro(&["report", folder.to_str().unwrap()]);
    assert!(done.status.success(), "{}", text(&done.stderr));
    folder.join("report.html")
}

#[test]
fn the_page_is_whole_without_a_script_and_says_what_its_figures_show() {
    let place = tempfile::tempdir().unwrap();
    let html = fs::read_to_string(page(place.path())).unwrap();
    let count = |words: &str| html.matches(words).count();
    let figures = fs::read_dir(place.path().join("run/figures")).unwrap().flatten();
    let figures = figures.filter(|file| file.path().extension().is_some_and(|e| e == "svg")).count();
    assert!(figures > 5 && count("<svg ") == figures);
    assert_eq!(count("role=\"img\" aria-label=\""), figures);
    assert!(
        count("<desc>") == figures && !html.contains("aria-label=\"\"") && !html.contains("<desc></desc>")
    );
    assert!(count("<table>") > figures && count("<caption>") == count("<table>"));
    assert_eq!(count("<button"), 0, "what only a script can do is added by the script");
    assert!(
        !html.contains("src=\"") && !html.contains("@import") && !html.contains("url("),
        "nothing is loaded"
    );
    let positions =
        ["id=\"claims\"", "id=\"table2\"", "id=\"figure4\"", "id=\"repeating\"", "id=\"machine\""];
    let positions = positions.map(|id| html.find(id).unwrap());
    assert!(positions.is_sorted(), "{positions:?}");
    for (id, _) in
        html.match_indices("href=\"#").map(|(at, start)| html[at + start.len()..].split_once('"').unwrap())
    {
        assert_eq!(count(&format!("id=\"{id}\"")), 1, "{id}");
    }
}

/// What a browser makes of a page.
struct Seen {
    dom: String,
    console: Vec<String>,
    /// Everything that was asked of a network.
    requests: Vec<String>,
}

/// Opens a page; `None` where no browser is installed.
fn browse(page: &Path, flags: &[&str]) -> Option<Seen> {
    let place = tempfile::tempdir().unwrap();
    let log = place.path().join("net.json");
    let named = std::env::var("CHROMIUM").ok();
    let names = named.iter().map(String::as_str).chain(["chromium", "chromium-browser", "google-chrome"]);
    let output = names.into_iter().find_map(|name| {
        Command::new(name)
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-extensions"])
            .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
            .arg("--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1")
            .args(["--enable-logging=stderr", "--v=0", "--virtual-time-budget=3000", "--dump-dom"])
            .arg(format!("--user-data-dir={}", place.path().join("profile").display()))
            .arg(format!("--log-net-log={}", log.display()))
            .args(flags)
            .arg(format!("file://{}", page.display()))
            .output()
            .ok()
    });
    let Some(output) = output else {
        eprintln!("skipped: no Chromium is installed (apt-get install chromium)");
        return None;
    };
    Some(Seen {
        dom: text(&output.stdout),
        console: text(&output.stderr)
            .lines()
            .filter(|line| line.contains("CONSOLE"))
            .map(String::from)
            .collect(),
        requests: requests(&fs::read_to_string(log).unwrap()),
    })
}

/// What a page asked for, in the browser's log of its network. The browser's own calls home have another key.
fn requests(log: &str) -> Vec<String> {
    let log: Value = serde_json::from_str(log).unwrap();
    let events = log["events"].as_array().unwrap().iter().map(|event| &event["params"]);
    let of_page =
        events.filter(|p| p["network_isolation_key"].as_str().is_some_and(|k| k.starts_with("file:")));
    of_page.filter_map(|params| params["url"].as_str()).map(String::from).collect()
}

/// The page with `extra` at its end, and with or without its policy.
fn changed(page: &Path, name: &str, extra: &str, with_policy: bool) -> PathBuf {
    let html = fs::read_to_string(page).unwrap().replace("</body>", &format!("{extra}</body>"));
    let policy = "Content-Security-Policy";
    let html = if with_policy { html } else { html.replace(policy, "X-None") };
    let changed = page.with_file_name(name);
    fs::write(&changed, html).unwrap();
    changed
}

#[test]
fn a_browser_has_nothing_to_complain_of_and_asks_nobody() {
    let place = tempfile::tempdir().unwrap();
    let page = page(place.path());
    let Some(seen) = browse(&page, &[]) else { return };
    assert_eq!(seen.console, Vec::<String>::new());
    assert_eq!(seen.requests, Vec::<String>::new());
    assert!(seen.dom.contains("aria-sort=\"none\""), "the page's own script ran");

    // Markup that had slipped in could not run or ask for anything either; without the policy both would be seen here.
    let extra = "<img src=\"http://127.0.0.1:9/pixel.png\"><script>document.body.id = \"taken\"</script>";
    let held = browse(&changed(&page, "held.html", extra, true), &[]).unwrap();
    assert!(
        held.console.len() >= 2 && held.console[0].contains("Content Security Policy"),
        "{:?}",
        held.console
    );
    assert!(held.requests.is_empty() && !held.dom.contains("id=\"taken\""), "{:?}", held.requests);
    let free = browse(&changed(&page, "free.html", extra, false), &[]).unwrap();
    assert!(free.requests.iter().any(|url| url.contains("127.0.0.1:9")) && free.dom.contains("id=\"taken\""));
}

/// What came of pressing the buttons that `page.js` presses.
fn pressed(page: &Path, flags: &[&str]) -> Option<Value> {
    let press = format!("<script>{}</script>", include_str!("page.js"));
    let seen = browse(&changed(page, "pressed.html", &press, false), flags)?;
    let json = seen.dom.split("RESULT").nth(1).unwrap_or_else(|| panic!("{:?}", seen.console));
    let json = json.replace("&amp;", "&").replace("&lt;", "<").replace("&gt;", ">");
    Some(serde_json::from_str(&json).unwrap())
}

fn strings(value: &Value) -> Vec<String> {
    value.as_array().unwrap().iter().map(|cell| cell.as_str().unwrap().to_string()).collect()
}

#[test]
fn tables_are_sorted_and_copied() {
    let place = tempfile::tempdir().unwrap();
    let page = page(place.path());
    let Some(result) = pressed(&page, &["--window-size=1280,900"]) else { return };
    assert_eq!(result["sortable"], true);
    assert_eq!(result["copyable"], result["tables"]);
    assert_eq!(result["sorted"], 1, "a table is sorted by one column at a time");
    for table in ["effort", "intervals", "words"] {
        let (before, after) = (strings(&result[table]["before"]), &result[table]["after"]);
        let orders: Vec<&str> = (0..3).map(|k| after[k]["order"].as_str().unwrap()).collect();
        assert_eq!(orders, ["ascending", "descending", "none"]);
        assert_eq!(strings(&after[2]["cells"]), before, "the third press brings the first order back");
        assert_eq!(after[2]["first"], result[table]["names"], "rows move as a whole");
        let mut expected = before.clone();
        match table {
            "words" => expected.sort_by_key(|cell| cell.to_lowercase()),
            _ => {
                let number = |cell: &String| cell.split(' ').next().unwrap().parse::<f64>().unwrap();
                assert!(before.iter().map(number).all(f64::is_finite) && before.len() > 3);
                expected.sort_by(|a, b| number(a).total_cmp(&number(b)));
            }
        }
        assert_ne!(expected, before, "{table} was sorted already");
        assert_eq!(strings(&after[0]["cells"]), expected, "{table}");
        let lowest_last: Vec<String> = strings(&after[1]["cells"]);
        assert_eq!(lowest_last.last(), expected.first());
    }
    let copied = result["copied"].as_str().unwrap();
    let lines: Vec<&str> = copied.lines().collect();
    assert!(
        lines[0] == "\tCG\toutside CG\ttotal" && lines[1] == "paper: linked list\t25.4 s\t128.5 s\t154.0 s",
        "{copied}"
    );
    assert!(lines.iter().all(|line| line.matches('\t').count() == 3), "{copied}");
}

#[test]
fn a_phone_and_the_dark_have_the_same_page() {
    let place = tempfile::tempdir().unwrap();
    let page = page(place.path());
    let Some(phone) = pressed(&page, &["--window-size=390,844"]) else { return };
    let (wide, window) = (phone["wide"].as_u64().unwrap(), phone["window"].as_u64().unwrap());
    assert!(
        window <= 500 && wide <= window,
        "{wide} in {window}: only tables and figures are pushed sideways"
    );
    assert_eq!((&phone["dark"], &phone["ground"]), (&Value::Bool(false), &Value::from("rgb(255, 255, 255)")));
    let dark = pressed(&page, &["--blink-settings=preferredColorScheme=0"]).unwrap();
    assert_eq!((&dark["dark"], &dark["ground"]), (&Value::Bool(true), &Value::from("rgb(20, 24, 28)")));
}
