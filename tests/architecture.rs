//! What ARCHITECTURE.md promises about the code, read from the code.

use std::fs;
use std::path::{Path, PathBuf};

fn sources(folder: &str) -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src").join(folder);
    let mut found = Vec::new();
    let mut folders = vec![root];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = fs::read_to_string(&path).unwrap();
                // What tests do is theirs alone.
                let code = text.split("#[cfg(test)]\nmod tests").next().unwrap().to_string();
                found.push((path, code));
            }
        }
    }
    found
}

fn none_of(folder: &str, forbidden: &[&str], why: &str) {
    for (path, text) in sources(folder) {
        for word in forbidden {
            assert!(!text.contains(word), "{} uses `{word}`: {why}", path.display());
        }
    }
}

#[test]
fn imports_run_one_way() {
    let layers = ["base", "engine", "scene", "experiment", "report", "cli"];
    for (k, layer) in layers.iter().enumerate() {
        let above: Vec<String> = layers[k + 1..].iter().map(|l| format!("crate::{l}")).collect();
        let above: Vec<&str> = above.iter().map(String::as_str).collect();
        none_of(layer, &above, "a layer knows only those below it");
    }
}

#[test]
fn the_engine_knows_no_file_no_clock_and_no_format() {
    none_of("engine", &["std::fs", "std::path", "std::time", "serde", "std::env"], "it only moves particles");
}

#[test]
fn no_search_knows_an_effect_and_no_effect_another() {
    none_of("engine/search", &["engine::effects", "engine::pressure"], "a search supplies candidates");
    for name in ["gravity", "viscosity", "collision", "wall_contact"] {
        let own = format!("{name}.rs");
        for (path, text) in sources("engine/effects") {
            if path.ends_with(&own) || path.ends_with("mod.rs") {
                continue;
            }
            assert!(!text.contains(&format!("effects::{name}")), "{} knows {name}", path.display());
        }
    }
}

#[test]
fn only_the_command_line_prints() {
    for layer in ["base", "engine", "scene", "experiment", "report"] {
        none_of(
            layer,
            &["println!", "eprintln!", "print!(", "dbg!", "process::exit"],
            "only cli and main print",
        );
    }
}

#[test]
fn unsafe_code_stands_in_few_small_modules() {
    // Disjoint rows, a hint, advice about pages, and the call of what is compiled for instructions that were just found to be there.
    let allowed = ["parallel.rs", "prefetch.rs", "large_pages.rs", "dispatch.rs", "simd.rs"];
    for (path, text) in sources("") {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let allowed = allowed.contains(&name.as_str());
        let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
        let uses = code.filter(|line| line.contains("unsafe")).count();
        assert!(allowed || uses == 0, "{} has unsafe code", path.display());
    }
}

#[test]
fn there_is_one_distance_test_and_one_walk() {
    let walks = |word: &str| {
        let searches = sources("engine").into_iter().filter(|(_, text)| text.contains(word));
        searches.map(|(path, _)| path.file_name().unwrap().to_string_lossy().into_owned()).collect::<Vec<_>>()
    };
    assert_eq!(walks("fn within("), ["mod.rs"]);
    assert_eq!(walks("fn for_each_neighbor"), ["mod.rs"]);
}
