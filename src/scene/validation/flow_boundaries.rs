//! Fluid that comes in and goes out: what is counted, and a channel.

use super::plane::{self, G};
use super::{Fidelity, Outcome};
use crate::engine::effects::flow_boundaries::{FlowBoundaries, FlowReport, Inflow, Outflow};
use crate::engine::effects::gravity::Gravity;
use crate::engine::parameters::Effects;
use crate::engine::particles::{InitialParticle, Kind, Particles};

/// A channel between two walls, `columns` long and `rows` wide, its layers' room counted in.
fn channel(l0: f64, columns: i32, rows: i32) -> Vec<InitialParticle> {
    let mut particles = Vec::new();
    for i in -5..columns {
        for j in (-4..0).chain(rows..rows + 4) {
            let outer = j < -2 || j >= rows + 2;
            let kind = if outer { Kind::DummyWall } else { Kind::Wall };
            particles.push(InitialParticle::at_rest(kind, plane::cell(l0, i, j)));
        }
    }
    particles
}

/// Water at one speed through a channel between walls without friction: what comes in, what goes out, what is there.
/// Without gravity; the far end is free.
pub fn channel_flow(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let rows = match fidelity {
        Fidelity::Coarse => 8,
        Fidelity::Full => 16,
    };
    let (width_m, speed_m_s) = (0.2, 0.5);
    let l0 = width_m / f64::from(rows);
    let columns = 3 * rows;
    let length_m = f64::from(columns) * l0;
    let reserve = (columns + 12) * rows;
    let mut particles = channel(l0, columns, rows);
    let waiting = InitialParticle::at_rest(Kind::Ghost, plane::cell(l0, 0, 0));
    particles.extend(std::iter::repeat_n(waiting, reserve as usize));
    let inflow = Inflow {
        low_m: [0.0; 3],
        high_m: [0.0, width_m, 0.0],
        axis: 0,
        speed_m_s,
        group: 0,
        temperature: 0.0,
        concentration: 0.0,
    };
    let outflow = Outflow { low_m: [length_m, -1.0, -1.0], high_m: [length_m + 1.0, 1.0, 1.0] };
    let boundaries = FlowBoundaries { inflows: vec![inflow], outflows: vec![outflow] };
    let effects = Effects {
        gravity: Some(Gravity { acceleration_m_s2: [0.0; 3] }),
        flow_boundaries: Some(boundaries),
        ..plane::water_effects()
    };
    let dt = 0.1 * l0 / speed_m_s;
    let parameters = plane::parameters(l0, dt, &particles, 0.3, effects);
    let mut simulation = plane::start(&parameters, &particles)?;
    let passage_s = length_m / speed_m_s;
    let (mut unbalanced, mut late, mut speeds) = (0usize, 0.0f64, Vec::new());
    let steps = (4.0 * passage_s / dt) as usize;
    let mut ghosts = 0;
    for step in 1..=steps {
        let report = plane::step(&mut *simulation)?;
        let FlowReport { entered, left, reserve: waiting } = report.flow.ok_or("no report of the flow")?;
        let now = simulation.particles().count(Kind::Fluid);
        let balanced = entered == now + left + report.ghosts
            && waiting + report.ghosts == simulation.particles().count(Kind::Ghost);
        unbalanced += usize::from(!balanced);
        ghosts = report.ghosts;
        let expected = speed_m_s * report.time_s * width_m / (l0 * l0);
        late = late.max((entered as f64 - expected).abs() / f64::from(rows));
        if step > steps / 2 {
            speeds.push(mean_speed(simulation.particles(), [0.25 * length_m, 0.75 * length_m]));
        }
    }
    let balance = Outcome {
        effect: "flow_boundaries",
        case: "water through a channel",
        quantity: "steps in which in - out is not what is there (error: their number)",
        value: unbalanced as f64,
        reference: 0.0,
        error: unbalanced as f64,
        gate: 0.0,
        source: "particles are counted",
    };
    let rate = Outcome {
        quantity: "what came in less speed x area x time, layers (error: the same)",
        value: late,
        error: late,
        gate: 1.0 + 1e-9,
        source: "speed x area",
        ..balance.clone()
    };
    let mean = speeds.iter().sum::<f64>() / speeds.len() as f64;
    let speed = Outcome {
        quantity: "mean speed in the middle of the channel over the later half, m/s",
        value: mean,
        reference: speed_m_s,
        error: (mean / speed_m_s - 1.0).abs(),
        gate: 0.02,
        source: "continuity",
        ..balance.clone()
    };
    let lost = Outcome {
        quantity: "particles lost through walls (error: their number)",
        value: ghosts as f64,
        error: ghosts as f64,
        source: "walls are tight",
        ..balance.clone()
    };
    Ok(vec![balance, rate, speed, lost])
}

