//! A step allocates nothing of its own once it has met its largest neighbourhood.
//!
//! The thread pool allocates a few bytes whenever it wakes its threads. What an empty loop allocates is therefore left out
//! of the count: any other size is the step's own.

mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use common::{Change, Run};
use repro::base::parallel::Workers;
use repro::base::schedule::Schedule;
use repro::engine::phase::NoProbe;
use repro::engine::preset::{Preset, Search};
use repro::engine::pressure::preconditioner::Preconditioning;
use repro::scene::library;

/// The most different sizes that are told apart.
const SIZES: usize = 1 << 12;

struct Counting;

static COUNTING: AtomicBool = AtomicBool::new(false);
static SEEN: [std::sync::atomic::AtomicU32; SIZES] = [const { std::sync::atomic::AtomicU32::new(0) }; SIZES];
/// Only one test may count at a time.
static TURN: Mutex<()> = Mutex::new(());

// SAFETY: every call goes to the system's allocator unchanged; counting touches atomics alone.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if COUNTING.load(Ordering::Relaxed) {
            SEEN[layout.size().min(SIZES - 1)].fetch_add(1, Ordering::Relaxed);
        }
        // SAFETY: the caller's promise is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise is passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// How often each size was allocated while `work` ran; sizes above 4 kB count as one.
fn allocated(work: impl FnOnce()) -> BTreeMap<usize, u32> {
    SEEN.iter().for_each(|count| count.store(0, Ordering::Relaxed));
    COUNTING.store(true, Ordering::Relaxed);
    work();
    COUNTING.store(false, Ordering::Relaxed);
    let counts = SEEN.iter().enumerate().map(|(size, count)| (size, count.load(Ordering::Relaxed)));
    counts.filter(|(_, count)| *count > 0).collect()
}

/// What waking the pool's threads allocates.
fn of_the_pool(threads: usize) -> BTreeMap<usize, u32> {
    let workers = Workers::new(threads, Schedule::Static, &[]).unwrap();
    let mut sizes = BTreeMap::new();
    for _ in 0..50 {
        let seen = allocated(|| workers.install(|| workers.scheduled().run(1000, |_| ())));
        sizes.extend(seen);
    }
    sizes
}

fn steps_allocate_nothing(scene: &str, sets: &[&str], preset: &str, warm_up: usize, change: Change) {
    let _turn = TURN.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let scene = library::load(scene, &sets.iter().map(|set| set.to_string()).collect::<Vec<_>>()).unwrap();
    for threads in [1, 2] {
        let pool = of_the_pool(threads);
        let run = Run { steps: warm_up, preset, threads, schedule: "static", change, ..Run::default() };
        let (mut simulation, _) = common::run_scene(&scene, &run);
        // A neighbourhood fuller than any before makes a column grow, which is no allocation per step.
        let mut loud = Vec::new();
        for _ in 0..30 {
            let mut seen = allocated(|| {
                simulation.step(&mut NoProbe).unwrap();
            });
            seen.retain(|size, _| !pool.contains_key(size));
            loud.extend((!seen.is_empty()).then_some(seen));
        }
        assert!(
            loud.len() <= 2,
            "{} of 30 steps of `{}` with {preset} allocate, {threads} thread(s), so many times so many bytes: {loud:?}",
            loud.len(),
            scene.name
        );
    }
}

#[test]
fn the_papers_scene() {
    steps_allocate_nothing("dam-break", &["particle_distance_m=0.0375"], "paper-linked-list", 30, |_| ());
}

#[test]
fn preconditioners() {
    let changes: [Change; 4] = [
        |options| options.cg.preconditioner = Preconditioning::Jacobi,
        |options| options.cg.preconditioner = Preconditioning::Ssor,
        |options| options.cg.preconditioner = Preconditioning::IncompleteCholesky,
        |options| options.cg.preconditioner = Preconditioning::TwoLevel,
    ];
    for change in changes {
        steps_allocate_nothing("dam-break", &["particle_distance_m=0.0375"], "paper-linked-list", 30, change);
    }
}

#[test]
fn every_search_by_buckets() {
    for preset in Preset::all().filter(|preset| preset.options().search != Search::BruteForce) {
        // Lists grow with the crowding of the collapse, and the matrix as walls get wet.
        let warm_up = if preset.options().search == Search::Clusters { 300 } else { 30 };
        steps_allocate_nothing("dam-break", &["particle_distance_m=0.075"], preset.name(), warm_up, |_| ());
    }
}

#[test]
fn periodic_ends() {
    let sets = ["particle_distance_m=0.075", "domain.periodic=[\"z\"]"];
    steps_allocate_nothing("dam-break", &sets, "fast", 300, |_| ());
}

#[test]
fn a_counted_allocation_is_seen() {
    let _turn = TURN.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let seen = allocated(|| drop(std::hint::black_box(vec![0_u8; 777])));
    assert_eq!(seen.get(&777), Some(&1));
}
