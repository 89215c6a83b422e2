//! What moving walls, frames, flow boundaries and bodies owe to the engine: zero is nothing, any search and any number of
//! threads give the same bits, a run goes on from its shown state, and a step allocates nothing.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use repro::base::parallel::Workers;
use repro::engine::columns::SavedState;
use repro::engine::diagnostics::digest;
use repro::engine::effects::flow_boundaries::{FlowBoundaries, Inflow, Outflow};
use repro::engine::effects::frame::Frame;
use repro::engine::effects::rigid_bodies::{Fixed, RigidBodies};
use repro::engine::effects::wall_motion::{Hinge, Motion, WallMotion};
use repro::engine::parameters::Parameters;
use repro::engine::particles::{InitialParticle, Kind};
use repro::engine::phase::NoProbe;
use repro::engine::preset::Preset;
use repro::engine::simulation::{self, Simulation, Start};
use repro::scene::validation::plane;

const L0: f64 = 0.02;

/// Counts what is allocated in pieces of a kibibyte and more.
struct Counting;

static ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);

/// Tests run one after another, so that none counts another's allocations.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

// SAFETY: hands every call on to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // A loop's start allocates a few words for its threads; columns are larger.
        if layout.size() >= 1024 {
            ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        }
        // SAFETY: the caller's promise is the system's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A tank whose walls rock, with a box afloat, a jet that comes in and a drain.
fn everything() -> (Parameters, Vec<InitialParticle>) {
    let mut particles = plane::walls(L0, 20, 20, 2);
    particles.retain(|p| p.position[0] > 0.0 || !(0.24..0.30).contains(&p.position[1]));
    for particle in plane::fluid(L0, 0..20, |_| 0.2) {
        let [x, y, _] = particle.position;
        let body = (0.12..0.22).contains(&x) && y > 0.1;
        let (kind, group) = if body { (Kind::Body, 1) } else { (Kind::Fluid, 0) };
        particles.push(InitialParticle { kind, group, ..particle });
    }
    let waiting = InitialParticle::at_rest(Kind::Ghost, plane::cell(L0, 0, 0));
    particles.extend(std::iter::repeat_n(waiting, 40));
    let hinge = Hinge { point_m: [0.2, 0.0, 0.0], axis: [0.0, 0.0, 1.0] };
    let rocking =
        Motion::Rocking { hinge, amplitude_rad: 0.02, frequency_hz: 1.5, phase_rad: 0.0, ramp_s: 0.1 };
    let inflow = Inflow {
        low_m: [0.0, 0.24, 0.0],
        high_m: [0.0, 0.30, 0.0],
        axis: 0,
        speed_m_s: 1.0,
        group: 0,
        temperature: 0.0,
        concentration: 0.0,
    };
    let outflow = Outflow { low_m: [0.36, 0.0, 0.0], high_m: [0.4, 0.04, 0.0] };
    let mut effects = plane::water_effects();
    effects.wall_motion = Some(WallMotion { by_group: vec![None, None, Some(rocking)] });
    effects.flow_boundaries = Some(FlowBoundaries { inflows: vec![inflow], outflows: vec![outflow] });
    effects.rigid_bodies = Some(RigidBodies { fixed: vec![Fixed::default(); 3] });
    if let Some(pressure) = &mut effects.pressure {
        pressure.density_by_group_kg_m3 = Some(vec![1000.0, 600.0, 1000.0]);
    }
    effects.frame = Some(Frame { angular_velocity_rad_s: [0.0, 0.0, 0.3], ..Frame::default() });
    (plane::parameters(L0, 1e-3, &particles, 0.2, effects), particles)
}

fn build(
    parameters: &Parameters,
    particles: &[InitialParticle],
    preset: Preset,
    threads: usize,
    schedule: &str,
) -> Box<dyn Simulation> {
    let workers = Arc::new(Workers::new(threads, schedule.parse().unwrap(), &[]).unwrap());
    let start = Start { particles, steps_done: 0 };
    simulation::build(parameters, &preset.options(), start, workers).unwrap()
}

