#!/usr/bin/env bash
# Tests runs on a cluster against a Slurm of this one machine. Says so and succeeds where Slurm is not installed
# (Debian: apt-get install slurm-wlm).
set -euo pipefail
cd "$(dirname "$0")/.."
PATH=$PATH:/usr/sbin:/sbin
for program in slurmctld slurmd sbatch squeue scancel scontrol; do
    if ! command -v "$program" >/dev/null; then
        echo "skipped: Slurm is not installed ($program is missing)" >&2
        exit 0
    fi
done
cargo test --release --test slurm
