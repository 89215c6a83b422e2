//! The data dictionary: every table and column that a run leaves, under the names that its own CSV files have, too.

use crate::report::export::column::{Column, Kind, Table};
use crate::report::export::sheet::Sheet;
use crate::report::export::value::Value;

const fn text(name: &'static str, description: &'static str) -> Column {
    Column { name, kind: Kind::Text, unit: "", description }
}

const fn time(name: &'static str, description: &'static str) -> Column {
    Column { name, kind: Kind::Time, unit: "", description }
}

const fn boolean(name: &'static str, description: &'static str) -> Column {
    Column { name, kind: Kind::Boolean, unit: "", description }
}

const fn integer(name: &'static str, unit: &'static str, description: &'static str) -> Column {
    Column { name, kind: Kind::Integer, unit, description }
}

const fn number(name: &'static str, unit: &'static str, description: &'static str) -> Column {
    Column { name, kind: Kind::Number, unit, description }
}

const fn any(name: &'static str, description: &'static str) -> Column {
    Column { name, kind: Kind::Any, unit: "", description }
}

/// Columns of several tables.
const SCHEMA_VERSION: Column = integer("schema_version", "1", "The version of the run folder's files.");
const RUN_ID: Column = text("run_id", "The run: the name of its folder when it was made.");
const MODE: Column =
    text("mode", "quick, default or full: how long the run might take; quick is not for citation.");
const EXPERIMENT: Column = text("experiment_id", "The experiment.");
const STAGE: Column =
    text("stage", "whole: one variant a process, all steps; paired: all variants of a group in lock step.");
const CELL: Column =
    text("cell_id", "The cell: experiment, stage, group, preset, settings that differ, threads.");
const ROUND: Column = integer("round", "1", "The round, from 0; it holds every cell of its stage once.");
const POSITION: Column =
    integer("position", "1", "The trial's place in the random order of its round, from 0.");
const OBSERVED_RUN: Column =
    text("observed_run", "The case or sweep, and the scheme or settings it ran with.");
const PRESET: Column = text("preset", "The neighbour search and what belongs to it.");
const DISTANCE_TEST: Column =
    text("distance_test", "sqrt takes the root of every candidate's distance; squared compares squares.");
const STORAGE: Column = text("storage", "How the matrix lies in memory: ell or csr.");
const CG_TOLERANCE: Column =
    number("cg_tolerance", "relative", "Residual over source at which the conjugate gradients stop.");
const THREADS_REQUESTED: Column = integer("threads_requested", "threads", "Threads asked for.");
const PARTICLES: Column = integer("particles", "particles", "Particles of the scene, walls included.");
const STATUS: Column =
    text("status", "ok, or why there is no value: failed, timeout, out_of_memory, skipped, not_applicable.");
const REASON: Column = text("reason", "What happened, unless the status is ok.");
const STARTED: Column = time("started_utc", "When the trial's process was started, UTC.");
const MACHINE_ID: Column = text("machine_id", "Stays the same as long as the machine's hardware does.");
const SOURCE_HASH: Column = text("source_hash", "Hash of the measured sources.");
const DIGEST: Column =
    text("digest", "Digest of the last state, which no machine and no number of threads changes.");

pub static CLAIMS: Table = Table {
    name: "claims",
    title: "Claims",
    description: "A row a claim of the paper and rule: the paper's number, this run's, and the verdict.",
    columns: &[
        MODE,
        PARTICLES,
        text("claim", "The claim's name."),
        text("judged_by", "The name of the rule."),
        text("statement", "What the paper claims."),
        text("source", "Where in the paper."),
        text("published", "The printed number."),
        number("estimate", "", "This run's median over rounds, in the unit of the row."),
        number(
            "low",
            "",
            "Of a ratio the lower end of the 95 % interval of the median, missing below six rounds and where rounds depend \
             on one another; of seconds the smallest round.",
        ),
        number("high", "", "The upper end of the same, or the largest round."),
        text("unit", "The unit of the estimate: s, x (a ratio), of total, ms/step."),
        integer("rounds", "rounds", "Rounds that gave a value."),
        text("rule", "When the claim holds."),
        text("verdict", "holds, fails, not resolved, or not testable here."),
        text("reason", "Why nothing is resolved or testable."),
    ],
};

