//! The particles of one step as a CSV file, written so that reading it back gives the same bits.

use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use serde::{Deserialize, Serialize};

use crate::base::files::write_whole;
use crate::engine::particles::{InitialParticle, Kind, Particles};

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Row<'a> {
    id: usize,
    kind: &'a str,
    x_m: f64,
    y_m: f64,
    z_m: f64,
    u_m_s: f64,
    v_m_s: f64,
    w_m_s: f64,
    p_pa: f64,
    n: f64,
}

/// The file's name for a step.
pub fn file_name(step: usize) -> String {
    format!("particles-{step:06}.csv")
}

/// Writes all particles to `path`, whole or not at all. Pressure and number density are 0 in a scene without them.
pub fn write(path: &Path, particles: &Particles) -> Result<()> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for i in 0..particles.len() {
        let ([x_m, y_m, z_m], [u_m_s, v_m_s, w_m_s]) = (particles.position[i], particles.velocity[i]);
        let column = |values: &[f64]| values.get(i).copied().unwrap_or(0.0);
        let (p_pa, n) = (column(&particles.pressure), column(&particles.number_density));
        let kind = particles.kind[i].name();
        writer.serialize(Row { id: i, kind, x_m, y_m, z_m, u_m_s, v_m_s, w_m_s, p_pa, n })?;
    }
    write_whole(path, &writer.into_inner()?).with_context(|| format!("cannot write {}", path.display()))
}

/// Reads particles back. Every line is checked: identities in order, known kinds, finite numbers.
pub fn read(path: &Path) -> Result<Vec<InitialParticle>> {
    let name = path.display();
    let mut reader = csv::Reader::from_path(path).with_context(|| format!("cannot read {name}"))?;
    let headers = reader.headers()?.clone();
    let mut record = csv::StringRecord::new();
    let mut particles = Vec::new();
    while reader.read_record(&mut record).with_context(|| format!("{name} is not a CSV of particles"))? {
        let line = particles.len() + 2;
        let row: Row<'_> =
            record.deserialize(Some(&headers)).with_context(|| format!("{name}, line {line}"))?;
        ensure!(
            row.id == particles.len(),
            "{name}, line {line}: id is {}, expected {}",
            row.id,
            particles.len()
        );
        let Some(kind) = Kind::from_name(row.kind) else {
            bail!("{name}, line {line}: kind is `{}`; allowed are fluid, wall, dummy_wall, ghost", row.kind);
        };
        let (position, velocity) = ([row.x_m, row.y_m, row.z_m], [row.u_m_s, row.v_m_s, row.w_m_s]);
        let finite = position.iter().chain(&velocity).all(|v| v.is_finite()) && row.p_pa.is_finite();
        ensure!(finite, "{name}, line {line}: a value is not finite");
        particles.push(InitialParticle {
            velocity,
            pressure: row.p_pa,
            ..InitialParticle::at_rest(kind, position)
        });
    }
    ensure!(!particles.is_empty(), "{name} holds no particle");
    Ok(particles)
}
