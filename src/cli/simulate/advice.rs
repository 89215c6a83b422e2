//! `--advise`: what the scene's own numbers say about its effects.

use std::io::{self, Write};

use serde::Serialize;

use crate::engine::particles::InitialParticle;
use crate::scene::Scene;
use crate::scene::adviser::{self, Advice, Scales, THRESHOLD};

/// What is said, as JSON has it too.
#[derive(Debug, Serialize)]
pub struct Advised {
    scene: String,
    /// The estimated change below which an effect is negligible.
    threshold: f64,
    scales: Scales,
    advice: Vec<Advice>,
    /// Effects that are named and not judged: aids of the scheme, walls and the like.
    not_judged: Vec<&'static str>,
}

impl Advised {
    pub fn new(scene: &Scene, initial: &[InitialParticle]) -> Advised {
        let (scales, named) = (Scales::of(scene, initial), scene.effects.named());
        let advice = adviser::advise(&scales, &named);
        let judged = |name: &str| advice.iter().any(|advice| advice.judges(name));
        let not_judged = named.iter().copied().filter(|name| !judged(name)).collect();
        Advised { scene: scene.name.clone(), threshold: THRESHOLD, scales, advice, not_judged }
    }

    pub fn print(&self, out: &mut dyn Write) -> io::Result<()> {
        let Scales { length_m, speed_m_s, time_s, particle_distance_m, .. } = self.scales;
        writeln!(
            out,
            "{}: L = {length_m:.4} m, U = {speed_m_s:.4} m/s, T = {time_s} s, l0 = L / {:.0}",
            self.scene,
            length_m / particle_distance_m
        )?;
        writeln!(
            out,
            "estimates are orders of magnitude; an effect that changes less than {THRESHOLD} is negligible"
        )?;
        for advice in &self.advice {
            let numbers: Vec<String> =
                advice.numbers.iter().map(|(symbol, value)| format!("{symbol} = {value:.3e}")).collect();
            let error = advice.error.map_or("unknown".to_string(), |error| format!("{error:.1e}"));
            let (effect, verdict) = (advice.effect.replace('_', " "), advice.verdict.in_words());
            writeln!(out, "{effect:16} {verdict:26} without it {error:8} {}", numbers.join(", "))?;
            writeln!(out, "{:16} {}", "", advice.why)?;
        }
        match self.not_judged.as_slice() {
            [] => Ok(()),
            names => writeln!(out, "named and not judged: {}", names.join(", ")),
        }
    }
}
