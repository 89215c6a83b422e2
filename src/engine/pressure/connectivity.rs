//! Inner particles that no path of neighbours joins to the free surface: no pressure is given anywhere in their pool.
//!
//! Breadth first from the surface over pairs within `re_L`, dummy walls left out. Each sweep asks every particle that
//! is not yet reached whether one of the former sweeps' particles is its neighbour: the particle gathers, so that the
//! sweep runs in parallel and ends at the first hit, and the levels are those of the textbook's flood. A bucket without
//! any reached particle is passed over.

use std::sync::atomic::{AtomicU8, AtomicUsize, Ordering::Relaxed};

use crate::engine::parameters::Parameters;
use crate::engine::pressure::free_surface::{Label, Unknowns};
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::State;

const UNREACHED: u8 = 0;
const REACHED: u8 = 1;
/// Reached in the sweep under way, which must not build on it.
const FRESH: u8 = 2;
const NO_PART: u8 = 3;

#[derive(Debug)]
pub struct Connectivity {
    radius_m: f64,
    reach: Vec<AtomicU8>,
    /// Whether a bucket holds a reached particle.
    reached_in: Vec<bool>,
    enclosed: Vec<u32>,
}

impl Connectivity {
    pub fn new<C: CandidateSearch>(parameters: &Parameters, state: &State<C>) -> Self {
        Connectivity {
            radius_m: parameters.laplacian_radius_m(),
            reach: (0..state.particles.len()).map(|_| AtomicU8::new(NO_PART)).collect(),
            reached_in: vec![false; state.buckets().grid.len()],
            enclosed: Vec::new(),
        }
    }

    /// The rows of inner particles that are not reached, ascending.
    pub fn find_enclosed<C: CandidateSearch, T: DistanceTest>(
        &mut self,
        unknowns: &Unknowns,
        state: &State<C>,
    ) -> &[u32] {
        self.start_at_surface(unknowns, state);
        let mut left = unknowns.rows.len();
        while left > 0 {
            let found = self.sweep::<C, T>(unknowns, state);
            if found == 0 {
                break;
            }
            left -= found;
            self.count_as_reached(unknowns, state);
        }
        self.enclosed.clear();
        if left > 0 {
            let reach = &self.reach;
            let rows = unknowns.rows.iter().enumerate();
            let lost = rows.filter(|&(_, &i)| reach[i as usize].load(Relaxed) == UNREACHED);
            self.enclosed.extend(lost.map(|(row, _)| row as u32));
        }
        &self.enclosed
    }

    fn start_at_surface<C: CandidateSearch>(&mut self, unknowns: &Unknowns, state: &State<C>) {
        let bucket = &state.buckets().of_particle;
        self.reached_in.fill(false);
        for (i, (reach, label)) in self.reach.iter_mut().zip(&unknowns.label).enumerate() {
            *reach.get_mut() = match label {
                Label::Outside => NO_PART,
                Label::Inner => UNREACHED,
                Label::Surface => {
                    self.reached_in[bucket[i] as usize] = true;
                    REACHED
                }
            };
        }
    }

    /// One level of the flood; returns how many particles it reached.
    fn sweep<C: CandidateSearch, T: DistanceTest>(&mut self, unknowns: &Unknowns, state: &State<C>) -> usize {
        let (near, found) = (state.neighborhood(), AtomicUsize::new(0));
        let (reach, reached_in) = (&self.reach, &self.reached_in);
        let is_reached = |j: usize| reach[j].load(Relaxed) == REACHED;
        let holds_reached = |bucket: usize| reached_in[bucket];
        state.team().run(unknowns.rows.len(), |range| {
            let mut found_here = 0;
            for &i in &unknowns.rows[range] {
                let i = i as usize;
                if reach[i].load(Relaxed) == UNREACHED
                    && near.has_neighbor::<T>(i, self.radius_m, holds_reached, is_reached)
                {
                    reach[i].store(FRESH, Relaxed);
                    found_here += 1;
                }
            }
            found.fetch_add(found_here, Relaxed);
        });
        found.into_inner()
    }

    /// Lets the next sweep build on what the last one reached.
    fn count_as_reached<C: CandidateSearch>(&mut self, unknowns: &Unknowns, state: &State<C>) {
        let bucket = &state.buckets().of_particle;
        for &i in &unknowns.rows {
            let reach = self.reach[i as usize].get_mut();
            if *reach == FRESH {
                *reach = REACHED;
                self.reached_in[bucket[i as usize] as usize] = true;
            }
        }
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.reach[..]) + size_of_val(&self.reached_in[..])
    }
}
