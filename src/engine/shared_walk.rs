//! Which effects' explicit pair terms share one walk: those within the Laplacian's radius, where the preset lets them.

use crate::engine::effects::diffusion::lattice::LatticeDiffusion;
use crate::engine::effects::diffusion::{Carried, Diffusion, Laplacian};
use crate::engine::effects::potential_tension::PairAttraction;
use crate::engine::parameters::Parameters;
use crate::engine::phase::Phase;
use crate::engine::preset::{Options, PairTerms};
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::Stage;
use crate::engine::terms::{Absent, PairPass, PairTerm};
use crate::engine::viscous_stages::{ExplicitTerm, explicit_term};

/// What a walk is shared by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SharedWalk {
    pub viscosity: bool,
    pub temperature: bool,
    pub concentration: bool,
    pub tension: bool,
}

impl SharedWalk {
    /// Nothing where fewer than two terms could share, or the preset keeps walks apart.
    pub fn of(parameters: &Parameters, options: &Options) -> SharedWalk {
        let effects = &parameters.effects;
        let on_lattice = |diffusion: &Option<Diffusion>| {
            diffusion.as_ref().is_some_and(|diffusion| diffusion.laplacian == Laplacian::Lattice)
        };
        let members = SharedWalk {
            viscosity: effects.viscosity.is_some(),
            temperature: on_lattice(&effects.heat),
            concentration: on_lattice(&effects.scalar),
            tension: effects
                .potential_tension
                .is_some_and(|tension| tension.radius_m(parameters) == parameters.laplacian_radius_m()),
        };
        let SharedWalk { viscosity, temperature, concentration, tension } = members;
        let count = [viscosity, temperature, concentration, tension].map(usize::from).iter().sum::<usize>();
        match options.pair_terms {
            PairTerms::Shared if count > 1 => members,
            PairTerms::Joined if count > 0 => members,
            _ => SharedWalk { viscosity: false, temperature: false, concentration: false, tension: false },
        }
    }

    pub fn is_empty(self) -> bool {
        !(self.viscosity || self.temperature || self.concentration || self.tension)
    }

    /// The stage of the shared walk. What is absent has no type in it, so that no pair asks for it.
    pub fn stage<C: CandidateSearch, T: DistanceTest>(self, parameters: &Parameters) -> Box<dyn Stage<C, T>> {
        let viscosity = parameters.effects.viscosity.as_ref().filter(|_| self.viscosity);
        match viscosity.map(|viscosity| explicit_term(viscosity, parameters)) {
            None => self.with_diffusion(Absent, parameters),
            Some(ExplicitTerm::Uniform(term)) => self.with_diffusion(term, parameters),
            Some(ExplicitTerm::Variable(term)) => self.with_diffusion(term, parameters),
        }
    }

    fn with_diffusion<C: CandidateSearch, T: DistanceTest>(
        self,
        others: impl PairTerm + 'static,
        parameters: &Parameters,
    ) -> Box<dyn Stage<C, T>> {
        let effects = &parameters.effects;
        let term = |carried, diffusion: &Option<Diffusion>, member| {
            let diffusion = diffusion.as_ref().filter(|_| member);
            diffusion.map(|diffusion| LatticeDiffusion::new(carried, diffusion, parameters))
        };
        let heat = term(Carried::Temperature, &effects.heat, self.temperature);
        let scalar = term(Carried::Concentration, &effects.scalar, self.concentration);
        match (heat, scalar) {
            (None, None) => self.with_tension(others, parameters),
            (Some(term), None) | (None, Some(term)) => self.with_tension((others, term), parameters),
            (Some(heat), Some(scalar)) => self.with_tension((others, (heat, scalar)), parameters),
        }
    }

    fn with_tension<C: CandidateSearch, T: DistanceTest>(
        self,
        others: impl PairTerm + 'static,
        parameters: &Parameters,
    ) -> Box<dyn Stage<C, T>> {
        let (radius_m, phase) = (parameters.laplacian_radius_m(), Phase::PairTerms);
        match parameters.effects.potential_tension.filter(|_| self.tension) {
            None => Box::new(PairPass { term: others, radius_m, phase }),
            Some(tension) => Box::new(PairPass {
                term: (others, PairAttraction::new(tension, parameters)),
                radius_m,
                phase,
            }),
        }
    }
}
