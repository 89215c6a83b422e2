//! From records to what people read: pure functions of a run folder. Rendering it again anywhere gives the same bytes.

pub mod chart;
pub mod claim;
pub mod compare;
pub mod export;
pub mod measured;
pub mod measured_front;
pub mod model;
pub mod observations;
pub mod page;
pub mod published;
pub mod samples;
pub mod section;
pub mod summary;
pub mod table;
pub mod work_precision;
