#!/usr/bin/env bash
# Runs one experiment with two builds of this program and compares them: a portable one, for any processor of the
# architecture, and one for the processor of this machine. The flags stand among the facts of each run (`rustflags`).
#
# usage: scripts/target-cpu.sh FOLDER EXPERIMENT [--quick | --full]
# FOLDER: gets the run folders `portable` and `native` and the comparison, `compare`.
# The builds lie in target/target-cpu-portable and target/target-cpu-native, each three to four minutes at first. The two
# runs follow one another, so compare ratios; seconds also hold what else the machine did meanwhile.
set -euo pipefail
project="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"

if ! { [ "$#" -eq 2 ] || { [ "$#" -eq 3 ] && [[ "$3" =~ ^--(quick|full)$ ]]; }; }; then
  sed -n 's/^# usage: /usage: /p' "${BASH_SOURCE[0]}" >&2
  exit 2
fi
folder=$1 experiment=$2
shift 2

# Flags that are set around this script would end up in both builds, or win over the ones below.
unset CARGO_ENCODED_RUSTFLAGS CARGO_BUILD_RUSTFLAGS
declare -A flags=([portable]='' [native]='-C target-cpu=native')
program() { printf '%s/target/target-cpu-%s/release/repro' "$project" "$1"; }

for target in portable native; do
  (cd "$project" && RUSTFLAGS="${flags[$target]}" cargo build --release --target-dir "target/target-cpu-$target")
done
for target in portable native; do
  "$(program "$target")" run "$experiment" "$@" --alias "$target" --output "$folder/$target"
done
"$(program portable)" compare "$folder/portable" "$folder/native" --output "$folder/compare"