pub static TABLE2: Table = Table {
    name: "table2",
    title: "Table 2",
    description: "Table 2, the paper's and this run's: a row a number.",
    columns: &[
        text("source", "paper, or the machine of the run."),
        text("mode", "published, or the mode of the run."),
        PARTICLES,
        DISTANCE_TEST,
        text("row", "The preset whose seconds these are, or speed_up: linked list over relocation."),
        text("quantity", "cg, non_cg (the step without cg) or total."),
        text("unit", "s for a whole run on one thread, or ratio."),
        number("value", "", "The paper's number, or the median over rounds, in the unit of the row."),
        number(
            "low",
            "",
            "Of a ratio the lower end of the 95 % interval of the median, missing below six rounds and where rounds depend \
             on one another; of seconds the smallest round.",
        ),
        number("high", "", "The upper end of the same, or the largest round."),
        integer("rounds", "rounds", "Rounds that gave a value."),
    ],
};

pub static FIGURE4: Table = Table {
    name: "figure4",
    title: "Figure 4",
    description: "Time of a step against threads: a row a preset and number of threads, and the paper's two points. \
                  Speed-ups are over one thread of the same preset, paired by round; the paper does not say over which.",
    columns: &[
        text("source", "paper, or the machine of the run."),
        text("mode", "published, or the mode of the run."),
        PARTICLES,
        PRESET,
        DISTANCE_TEST,
        integer("threads", "threads", "Threads that share a step."),
        integer("rounds", "rounds", "Rounds that gave a value."),
        number("total_ms_per_step", "ms/step", "Median over rounds of the mean wall time of a step."),
        number("total_low", "ms/step", "The smallest round."),
        number("total_high", "ms/step", "The largest round."),
        number("non_cg_ms_per_step", "ms/step", "The same without the conjugate gradients."),
        number("non_cg_low", "ms/step", "The smallest round."),
        number("non_cg_high", "ms/step", "The largest round."),
        number("total_speed_up", "1", "Time of a step on one thread over that on these threads."),
        number("total_speed_up_low", "1", "Lower end of its 95 % interval."),
        number("total_speed_up_high", "1", "Upper end of its 95 % interval."),
        number("non_cg_speed_up", "1", "The same without the conjugate gradients."),
        number("non_cg_speed_up_low", "1", "Lower end of its 95 % interval."),
        number("non_cg_speed_up_high", "1", "Upper end of its 95 % interval."),
    ],
};

pub static SUMMARY: Table = Table {
    name: "summary",
    title: "Summary",
    description: "A row a timed cell: medians over rounds, the smallest and the largest round.",
    columns: &[
        MODE,
        EXPERIMENT,
        CELL,
        integer("rounds", "rounds", "Rounds that gave a value."),
        number("total_ms_per_step", "ms/step", "Wall time of a step."),
        number("total_low", "ms/step", "The smallest round."),
        number("total_high", "ms/step", "The largest round."),
        number("non_cg_ms_per_step", "ms/step", "Wall time of a step without the conjugate gradients."),
        number("non_cg_low", "ms/step", "The smallest round."),
        number("non_cg_high", "ms/step", "The largest round."),
        number("cg_ms_per_step", "ms/step", "Wall time of the conjugate gradients in a step."),
        number("cg_low", "ms/step", "The smallest round."),
        number("cg_high", "ms/step", "The largest round."),
    ],
};