fn run(simulation: &mut dyn Simulation, steps: usize) -> String {
    for _ in 0..steps {
        simulation.step(&mut NoProbe).unwrap();
    }
    digest(simulation.particles())
}

#[test]
fn threads_searches_and_interruptions_change_no_bit_and_steps_allocate_nothing() {
    let _alone = ONE_AT_A_TIME.lock();
    let (parameters, particles) = everything();
    let mut plain = build(&parameters, &particles, Preset::PAPER_LINKED_LIST, 1, "static");
    run(&mut *plain, 80);
    let mut saved = SavedState::default();
    saved.keep(|visitor| plain.visit(visitor));
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    for _ in 0..60 {
        plain.step(&mut NoProbe).unwrap();
    }
    let allocated = ALLOCATIONS.load(Ordering::Relaxed) - before;
    let flow = plain.step(&mut NoProbe).unwrap().flow.unwrap();
    assert!(flow.entered > 0 && flow.left > 0, "{flow:?}");
    // Tables of search and matrix grow where a fuller bucket or a longer row turns up; nothing is made anew each step.
    assert!(allocated < 15, "{allocated} columns allocated in 60 steps");
    let expected = digest(plain.particles());
    let mut threaded = build(&parameters, &particles, Preset::PAPER_AOS_RELOCATION, 2, "dynamic:16");
    assert_eq!(run(&mut *threaded, 141), expected);
    let mut resumed = build(&parameters, &particles, Preset::PAPER_LINKED_LIST, 1, "static");
    run(&mut *resumed, 3);
    saved.restore(|visitor| resumed.visit(visitor));
    assert_eq!(run(&mut *resumed, 61), expected, "the shown state is all that the next step depends on");
}

#[test]
fn effects_of_size_zero_change_nothing() {
    let _alone = ONE_AT_A_TIME.lock();
    let (mut parameters, particles) = everything();
    parameters.effects.flow_boundaries = None;
    parameters.effects.rigid_bodies = None;
    parameters.effects.wall_motion = None;
    parameters.effects.frame = None;
    let ends = |parameters: &Parameters| {
        let mut simulation = build(parameters, &particles, Preset::PAPER_LINKED_LIST, 1, "static");
        run(&mut *simulation, 40)
    };
    let without = ends(&parameters);
    parameters.effects.frame = Some(Frame::default());
    assert_eq!(ends(&parameters), without, "a frame at rest");
    let still = Motion::Oscillation { amplitude_m: [0.0; 3], frequency_hz: 1.0, phase_rad: 0.0, ramp_s: 0.0 };
    parameters.effects.wall_motion = Some(WallMotion { by_group: vec![None, None, Some(still)] });
    assert_eq!(ends(&parameters), without, "walls that move by nothing");
    parameters.effects.flow_boundaries = Some(FlowBoundaries::default());
    assert_eq!(ends(&parameters), without, "no inflow and no outflow");
}

/// Adaptive steps are taken back whole: the walls, the layers and the bodies, too.
#[test]
fn steps_that_are_taken_back_leave_walls_in_place() {
    let _alone = ONE_AT_A_TIME.lock();
    use repro::engine::parameters::AdaptiveTimeStep;
    let (mut parameters, particles) = everything();
    parameters.time_step_s = 5e-3;
    parameters.adaptive = Some(AdaptiveTimeStep { courant: 0.1, safety: 0.5, growth: 2.0, shortest_s: 1e-7 });
    let mut simulation = build(&parameters, &particles, Preset::PAPER_LINKED_LIST, 1, "static");
    let (mut redone, mut time_s) = (0, 0.0);
    for _ in 0..100 {
        let report = simulation.step(&mut NoProbe).unwrap();
        (redone, time_s) = (redone + report.redone, report.time_s);
    }
    let motion = parameters.effects.wall_motion.unwrap().by_group[2].clone().unwrap();
    for (i, start) in particles.iter().enumerate().filter(|(_, p)| p.group == 2) {
        let off = motion.pose(time_s).place(start.position);
        let now = simulation.particles().position[i];
        assert!((0..3).all(|d| (now[d] - off[d]).abs() < 1e-12), "{now:?} {off:?}");
    }
    assert!(redone > 0, "no step was taken back");
}