fn mean_speed(particles: &Particles, [from, to]: [f64; 2]) -> f64 {
    let between =
        |&i: &usize| particles.kind[i] == Kind::Fluid && (from..to).contains(&particles.position[i][0]);
    let (mut count, mut sum) = (0.0, 0.0);
    for i in (0..particles.len()).filter(between) {
        (count, sum) = (count + 1.0, sum + particles.velocity[i][0]);
    }
    sum / count
}

/// A closed box fills from an opening in its side: the level that the volume asks for, once it has come to rest.
pub fn filling(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let columns = match fidelity {
        Fidelity::Coarse => 16,
        Fidelity::Full => 32,
    };
    let width_m = 0.4;
    let l0 = width_m / f64::from(columns);
    let gate = columns / 8;
    let (low, high) = (0, gate);
    let mut particles: Vec<InitialParticle> = plane::walls(l0, columns, columns, 0);
    particles.retain(|p| {
        let row = (p.position[1] / l0).floor() as i32;
        p.position[0] > 0.0 || !(low..high).contains(&row)
    });
    let reserve = columns * columns / 2;
    let waiting = InitialParticle::at_rest(Kind::Ghost, plane::cell(l0, 0, 0));
    particles.extend(std::iter::repeat_n(waiting, reserve as usize));
    let inflow = Inflow {
        low_m: [0.0, f64::from(low) * l0, 0.0],
        high_m: [0.0, f64::from(high) * l0, 0.0],
        axis: 0,
        speed_m_s: 0.5,
        group: 0,
        temperature: 0.0,
        concentration: 0.0,
    };
    let boundaries = FlowBoundaries { inflows: vec![inflow], outflows: Vec::new() };
    let effects = Effects { flow_boundaries: Some(boundaries), ..plane::water_effects() };
    let dt = 0.06 * l0 / (G * 0.5 * width_m).sqrt();
    let parameters = plane::parameters(l0, dt, &particles, 0.3, effects);
    let mut simulation = plane::start(&parameters, &particles)?;
    let area = f64::from(gate) * l0;
    let level_m = 0.35 * width_m;
    let steps = (level_m * width_m / (0.5 * area) / dt) as usize;
    let mut entered = 0;
    for _ in 0..steps {
        entered = plane::step(&mut *simulation)?.flow.map_or(0, |flow| flow.entered);
    }
    let expected = entered as f64 * l0 * l0 / width_m;
    let places: Vec<f64> = (4..columns - 2).map(|i| plane::cell(l0, i, 0)[0]).collect();
    let heights: Vec<f64> =
        places.iter().filter_map(|&x| plane::surface_m(simulation.particles(), x, l0)).collect();
    let level = heights.iter().sum::<f64>() / heights.len() as f64;
    Ok(vec![Outcome {
        effect: "flow_boundaries",
        case: "a mould that fills from its side",
        quantity: "mean level, particle distances (error: difference)",
        value: level / l0,
        reference: expected / l0,
        error: (level - expected).abs() / l0,
        gate: 1.0,
        source: "the volume that came in",
    }])
}
