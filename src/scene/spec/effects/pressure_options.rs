//! What a scene may choose in `[effects.pressure]`. Each first value is the textbook's, and what is not named.

use serde::Deserialize;

use crate::engine::pressure::options::{Clamp, Enclosed, Gradient, Source, Surface};

/// Where the Poisson equation's source comes from.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum SourceSpec {
    Named(NamedSource),
    Divergence(DivergenceSpec),
}

/// A source without a number of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum NamedSource {
    /// The number density's error, of which a step corrects the share `source_relaxation`.
    Density,
}

/// The velocity's divergence, with a feedback of the density error.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct DivergenceSpec {
    pub kind: DivergenceKind,
    /// Time in which a density error decays by a factor of e. Steps may be longer; the error then goes in one.
    pub density_feedback_s: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum DivergenceKind {
    Divergence,
}

impl Default for SourceSpec {
    fn default() -> Self {
        SourceSpec::Named(NamedSource::Density)
    }
}

impl SourceSpec {
    pub(super) fn to_engine(&self) -> Source {
        match self {
            SourceSpec::Named(NamedSource::Density) => Source::Density,
            SourceSpec::Divergence(spec) => {
                Source::Divergence { density_feedback_s: spec.density_feedback_s }
            }
        }
    }
}

/// Makes a choice between named values, each the engine's of the same name.
macro_rules! choice {
    ($(#[doc = $doc:literal])* $spec:ident: $engine:ident { $first:ident $(= $first_doc:literal)?, $($other:ident $(= $other_doc:literal)?,)+ }) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
        #[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
        #[serde(rename_all = "snake_case")]
        pub enum $spec {
            $(#[doc = $first_doc])?
            #[default]
            $first,
            $($(#[doc = $other_doc])? $other,)+
        }

        impl $spec {
            pub(super) fn to_engine(self) -> $engine {
                match self {
                    $spec::$first => $engine::$first,
                    $($spec::$other => $engine::$other,)+
                }
            }
        }
    };
}

choice! {
    /// How the pressure's gradient is taken.
    GradientSpec: Gradient {
        Minimum = "On differences from the smallest pressure around.",
        Corrected = "With the inverse moment matrix, on differences from the smallest pressure around.",
        Consistent = "With the inverse moment matrix, right for a linear pressure; needs shifting.",
        Conservative = "Antisymmetric in a pair: keeps linear momentum to rounding.",
        Pairwise = "On the sum of a pair's pressures: keeps momentum, and no energy is made.",
        Transposed = "The same for the divergence with the moment matrix: right for linear motions up to a free surface.",
    }
}

choice! {
    /// Who is on the free surface.
    SurfaceSpec: Surface {
        Density = "Whoever has a low number density.",
        DensityAndAsymmetry = "Of those, the ones whose neighbours lie to one side, and the ones with very few.",
        Truncated = "The same, with unknown pressures: what is missing around them has the pressure of the surface.",
    }
}

choice! {
    /// Whose negative pressure counts as zero.
    ClampSpec: Clamp {
        Everywhere,
        NearSurface = "Of particles with a surface particle within the gradient's radius.",
        Never,
    }
}

choice! {
    /// What becomes of parts of the fluid without a free surface.
    EnclosedSpec: Enclosed {
        Anchor = "The diagonals of their rows are doubled.",
        Project = "The constant is projected out; `compressibility_1_pa` may then be zero.",
    }
}
