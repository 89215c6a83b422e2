//! Who has which boundary condition: free surface, unknown pressure, or none.

use crate::base::parallel::Rows;
use crate::engine::parameters::Parameters;
use crate::engine::particles::Kind;
use crate::engine::pressure::Pressure;
use crate::engine::pressure::options::{Surface, Walls};
use crate::engine::search::{CandidateSearch, NONE};
use crate::engine::stage::State;

/// A particle's part in the pressure equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u8)]
pub enum Label {
    /// Dummy walls, ghosts and walls that are mirrors: no pressure of their own.
    #[default]
    Outside,
    /// `n_i < beta n0`, and where the scene says so [lopsided](ASYMMETRY) as well: pressure zero.
    Surface,
    /// Everyone else: pressure unknown.
    Inner,
}

/// Asymmetry of its neighbours above which a particle of low number density is on the surface. Inside the fluid the number
/// density falls below the threshold again and again, and labels that come and go are the main source of noise at rest.
const ASYMMETRY: f64 = 0.2;
/// Share of `n0` below which a particle is on the surface whatever the asymmetry: an isolated one has none.
const SPARSE: f64 = 0.75;

/// The labels of all particles, and the numbering of the unknowns.
#[derive(Debug)]
pub struct Unknowns {
    /// `beta n0`.
    threshold: f64,
    /// [`SPARSE`] `n0`.
    sparse: f64,
    /// Whether particles on the surface have rows as well.
    truncated: bool,
    /// Whether walls are mirrors.
    mirrored: bool,
    pub label: Vec<Label>,
    /// The particle of each row, ascending.
    pub rows: Vec<u32>,
    /// The row of each inner particle; [`NONE`] for the others.
    pub row_of: Vec<u32>,
}

impl Unknowns {
    pub fn new<C: CandidateSearch>(pressure: &Pressure, parameters: &Parameters, state: &State<C>) -> Self {
        let count = state.particles.len();
        let reference = parameters.reference(parameters.number_density_radius_m());
        Unknowns {
            threshold: pressure.surface_threshold * reference.number_density,
            sparse: SPARSE * reference.number_density,
            truncated: pressure.surface == Surface::Truncated,
            mirrored: pressure.walls == Walls::Mirrored,
            label: state.workers.column(count, Label::Outside),
            rows: Vec::with_capacity(count),
            row_of: state.workers.column(count, NONE),
        }
    }

    /// Labels every particle by its number density and, where `asymmetry` is not empty, that of its neighbours; and
    /// numbers the inner ones.
    pub fn find<C: CandidateSearch>(&mut self, asymmetry: &[f64], state: &State<C>) {
        let (kind, n, threshold, sparse, mirrored) = (
            &state.particles.kind,
            &state.particles.number_density,
            self.threshold,
            self.sparse,
            self.mirrored,
        );
        let lopsided = |i: usize| asymmetry.is_empty() || asymmetry[i] > ASYMMETRY || n[i] < sparse;
        state.team().fill(Rows::new(&mut self.label), |range, label| {
            for (i, label) in range.zip(label) {
                *label = match kind[i] {
                    Kind::DummyWall | Kind::Ghost => Label::Outside,
                    Kind::Wall if mirrored => Label::Outside,
                    Kind::Fluid | Kind::Wall | Kind::Body if n[i] < threshold && lopsided(i) => {
                        Label::Surface
                    }
                    Kind::Fluid | Kind::Wall | Kind::Body => Label::Inner,
                };
            }
        });
        self.rows.clear();
        for (i, (&label, row)) in self.label.iter().zip(&mut self.row_of).enumerate() {
            *row = NONE;
            if label == Label::Inner || (self.truncated && label == Label::Surface) {
                *row = self.rows.len() as u32;
                self.rows.push(i as u32);
            }
        }
    }

    pub fn surface_count(&self) -> usize {
        self.label.iter().filter(|&&label| label == Label::Surface).count()
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.label[..]) + size_of_val(&self.row_of[..]) + self.rows.capacity() * size_of::<u32>()
    }
}
