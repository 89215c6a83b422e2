//! Geometry: what a scene file's `[geometry]` places, and what it refuses.

mod existing_scenes;
