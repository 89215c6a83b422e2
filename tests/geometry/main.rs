//! Geometry: what a scene file's `[geometry]` places, and what it refuses.

mod example;
mod existing_scenes;
mod lattices;
mod oracle;
mod random_files;
mod refusals;
mod shapes;
mod solids;
mod starts;
mod stl_files;
mod support;
