//! From records to what people read: pure functions of a run folder. Rendering it again anywhere gives the same bytes.

pub mod archive;
mod assets;
pub mod chart;
pub mod claim;
pub mod compare;
pub mod compared;
pub mod effort;
pub mod export;
pub mod language_or_layout;
pub mod manifest;
mod markdown;
pub mod measured;
pub mod measured_front;
pub mod model;
pub mod noise;
pub mod observations;
pub mod page;
pub mod published;
pub mod samples;
pub mod section;
pub mod summary;
pub mod table;
pub mod twin;
pub mod validation;
pub mod work_precision;
pub mod write_up;
