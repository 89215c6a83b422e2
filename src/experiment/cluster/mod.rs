//! A run spread over the nodes of a cluster, as job arrays of Slurm.
//!
//! What is asked for is frozen in the run folder when it is submitted (`submission`). A first job opens the run on a node
//! and leaves the states that later rounds start from; each task of the arrays then runs one whole block, so that whatever
//! is special about a node disturbs all cells of a block alike (`blocks`, `task`). Which blocks are missing is read from
//! the folder alone (`outstanding`, `gather`), never from Slurm's accounts; `array` deals missing blocks to arrays that
//! the cluster takes, `job` writes what is handed to `sbatch` with the time `limits`, and `slurm` asks the cluster.

pub mod array;
pub mod blocks;
pub mod gather;
pub mod job;
pub mod limits;
pub mod outstanding;
pub mod slurm;
pub mod submission;
pub mod task;

/// Where a run folder keeps what was submitted.
pub const SUBMISSION_FILE: &str = "slurm/submission.json";
