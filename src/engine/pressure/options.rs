//! What a scene may choose about the pressure solve. Each first variant is the textbook's.

/// Where the Poisson equation's source comes from.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Source {
    /// The number density's error.
    #[default]
    Density,
    /// The velocity's divergence, with a feedback of the density error.
    Divergence {
        /// Time in which a density error decays by a factor of e, seconds.
        density_feedback_s: f64,
    },
}

/// How the pressure's gradient is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Gradient {
    /// On differences from the smallest pressure around: pushes particles apart.
    #[default]
    Minimum,
    /// With the inverse moment matrix, on differences from the smallest pressure around.
    Corrected,
    /// With the inverse moment matrix, right for a linear pressure wherever the particles lie: something else, such as
    /// shifting, must hold them apart.
    Consistent,
    /// Antisymmetric in a pair: keeps linear momentum to rounding.
    Conservative,
    /// On the sum of a pair's pressures: antisymmetric as well, and the counterpart of the divergence.
    Pairwise,
    /// The counterpart of the divergence with its moment matrices.
    Transposed,
}

/// Who is on the free surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Surface {
    /// Whoever has a low number density.
    #[default]
    Density,
    /// Of those, the ones whose neighbours lie to one side, and the ones with very few.
    DensityAndAsymmetry,
    /// The same, but their pressures are unknown: what is missing around a particle counts as neighbours with the pressure
    /// of the surface.
    Truncated,
}

/// Whose negative pressure counts as zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Clamp {
    #[default]
    Everywhere,
    /// Of particles with a surface particle within the gradient's radius.
    NearSurface,
    Never,
}

/// What becomes of parts of the fluid that no path of neighbours joins to a free surface, where pressures are determined
/// up to a constant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Enclosed {
    /// The diagonals of their rows are doubled, which makes the system regular and the pressures small.
    #[default]
    Anchor,
    /// The constant is projected out: the pressures' mean is zero or, where negative ones are clamped everywhere, their
    /// minimum.
    Project,
}