pub static SAMPLES: Table = Table {
    name: "samples",
    title: "Samples",
    description: "A row a trial, round and phase; trials without an outcome and cells that do not apply are rows, too.",
    columns: &[
        SCHEMA_VERSION,
        RUN_ID,
        MODE,
        EXPERIMENT,
        STAGE,
        CELL,
        ROUND,
        POSITION,
        text("subject", "The group of cells; missing where an experiment has but one."),
        PRESET,
        DISTANCE_TEST,
        integer("buckets_per_radius", "1", "Buckets along the largest radius."),
        text("memory_order", "How the particles of the starting state follow one another in memory."),
        STORAGE,
        text("schedule", "How loops are shared among threads, with the chunk."),
        integer(
            "chunk",
            "rows",
            "Rows that a thread takes at once; missing where the schedule has no chunk.",
        ),
        text("cg", "Whether the conjugate gradients are serial or parallel."),
        CG_TOLERANCE,
        text("preconditioner", "What the conjugate gradients of the pressure are preconditioned by."),
        text("matrix_values", "What the pressure's matrix keeps its values in: f64 or f32."),
        text("pair_terms", "How pairs are walked for explicit forces: separate, shared or joined."),
        text("scheme", "What the scene was changed by; missing for the scene as it is."),
        THREADS_REQUESTED,
        integer("threads_observed", "threads", "Threads that the trial counted inside."),
        PARTICLES,
        number("bytes_per_particle", "bytes", "Memory of all columns of the simulation over its particles."),
        integer("steps", "steps", "Measured steps."),
        integer("warmup_steps", "steps", "Steps before them that were not measured."),
        text("phase", "total, non_cg (total without cg), or a phase of the step."),
        integer("calls", "1", "How often the phase ran in the measured steps."),
        number("time_s", "s", "Wall time of the phase over the measured steps."),
        boolean(
            "outlier",
            "Whether the time stands apart from the other rounds of its cell; it counts all the same.",
        ),
        STATUS,
        REASON,
        STARTED,
        MACHINE_ID,
        SOURCE_HASH,
        number(
            "cpu_pressure_avg10_before",
            "%",
            "Time in which some process waited for a CPU, before the steps.",
        ),
        number("cpu_pressure_avg10_after", "%", "The same after the steps."),
        integer("involuntary_switches", "1", "How often the trial lost its CPU to another process."),
        integer(
            "steal_ticks",
            "clock ticks",
            "Time that the host of a virtual machine took, all CPUs together.",
        ),
        number("freq_mhz_before", "MHz", "Clock frequency before the steps."),
        number("freq_mhz_after", "MHz", "Clock frequency after the steps."),
        DIGEST,
    ],
};

pub static STEPS: Table = Table {
    name: "steps",
    title: "Steps",
    description: "A row a measured step.",
    columns: &[
        RUN_ID,
        MODE,
        EXPERIMENT,
        CELL,
        ROUND,
        integer(
            "window_start_step",
            "steps",
            "Steps that the state had behind it from which the window started.",
        ),
        integer("step", "steps", "The step, from 1 at the start of the simulation."),
        number("total_s", "s", "Wall time of the step."),
        number("cg_s", "s", "Wall time of its conjugate gradients."),
        number("non_cg_s", "s", "Wall time of the rest."),
        integer("cg_iterations", "1", "Iterations of the conjugate gradients."),
        number("cg_residual", "relative", "Residual over source at their end."),
        integer("unknowns", "particles", "Pressures that were solved for."),
        integer(
            "matrix_entries",
            "1",
            "Values of the pressure's matrix beside its diagonal, zeros that fill it up among them.",
        ),
        integer("ghosts", "particles", "Particles that have left the domain."),
    ],
};

pub static OBSERVATIONS: Table = Table {
    name: "observations",
    title: "Observations",
    description: "A row a number that was observed of a whole simulation; a run without any is a row, too.",
    columns: &[
        SCHEMA_VERSION,
        RUN_ID,
        MODE,
        EXPERIMENT,
        OBSERVED_RUN,
        ROUND,
        POSITION,
        THREADS_REQUESTED,
        PRESET,
        DISTANCE_TEST,
        STORAGE,
        CG_TOLERANCE,
        PARTICLES,
        number("time_step_s", "s", "Simulated time of a step."),
        integer("steps", "steps", "Steps until the run ended."),
        text("ended", "completed, or how the simulation broke down."),
        text("error", "What broke down, with step, phase and particle."),
        text("quantity", "What was observed."),
        number("value", "", "The number, in the unit of the row."),
        text("unit", "Its unit; 1 for a plain number."),
        number("at_least", "", "The least value with which the case passes, where it asks for one."),
        number("at_most", "", "The greatest value with which the case passes, where it asks for one."),
        STATUS,
        REASON,
        STARTED,
        MACHINE_ID,
        SOURCE_HASH,
        DIGEST,
    ],
};

