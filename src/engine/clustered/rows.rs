//! The rows of the pressure's equations on clusters: walls first, then fluid and bodies, eight rows a cluster.

use std::ops::Range;

use crate::base::simd::LANES;
use crate::engine::search::clusters::{Clusters, Section};

/// Which clusters have rows. The sections stand side by side in the order of slots, so that a row is a slot less a constant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RowSpace {
    walls: Range<usize>,
    mobile: Range<usize>,
}

impl RowSpace {
    pub fn of(clusters: &Clusters) -> Self {
        let [walls, mobile] =
            [Section::Wall, Section::Mobile].map(|section| clusters.slots.clusters(section));
        debug_assert!(walls.end == mobile.start, "sections are laid out one behind the other");
        RowSpace { walls, mobile }
    }

    pub fn walls(&self) -> Range<usize> {
        self.walls.clone()
    }

    pub fn mobile(&self) -> Range<usize> {
        self.mobile.clone()
    }

    pub fn clusters(&self) -> usize {
        self.mobile.end - self.walls.start
    }

    pub fn rows(&self) -> usize {
        self.clusters() * LANES
    }

    /// The slots of the rows.
    pub fn slots(&self) -> Range<usize> {
        self.first_slot()..self.mobile.end * LANES
    }

    /// The slot of row 0.
    pub fn first_slot(&self) -> usize {
        self.walls.start * LANES
    }
}
