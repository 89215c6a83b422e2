//! The kernels of a step by themselves: `cargo bench --manifest-path benches/Cargo.toml`. For work on a kernel; what a report
//! says comes from `repro run`, which measures whole steps against one another.

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use repro::base::parallel::Workers;
use repro::base::schedule::Schedule;
use repro::engine::parameters::Parameters;
use repro::engine::particles::{InitialParticle, Particles};
use repro::engine::phase::NoProbe;
use repro::engine::pressure::free_surface::Unknowns;
use repro::engine::pressure::matrix::Storage;
use repro::engine::pressure::number_density::NumberDensity;
use repro::engine::pressure::poisson::Poisson;
use repro::engine::search::aos_relocation::AosRelocation;
use repro::engine::search::aosoa::Aosoa;
use repro::engine::search::cell_list::CellList;
use repro::engine::search::grid::{Buckets, Grid};
use repro::engine::search::linked_list::LinkedList;
use repro::engine::search::neighbor_list::NeighborList;
use repro::engine::search::soa::Soa;
use repro::engine::search::sorted_particles::SortedParticles;
use repro::engine::search::{CandidateSearch, NONE, SquaredFirst, Now};
use repro::engine::stage::State;
use repro::engine::viscous_stages;
use repro::scene::library;

/// The dam break before its first step, 8,176 particles in the lattice's order.
struct Scene {
    parameters: Parameters,
    particles: Vec<InitialParticle>,
    workers: Arc<Workers>,
}

impl Scene {
    fn load() -> Scene {
        let scene = library::load("dam-break", &["particle_distance_m=0.0375".to_string()]).unwrap();
        let particles = scene.particles("bench").unwrap();
        let workers = Arc::new(Workers::new(1, Schedule::Static, &[]).unwrap());
        Scene { parameters: scene.parameters(&particles), particles, workers }
    }

    fn grid(&self) -> Grid {
        Grid::new(self.parameters.domain, self.parameters.largest_radius_m(), 1).unwrap()
    }

    fn state<C: CandidateSearch>(&self) -> State<C> {
        let mut particles = Particles::new(&self.particles, &self.workers);
        particles.add_pressure_columns(&self.particles, &self.workers);
        let (workers, time_step_s) = (Arc::clone(&self.workers), self.parameters.time_step_s);
        let mut state = State::<C>::new(particles, self.grid(), self.parameters.lengths(), workers, time_step_s);
        state.refresh(&mut NoProbe).unwrap();
        state
    }
}

/// What a search does after positions changed, and the walks of three phases with it.
fn search<C: CandidateSearch + 'static>(criterion: &mut Criterion, scene: &Scene, name: &str) {
    let Scene { parameters, particles, workers } = scene;
    let columns = Particles::new(particles, workers);
    let mut buckets = Buckets { grid: scene.grid(), of_particle: vec![NONE; particles.len()] };
    buckets.assign(&columns.kind, &columns.position, true, workers.scheduled());
    let mut candidates = C::new(&buckets.grid, parameters.lengths(), particles.len());
    let mut group = criterion.benchmark_group(name);
    let radius_m = parameters.largest_radius_m();
    let now = Now { kind: &columns.kind, position: &columns.position, radius_m, walls_moved: false };
    group.bench_function("bucket_build", |b| b.iter(|| candidates.build(&buckets, now, workers)));
    if candidates.relocates() {
        let mut relocate = || candidates.relocate(&buckets, &columns.position, workers.scheduled());
        group.bench_function("relocation", |b| b.iter(&mut relocate));
    }

    let mut state = scene.state::<C>();
    let pressure = parameters.effects.pressure.as_ref().expect("the dam break has pressure");
    let mut density = NumberDensity::new(pressure, parameters, &state);
    group
        .bench_function("number_density", |b| b.iter(|| density.sum::<C, SquaredFirst>(&mut state).unwrap()));
    let viscosity = parameters.effects.viscosity.as_ref().expect("the dam break has viscosity");
    let mut stage = viscous_stages::explicit::<C, SquaredFirst>(viscosity, parameters);
    group.bench_function("viscosity", |b| b.iter(|| stage.run(&mut state, &mut NoProbe).unwrap()));
    let mut unknowns = Unknowns::new(pressure, parameters, &state);
    unknowns.find(&density.asymmetry, &state);
    let mut poisson = Poisson::new(pressure, parameters, Storage::Csr);
    group.bench_function("matrix", |b| b.iter(|| poisson.assemble::<C, SquaredFirst>(&unknowns, &state)));
    group.finish();
}

/// The matrix times a vector, which most of CG's time goes into.
fn products(criterion: &mut Criterion, scene: &Scene) {
    let mut state = scene.state::<AosRelocation>();
    let pressure = scene.parameters.effects.pressure.as_ref().expect("the dam break has pressure");
    let mut density = NumberDensity::new(pressure, &scene.parameters, &state);
    density.sum::<_, SquaredFirst>(&mut state).unwrap();
    let mut unknowns = Unknowns::new(pressure, &scene.parameters, &state);
    unknowns.find(&density.asymmetry, &state);
    for storage in [Storage::Ell, Storage::Csr] {
        let mut poisson = Poisson::new(pressure, &scene.parameters, storage);
        poisson.assemble::<_, SquaredFirst>(&unknowns, &state);
        let (rows, matrix) = (unknowns.rows.len(), &poisson.matrix);
        let x: Vec<f64> = (0..rows).map(|row| (row as f64).sqrt()).collect();
        criterion.bench_function(&format!("CG product/{storage}"), |b| {
            b.iter(|| (0..rows).map(|row| matrix.row_product(row, black_box(&x))).sum::<f64>());
        });
    }
}

fn kernels(criterion: &mut Criterion) {
    let scene = Scene::load();
    search::<LinkedList>(criterion, &scene, "linked list");
    search::<AosRelocation>(criterion, &scene, "relocation");
    search::<CellList>(criterion, &scene, "cell list");
    search::<SortedParticles>(criterion, &scene, "sorted particles");
    search::<Soa>(criterion, &scene, "soa");
    search::<Aosoa>(criterion, &scene, "aosoa");
    search::<NeighborList<u32>>(criterion, &scene, "neighbor list");
    products(criterion, &scene);
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(20)
        .warm_up_time(std::time::Duration::from_millis(300))
        .measurement_time(std::time::Duration::from_secs(1));
    targets = kernels
}
criterion_main!(benches);
