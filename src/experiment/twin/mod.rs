//! The twin experiment: the loop of the paper's Figure 3 in C with OpenMP and in Rust, from the same state.
//!
//! Both programs walk the linked list and the relocated array in turn and must give the same sums to the last bit. If list
//! over relocated is the same in both, the ratio is the layout's and not the language's. `spec` says what is compared,
//! `plan` makes rounds of it, `prepare` turns a planned trial into a request, with `toolchain` to compile the C program;
//! `trial` is what a child process does, `loops` its part in Rust, and `outcome` what is left behind.

pub mod loops;
pub mod outcome;
pub mod plan;
pub mod prepare;
pub mod spec;
pub mod toolchain;
pub mod trial;
