//! Which effects' explicit pair terms share one walk: those within the Laplacian's radius, where the preset lets them.

use crate::engine::effects::diffusion::lattice::LatticeDiffusion;
use crate::engine::effects::diffusion::{Carried, Diffusion, Laplacian};
use crate::engine::effects::potential_tension::PairAttraction;
use crate::engine::effects::viscosity::{ExplicitViscosity, PairViscosity};
use crate::engine::parameters::Parameters;
use crate::engine::phase::Phase;
use crate::engine::preset::{Options, PairTerms};
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::Stage;
use crate::engine::terms::PairPass;
use crate::engine::viscous_stages::{ExplicitTerm, explicit_term};

/// All terms that may share a walk. Those that are not there cost a branch a pair that always goes the same way.
type Joined = (
    (Option<ExplicitViscosity>, Option<PairViscosity>),
    ((Option<LatticeDiffusion>, Option<LatticeDiffusion>), Option<PairAttraction>),
);

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

    /// The stage of the shared walk; a walk for the textbook's viscosity alone has no room for anything else.
    pub fn stage<C: CandidateSearch, T: DistanceTest>(self, parameters: &Parameters) -> Box<dyn Stage<C, T>> {
        let effects = &parameters.effects;
        let viscosity = effects.viscosity.as_ref().filter(|_| self.viscosity);
        let (mut uniform, mut variable) = (None, None);
        match viscosity.map(|viscosity| explicit_term(viscosity, parameters)) {
            Some(ExplicitTerm::Uniform(term)) => uniform = Some(term),
            Some(ExplicitTerm::Variable(term)) => variable = Some(term),
            None => {}
        }
        let diffusion = |carried, diffusion: &Option<Diffusion>, member| {
            let diffusion = diffusion.as_ref().filter(|_| member);
            diffusion.map(|diffusion| LatticeDiffusion::new(carried, diffusion, parameters))
        };
        let alone = !(self.temperature || self.concentration || self.tension);
        if let Some(term) = uniform.filter(|_| alone) {
            return Box::new(PairPass {
                term,
                radius_m: parameters.laplacian_radius_m(),
                phase: Phase::PairTerms,
            });
        }
        let tension = effects.potential_tension.filter(|_| self.tension);
        let tension = tension.map(|tension| PairAttraction::new(tension, parameters));
        let term: Joined = (
            (uniform, variable),
            (
                (
                    diffusion(Carried::Temperature, &effects.heat, self.temperature),
                    diffusion(Carried::Concentration, &effects.scalar, self.concentration),
                ),
                tension,
            ),
        );
        Box::new(PairPass { term, radius_m: parameters.laplacian_radius_m(), phase: Phase::PairTerms })
    }
}
