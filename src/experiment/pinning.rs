//! Which CPUs workers stay on.

use std::path::Path;

use anyhow::{Context, Result};

use crate::base::input::InputError;
use crate::experiment::machine::{Topology, allowed_cpus};

/// The CPUs to pin to: `off`, `close` or `spread`.
pub fn pin_order(pin: &str) -> Result<Vec<usize>> {
    let topology = Topology::read(Path::new("/"), &allowed_cpus());
    match pin {
        "off" => Ok(Vec::new()),
        "close" => Ok(topology.pin_order_close()),
        "spread" => Ok(topology.pin_order_spread()),
        _ => Err(InputError::new("command line", "pin", pin, "allowed are `off`, `close` or `spread`"))
            .context("pinning"),
    }
}
