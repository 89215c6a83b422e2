//! Pure helpers without any knowledge of particles: small vectors, statistics, parallel loops, files and input errors.

pub mod dispatch;
pub mod files;
pub mod input;
pub mod large_pages;
pub mod parallel;
pub mod prefetch;
pub mod schedule;
pub mod simd;
pub mod statistics;
pub mod vec3;
