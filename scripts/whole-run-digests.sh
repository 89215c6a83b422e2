#!/usr/bin/env bash
# Four whole runs of the paper's scene, each with another search, thread count, schedule, distance test or storage: all
# must end in the state that experiments/digests.toml names. Takes about eight minutes on two cores.
#
# usage: [TIMINGS=file.csv] scripts/whole-run-digests.sh            (after `cargo build --release`)
# TIMINGS: where to leave the phases of the first run: the linked list on one thread with the squared distance test.
set -euo pipefail
cd "$(dirname "$0")/.."
expected=$(grep -A4 'particle_distance_m = 0.01875' experiments/digests.toml | sed -n 's/^digest = "\(.*\)"/\1/p')
run() {
    found=$(target/release/repro simulate dam-break "$@" 2>/dev/null | sed -n 's/^digest //p')
    echo "$found  $*"
    [ "$found" = "$expected" ] || { echo "expected $expected"; exit 1; }
}
run --preset paper-linked-list --threads 1 --distance-test squared ${TIMINGS:+--timings "$TIMINGS"}
run --preset paper-linked-list --threads 2 --schedule static --storage csr
run --preset paper-aos-relocation --threads 1 --schedule guided:16 --distance-test squared --cg serial
run --preset paper-aos-relocation --threads 3 --schedule rayon:4096
