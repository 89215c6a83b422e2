//! The same bits, whoever searches, however many threads, however loops are dealt.

mod common;

use common::{Run, run_dam_break};
use repro::engine::diagnostics::digest;
use repro::engine::preset::{Options, Test};
use repro::engine::pressure::conjugate_gradient::CgMode;
use repro::engine::pressure::matrix::Storage;

fn end_state(run: &Run<'_>) -> String {
    let (simulation, _) = run_dam_break(run);
    digest(simulation.particles())
}

fn squared_csr(options: &mut Options) {
    options.distance_test = Test::Squared;
    options.storage = Storage::Csr;
}

fn serial_cg(options: &mut Options) {
    options.cg.mode = CgMode::Serial;
}

/// Every search with every thread count, and every schedule with chunks from 1 to 4096, at 8,176 particles.
#[test]
fn a_covering_set_of_searches_threads_and_schedules_gives_the_same_bits() {
    let base = Run {
        l0: 0.0375,
        steps: 12,
        preset: "paper-linked-list",
        ..Run::default()
    };
    let expected = end_state(&base);
    let (list, relocated) = ("paper-linked-list", "paper-aos-relocation");
    let plain: fn(&mut Options) = |_| {};
    let runs: [(&str, usize, &str, fn(&mut Options)); 18] = [
        (list, 2, "dynamic:64", plain),
        (list, 3, "dynamic:64", serial_cg),
        (relocated, 1, "dynamic:64", plain),
        (relocated, 2, "dynamic:64", squared_csr),
        (relocated, 3, "dynamic:64", plain),
        (list, 3, "static", squared_csr),
        (relocated, 2, "static", plain),
        (list, 2, "dynamic:1", squared_csr),
        (relocated, 3, "dynamic:1", plain),
        (list, 3, "dynamic:4096", plain),
        (relocated, 2, "dynamic:4096", serial_cg),
        (list, 2, "guided:1", plain),
        (relocated, 3, "guided:16", squared_csr),
        (list, 3, "guided:4096", plain),
        (relocated, 2, "rayon:1", plain),
        (list, 3, "rayon:64", squared_csr),
        (relocated, 3, "rayon:4096", plain),
        (list, 1, "rayon:7", serial_cg),
    ];
    for (preset, threads, schedule, change) in runs {
        let run = Run {
            preset,
            threads,
            schedule,
            change,
            ..base
        };
        assert_eq!(
            end_state(&run),
            expected,
            "{preset}, {threads} threads, {schedule}"
        );
    }
}

/// The whole run against the digest that is known for it.
#[test]
fn a_whole_run_ends_in_the_known_state() {
    let run = Run {
        l0: 0.0375,
        steps: 667,
        threads: 2,
        change: squared_csr,
        ..Run::default()
    };
    let known = include_str!("../experiments/digests.toml");
    assert!(known.contains(&format!("\"{}\"", end_state(&run))));
}
