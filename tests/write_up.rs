//! The committed write-up is the one that the reference run gives.

#![cfg(feature = "driver")]

use std::fs;
use std::path::Path;

use repro::report::measured::Measured;
use repro::report::write_up;

#[test]
fn the_committed_write_up_is_the_reference_runs() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let measured = Measured::read(&root.join("results/reference")).unwrap();
    let committed = fs::read_to_string(root.join("paper/reproduction.md")).unwrap();
    let again = "repro report results/reference --write-up paper/reproduction.md";
    assert!(committed == write_up::text(&measured).unwrap(), "out of date; write it anew: {again}");
}
