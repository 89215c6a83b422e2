//! Frames that are shaken or turn.

mod outcomes;

use repro::scene::validation::frame;

#[test]
fn a_free_particle_follows_the_spiral() {
    outcomes::pass(frame::spiral);
}

#[test]
fn water_in_a_cup_that_turns_has_a_parabola_as_its_surface() {
    outcomes::pass(frame::rotating_cup);
}
