//! Stages that a search may compute in its own way. By default none is: they walk over the search's candidates.

use crate::engine::clustered::collision::ClusterCollisions;
use crate::engine::clustered::pressure::{ClusterPressure, covers};
use crate::engine::clustered::viscosity::ClusterViscosity;
use crate::engine::effects::collision::{Collision, Collisions};
use crate::engine::effects::viscosity::ExplicitViscosity;
use crate::engine::parameters::Parameters;
use crate::engine::phase::Phase;
use crate::engine::preset::Options;
use crate::engine::pressure::values::MatrixValues;
use crate::engine::pressure::{Pressure, PressureSolve};
use crate::engine::search::aos_relocation::AosRelocation;
use crate::engine::search::aosoa::Aosoa;
use crate::engine::search::brute_force::BruteForce;
use crate::engine::search::cell_list::CellList;
use crate::engine::search::clusters::Clusters;
use crate::engine::search::erased::Erased;
use crate::engine::search::linked_list::LinkedList;
use crate::engine::search::neighbor_list::{Listed, NeighborList};
use crate::engine::search::periodic::Periodic;
use crate::engine::search::soa::Soa;
use crate::engine::search::sorted_particles::SortedParticles;
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::shared_walk::SharedWalk;
use crate::engine::stage::{Stage, State};
use crate::engine::terms::PairPass;

type Boxed<C, T> = Box<dyn Stage<C, T>>;

/// A search with the stages that it computes best itself.
pub trait OwnStages: CandidateSearch + 'static {
    /// A viscosity that is the same everywhere.
    fn viscosity<T: DistanceTest>(term: ExplicitViscosity, parameters: &Parameters) -> Boxed<Self, T> {
        Box::new(PairPass { term, radius_m: parameters.laplacian_radius_m(), phase: Phase::Viscosity })
    }

    /// What shares one walk.
    fn shared_walk<T: DistanceTest>(shared: SharedWalk, parameters: &Parameters) -> Boxed<Self, T> {
        shared.stage(parameters)
    }

    fn collisions<T: DistanceTest>(
        collision: Collision,
        parameters: &Parameters,
        state: &State<Self>,
    ) -> Boxed<Self, T> {
        Box::new(Collisions::new(collision, parameters, state))
    }

    fn pressure<T: DistanceTest>(
        pressure: &Pressure,
        parameters: &Parameters,
        options: &Options,
        state: &State<Self>,
    ) -> Boxed<Self, T> {
        Box::new(PressureSolve::new(pressure, parameters, options, state))
    }
}

impl OwnStages for LinkedList {}
impl OwnStages for AosRelocation {}
impl OwnStages for BruteForce {}
impl OwnStages for CellList {}
impl OwnStages for SortedParticles {}
impl<E: Listed> OwnStages for NeighborList<E> {}
impl OwnStages for Soa {}
impl OwnStages for Aosoa {}
impl OwnStages for Erased {}
impl<C: OwnStages> OwnStages for Periodic<C> {}

impl OwnStages for Clusters {
    fn viscosity<T: DistanceTest>(term: ExplicitViscosity, parameters: &Parameters) -> Boxed<Self, T> {
        Box::new(ClusterViscosity::new(term, parameters.laplacian_radius_m()))
    }

    fn shared_walk<T: DistanceTest>(shared: SharedWalk, parameters: &Parameters) -> Boxed<Self, T> {
        match ClusterViscosity::with_diffusion(shared, parameters) {
            Some(stage) => Box::new(stage),
            None => shared.stage(parameters),
        }
    }

    fn collisions<T: DistanceTest>(
        collision: Collision,
        parameters: &Parameters,
        state: &State<Self>,
    ) -> Boxed<Self, T> {
        Box::new(ClusterCollisions::new(collision, parameters, state))
    }

    fn pressure<T: DistanceTest>(
        pressure: &Pressure,
        parameters: &Parameters,
        options: &Options,
        state: &State<Self>,
    ) -> Boxed<Self, T> {
        if !covers(pressure) {
            return Box::new(PressureSolve::new(pressure, parameters, options, state));
        }
        match options.matrix_values {
            MatrixValues::F64 => Box::new(ClusterPressure::<f64>::new(pressure, parameters, options, state)),
            MatrixValues::F32 => Box::new(ClusterPressure::<f32>::new(pressure, parameters, options, state)),
        }
    }
}
