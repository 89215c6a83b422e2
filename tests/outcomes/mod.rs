//! Runs a case and holds it to its gates.

use repro::scene::validation::{Fidelity, Outcome};

/// Prints what a case found and fails where an error is above its gate. `REPRO_FULL_VALIDATION=1` asks for the full case.
pub fn pass(case: fn(Fidelity) -> Result<Vec<Outcome>, String>) {
    let full = std::env::var_os("REPRO_FULL_VALIDATION").is_some_and(|value| value == "1");
    let found = case(if full { Fidelity::Full } else { Fidelity::Coarse }).unwrap();
    for o in &found {
        println!(
            "{}, {}, {}: {:.6e} for {:.6e}, error {:.2e}, gate {}",
            o.effect, o.case, o.quantity, o.value, o.reference, o.error, o.gate
        );
    }
    for o in &found {
        assert!(o.error <= o.gate, "{o:?}");
    }
}
