//! The dam break against values from an independent implementation of the same algorithm (its own pair search, a
//! direct sparse solve), to every digit that it states.

mod common;

use common::{Run, run_dam_break};
use repro::engine::diagnostics::FlowState;
use repro::engine::particles::Kind;

/// One row: particle distance, step, front, top, largest speed, largest pressure of the fluid and of all, surface
/// particles, unknowns.
type Row = (f64, usize, &'static str, &'static str, &'static str, f64, f64, usize, usize);

const ROWS: [Row; 7] = [
    (0.075, 1, "0.225000", "0.449911800", "0.029400", 0.0, 0.0, 576, 672),
    (0.075, 3, "0.225002572", "0.449470800", "0.088200", 171.4906, 273.5874, 576, 672),
    (0.075, 10, "0.226724130", "0.445151425", "0.319336", 2196.7275, 2945.0053, 574, 674),
    (0.075, 20, "0.239870351", "0.431943559", "0.710712", 2559.7152, 3420.5174, 570, 678),
    (0.0375, 1, "0.225000312", "0.487411800", "0.029400", 46.0100, 62.2500, 1630, 2514),
    (0.0375, 10, "0.228934373", "0.482655828", "0.416764", 2346.6698, 2697.6172, 1622, 2522),
    (0.0375, 20, "0.250563800", "0.469284702", "1.013642", 1765.3591, 2033.8572, 1612, 2532),
];

/// A pressure may differ by one in the last stated digit: theirs is a direct solve, ours stops at 1e-8.
fn check_pressure(found: f64, stated: f64, what: &str) {
    assert!((found - stated).abs() <= 1.5e-4, "{what}: {found} instead of {stated}");
}

fn check_digits(found: f64, stated: &str, what: &str) {
    let digits = stated.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    assert_eq!(format!("{found:.digits$}"), stated, "{what}");
}

#[test]
fn both_searches_give_the_independent_values() {
    for preset in ["paper-linked-list", "paper-aos-relocation", "brute-force"] {
        for (l0, step, front, top, speed, p_fluid, p_all, surface, unknowns) in ROWS {
            if preset == "brute-force" && l0 < 0.05 {
                continue;
            }
            let (simulation, report) = run_dam_break(&Run { l0, steps: step, preset, ..Run::default() });
            let (flow, what) =
                (FlowState::of(simulation.particles()), format!("{preset}, l0 {l0}, step {step}"));
            check_digits(flow.front_max_m, front, &what);
            check_digits(flow.top_m, top, &what);
            check_digits(flow.max_speed_m_s, speed, &what);
            check_pressure(flow.max_pressure_fluid_pa, p_fluid, &what);
            check_pressure(flow.max_pressure_pa, p_all, &what);
            let pressure = report.pressure.unwrap();
            assert_eq!((pressure.surface, pressure.unknowns), (surface, unknowns), "{what}");
            assert_eq!(pressure.enclosed, 0, "{what}");
        }
    }
}

#[test]
fn the_coarse_front_at_three_tenths_of_a_second() {
    let (simulation, _) = run_dam_break(&Run { l0: 0.075, steps: 100, ..Run::default() });
    check_digits(FlowState::of(simulation.particles()).front_max_m, "0.7379", "front");
}

#[test]
fn the_papers_scene_has_its_particles_and_its_flow() {
    let run = Run { steps: 1, preset: "paper-aos-relocation", threads: 2, ..Run::default() };
    let (simulation, _) = run_dam_break(&run);
    let particles = simulation.particles();
    assert_eq!(
        [Kind::Fluid, Kind::Wall, Kind::DummyWall].map(|kind| particles.count(kind)),
        [5408, 12272, 13296]
    );
    check_digits(FlowState::of(particles).max_pressure_fluid_pa, "209.88", "pressure after one step");

    let (simulation, report) = run_dam_break(&Run { steps: 100, ..run });
    let flow = FlowState::of(simulation.particles());
    check_digits(flow.front_max_m, "0.883", "front");
    check_digits(flow.front_p99_m, "0.819", "99th percentile");
    check_digits(flow.max_speed_m_s, "3.24", "speed");
    assert_eq!(report.ghosts, 0);
}

#[test]
fn coarser_scenes_have_the_stated_particles() {
    for (l0, counts) in [(0.075, [72, 1176, 1432]), (0.05, [300, 2168, 2216])] {
        let (simulation, _) = run_dam_break(&Run { l0, steps: 0, ..Run::default() });
        let particles = simulation.particles();
        assert_eq!([Kind::Fluid, Kind::Wall, Kind::DummyWall].map(|kind| particles.count(kind)), counts);
    }
}