pub static FRONTS: Table = Table {
    name: "fronts",
    title: "Fronts",
    description: "A row a time at which the front of an observed run was looked at.",
    columns: &[
        RUN_ID,
        EXPERIMENT,
        OBSERVED_RUN,
        ROUND,
        number("time_s", "s", "Simulated time."),
        number("front_p99_m", "m", "The position that 99 % of the fluid particles have not passed."),
    ],
};

pub static TWIN: Table = Table {
    name: "twin",
    title: "Twin in C",
    description: "A row a layout of one program's trial: the loop of the paper's Figure 3 in C and in Rust.",
    columns: &[
        SCHEMA_VERSION,
        RUN_ID,
        MODE,
        EXPERIMENT,
        ROUND,
        POSITION,
        text("language", "The language of the program: c or rust."),
        text("compiler", "The compiler's command."),
        text("compiler_version", "What the compiler says of itself."),
        text("target_cpu", "The processors it was compiled for: portable or native."),
        integer("threads", "threads", "Threads that ran the loop."),
        DISTANCE_TEST,
        text("layout", "linked_list, or relocated: rows of copied positions."),
        PARTICLES,
        integer("passes", "1", "Passes over both layouts."),
        number("time_s", "s", "Wall time of the loop, median of the passes."),
        number(
            "relocation_s",
            "s",
            "Wall time of the copy before it, median of the passes; none for the list.",
        ),
        STATUS,
        REASON,
        STARTED,
        MACHINE_ID,
        SOURCE_HASH,
        text("digest", "Digest of the loop's sums, the same in both languages and layouts."),
    ],
};

pub static VALIDATION: Table = Table {
    name: "validation",
    title: "Validation",
    description: "A row a comparison of an effect with a known answer.",
    columns: &[
        SCHEMA_VERSION,
        RUN_ID,
        MODE,
        EXPERIMENT,
        text("validating_case", "The case by its name in the program."),
        text("effect", "The effect that the case holds to account."),
        text("simulated", "What was simulated."),
        text("quantity", "What was compared, with its unit."),
        number("value", "", "What was found, in the quantity's unit."),
        number("reference", "", "What is known, in the quantity's unit."),
        number("error", "1", "Relative to the reference unless the quantity says otherwise."),
        number("gate", "1", "The largest error that passes."),
        text(
            "verdict",
            "pass, fail, reported for what has no gate, or none for a case that could not be computed.",
        ),
        text("source", "Where the reference is from."),
        STATUS,
        REASON,
        number("wall_s", "s", "Wall time of the whole process."),
        STARTED,
        MACHINE_ID,
        SOURCE_HASH,
    ],
};

pub static PEAKS: Table = Table {
    name: "peaks",
    title: "Peaks",
    description: "A row a loop and number of threads: what the machine moves and computes at most.",
    columns: &[
        SCHEMA_VERSION,
        RUN_ID,
        MODE,
        EXPERIMENT,
        THREADS_REQUESTED,
        text("instructions", "What the loops were compiled for: portable, avx2+fma or avx512f."),
        text(
            "kind",
            "read: the sum of an array; triad: a = b + s c, two arrays read and one written; multiply_add: in registers.",
        ),
        integer(
            "working_set_bytes",
            "bytes",
            "What each thread goes through again and again; 0 for registers.",
        ),
        text("unit", "The unit of the rates."),
        number("median", "1e9/s", "Bytes or operations of all threads together, median of the repetitions."),
        number("lowest", "1e9/s", "The lowest repetition."),
        number("highest", "1e9/s", "The highest repetition."),
        integer("repetitions", "1", "How often each loop was timed."),
        STATUS,
        REASON,
        STARTED,
        MACHINE_ID,
        SOURCE_HASH,
    ],
};

