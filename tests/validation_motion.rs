//! Walls that move, fluid that comes and goes, and rigid bodies, held to known answers.

mod outcomes;

use repro::scene::validation::{bodies, flow_boundaries, waves};

#[test]
fn a_piston_makes_waves_of_the_height_of_linear_theory() {
    outcomes::pass(waves::wavemaker);
}

#[test]
fn a_tank_has_its_natural_period() {
    outcomes::pass(waves::natural_period);
}

#[test]
fn a_tank_that_sways_is_a_frame_that_sways() {
    outcomes::pass(waves::two_frames);
}

#[test]
fn what_comes_in_goes_out_or_stays() {
    outcomes::pass(flow_boundaries::channel_flow);
}

#[test]
fn a_mould_fills_to_the_level_of_its_volume() {
    outcomes::pass(flow_boundaries::filling);
}

#[test]
fn a_body_in_free_flight_keeps_its_momenta() {
    outcomes::pass(bodies::free_flight);
}

#[test]
fn a_box_floats_as_deep_as_it_is_heavy() {
    outcomes::pass(bodies::floating_box);
}

#[test]
fn a_box_heaves_with_its_added_mass() {
    outcomes::pass(bodies::heave);
}

#[test]
fn a_heavy_box_sinks() {
    outcomes::pass(bodies::sinking_box);
}
