//! The stages of a viscous fluid: which of them a scene calls for, and in what order.

use crate::base::parallel::Workers;
use crate::engine::effects::implicit_viscosity::ImplicitViscositySolve;
use crate::engine::effects::no_slip::NoSlipWalls;
use crate::engine::effects::strain_rate::{Law, StrainRate};
use crate::engine::effects::viscosity::{ExplicitViscosity, PairViscosity, Viscosity};
use crate::engine::own_stages::OwnStages;
use crate::engine::parameters::{Parameters, Property};
use crate::engine::particles::Particles;
use crate::engine::phase::Phase;
use crate::engine::preset::Options;
use crate::engine::search::DistanceTest;
use crate::engine::shared_walk::SharedWalk;
use crate::engine::stage::Stage;
use crate::engine::terms::PairPass;
use crate::engine::viscous::{Form, Walls};

/// The fluid's viscosity and what walls do to it, explicit or implicit.
fn viscosity(parameters: &Parameters) -> Option<(&Property, Walls)> {
    let effects = &parameters.effects;
    let explicit = effects.viscosity.as_ref().map(|v| (&v.kinematic_viscosity_m2_s, v.walls));
    explicit.or(effects.implicit_viscosity.as_ref().map(|v| (&v.kinematic_viscosity_m2_s, v.walls)))
}

/// Whether the viscosity follows the flow.
fn follows_the_flow(parameters: &Parameters) -> bool {
    parameters.effects.rheology.is_some() || parameters.effects.turbulence.is_some()
}

/// Adds a column of viscosities where they differ, with those of a fluid at rest: an explicit step from rest must be as
/// short as those ask for.
pub fn add_columns(particles: &mut Particles, parameters: &Parameters, workers: &Workers) {
    if let Some((newtonian, _)) = viscosity(parameters)
        && (follows_the_flow(parameters) || newtonian.uniform().is_none())
    {
        let law = Law::new(newtonian.clone(), parameters);
        particles.add_viscosity(|group| law.viscosity_m2_s(group, 0.0), workers);
    }
}

/// Mirrored walls first, then the strain rate, which sees them as the explicit force does; the implicit solve last.
pub fn stages<C: OwnStages, T: DistanceTest>(
    parameters: &Parameters,
    options: &Options,
    shared: SharedWalk,
) -> Vec<Box<dyn Stage<C, T>>> {
    let Some((newtonian, walls)) = viscosity(parameters) else {
        return Vec::new();
    };
    let mut stages: Vec<Box<dyn Stage<C, T>>> = Vec::new();
    if follows_the_flow(parameters) {
        stages.push(Box::new(StrainRate::new(Law::new(newtonian.clone(), parameters), parameters)));
    }
    if let Some(viscosity) = &parameters.effects.viscosity {
        stages.push(if shared.viscosity {
            C::shared_walk(shared, parameters)
        } else {
            explicit(viscosity, parameters)
        });
    }
    if walls == Walls::Mirrored && !stages.is_empty() {
        stages = vec![Box::new(NoSlipWalls::new(stages, parameters))];
    }
    if let Some(viscosity) = &parameters.effects.implicit_viscosity {
        let uniform_m2_s = viscosity.kinematic_viscosity_m2_s.uniform().unwrap_or(0.0);
        stages.push(Box::new(ImplicitViscositySolve::new(viscosity, uniform_m2_s, parameters, options)));
    }
    stages
}

/// The explicit force: the textbook's term where the viscosity is the same everywhere, or the general one.
#[derive(Debug)]
pub enum ExplicitTerm {
    Uniform(ExplicitViscosity),
    Variable(PairViscosity),
}

/// The term that a viscosity needs.
pub fn explicit_term(viscosity: &Viscosity, parameters: &Parameters) -> ExplicitTerm {
    let uniform = viscosity.kinematic_viscosity_m2_s.uniform();
    match uniform.filter(|_| viscosity.form == Form::Laplacian && !follows_the_flow(parameters)) {
        Some(uniform_m2_s) => ExplicitTerm::Uniform(ExplicitViscosity::new(uniform_m2_s, parameters)),
        None => {
            let uniform_m2_s = uniform.unwrap_or(0.0);
            ExplicitTerm::Variable(PairViscosity::new(viscosity.form, uniform_m2_s, parameters))
        }
    }
}

/// The force in a walk of its own.
pub fn explicit<C: OwnStages, T: DistanceTest>(
    viscosity: &Viscosity,
    parameters: &Parameters,
) -> Box<dyn Stage<C, T>> {
    let (radius_m, phase) = (parameters.laplacian_radius_m(), Phase::Viscosity);
    match explicit_term(viscosity, parameters) {
        ExplicitTerm::Uniform(term) => C::viscosity(term, parameters),
        ExplicitTerm::Variable(term) => Box::new(PairPass { term, radius_m, phase }),
    }
}