pub static EFFORT: Table = Table {
    name: "effort",
    title: "Effort",
    description: "A row an experiment or claim: what repeating it takes.",
    columns: &[
        text("kind", "experiment, or claim with what its experiment took."),
        text("id", "The experiment or claim."),
        EXPERIMENT,
        text("command", "The command that repeats it."),
        text("commit", "The commit of the program."),
        integer("trials", "1", "Processes."),
        number("wall_s", "s", "Wall time of the processes."),
        integer("record_bytes", "bytes", "Size of the records."),
    ],
};

pub static EXPERIMENTS: Table = Table {
    name: "experiments",
    title: "Experiments",
    description: "A row an experiment of the run: what it asks, and how to read the answer.",
    columns: &[
        EXPERIMENT,
        text("title", "The title."),
        text("question", "What is asked."),
        text("analysis", "How to read the answer."),
        integer("seed", "1", "Seed of the order of trials, and of variants within a step."),
        text("pin", "Where threads are pinned: off, close or spread."),
    ],
};

pub static MACHINE: Table = Table {
    name: "machine",
    title: "Machine",
    description: "A row a fact about the machine and the build.",
    columns: &[
        text("group", "What the fact is about."),
        text("key", "The fact's name."),
        any(
            "value",
            "A number where there is a unit, text otherwise; unavailable or denied where there is none.",
        ),
        text("unit", "The unit of the value."),
    ],
};

pub static RUN: Table = Table {
    name: "run",
    title: "Run",
    description: "A row a property of the run.",
    columns: &[
        text("key", "The property's name."),
        any("value", "Its value."),
        text("description", "What it means."),
    ],
};

pub static DICTIONARY: Table = Table {
    name: "dictionary",
    title: "Data dictionary",
    description: "A row a column of every table.",
    columns: &[
        text("table", "The table."),
        text("column", "The column's name in the header."),
        text("type", "The type of its cells; any where each has its own."),
        text("unit", "The unit of its numbers; 1 for ratios and ordinals."),
        text("description", "What it means."),
    ],
};

/// Every table, in the order in which a reader wants them.
pub static TABLES: [&Table; 16] = [
    &CLAIMS,
    &TABLE2,
    &FIGURE4,
    &SUMMARY,
    &SAMPLES,
    &STEPS,
    &OBSERVATIONS,
    &FRONTS,
    &TWIN,
    &VALIDATION,
    &PEAKS,
    &EFFORT,
    &EXPERIMENTS,
    &MACHINE,
    &RUN,
    &DICTIONARY,
];

/// The dictionary as a table.
pub fn sheet() -> Sheet {
    let described = |table: &Table, column: &Column| {
        let cells = [table.name, column.name, column.kind.name(), column.unit, column.description];
        cells.map(Value::text).to_vec()
    };
    let rows = TABLES.iter().flat_map(|table| table.columns.iter().map(|column| described(table, column)));
    Sheet { table: &DICTIONARY, rows: rows.collect() }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_column_is_described_once_in_a_sentence() {
        for table in TABLES {
            let names: BTreeSet<&str> = table.columns.iter().map(|column| column.name).collect();
            assert_eq!(names.len(), table.columns.len(), "{} has a column twice", table.name);
            assert!(table.description.ends_with('.') && !table.title.is_empty(), "{}", table.name);
            for column in table.columns {
                assert!(column.description.ends_with('.'), "{}: {}", table.name, column.name);
            }
        }
    }

    #[test]
    fn units_agree_with_the_names_that_end_in_them() {
        for column in TABLES.iter().flat_map(|table| table.columns) {
            let unit = match column.name {
                name if name.ends_with("_ms_per_step") => "ms/step",
                name if name.ends_with("_s") => "s",
                name if name.ends_with("_m") => "m",
                name if name.contains("_mhz") => "MHz",
                _ => continue,
            };
            assert_eq!((column.unit, column.kind), (unit, Kind::Number), "{}", column.name);
        }
    }

    #[test]
    fn only_numbers_have_units() {
        for column in TABLES.iter().flat_map(|table| table.columns) {
            let counted = matches!(column.kind, Kind::Integer | Kind::Number);
            assert!(counted || column.unit.is_empty(), "{}", column.name);
        }
    }
}
