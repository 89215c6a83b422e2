//! What the VTU files hold, read back twice: by a small decoder of our own that shares no code with the writer, and by
//! meshio where Python has it.

use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::Command;

use flate2::read::ZlibDecoder;
use repro::engine::particles::{Kind, Particles};
use repro::scene::output::{Moment, pvd, vtu};

/// More particles than a block of compressed bytes holds, every fifth a ghost.
fn particles() -> Particles {
    let mut random = fastrand::Rng::with_seed(11);
    let count = 7001;
    let mut vectors = || (0..count).map(|_| [0; 3].map(|_| random.f64() - 0.5)).collect::<Vec<_>>();
    let (position, velocity) = (vectors(), vectors());
    Particles {
        kind: (0..count).map(|i| if i % 5 == 4 { Kind::Ghost } else { Kind::ALL[i % 3] }).collect(),
        pressure: position.iter().map(|x| 1e5 * x[1]).collect(),
        number_density: velocity.iter().map(|u| u[0]).collect(),
        position,
        velocity,
        ..Particles::default()
    }
}

/// The bytes of the array of that name: its offset from the XML, block headers from the appended section.
fn array(file: &[u8], name: &str) -> Vec<u8> {
    let begin = file.windows(2).position(|pair| pair == b"\n_").unwrap() + 2;
    let xml = std::str::from_utf8(&file[..begin]).unwrap();
    let element = xml.split("<DataArray").find(|e| e.contains(&format!("Name=\"{name}\""))).unwrap();
    let offset: usize =
        element.split("offset=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap();
    let mut rest = &file[begin + offset..];
    let mut number = || {
        let (bytes, more) = rest.split_at(8);
        rest = more;
        u64::from_le_bytes(bytes.try_into().unwrap()) as usize
    };
    let (blocks, size, last) = (number(), number(), number());
    let compressed: Vec<usize> = (0..blocks).map(|_| number()).collect();
    let mut bytes = Vec::new();
    for (k, length) in compressed.into_iter().enumerate() {
        let before = bytes.len();
        ZlibDecoder::new(&rest[..length]).read_to_end(&mut bytes).unwrap();
        rest = &rest[length..];
        let expected = if k + 1 == blocks && last > 0 { last } else { size };
        assert_eq!(bytes.len() - before, expected, "block {k} of {name}");
    }
    bytes
}

fn doubles(bytes: &[u8]) -> Vec<f64> {
    bytes.chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect()
}

fn integers(bytes: &[u8]) -> Vec<i64> {
    bytes.chunks(8).map(|b| i64::from_le_bytes(b.try_into().unwrap())).collect()
}

#[test]
fn every_column_comes_back_to_the_last_bit() {
    let particles = particles();
    let moment = Moment { step: 3, time_s: 0.009, particles: &particles };
    for with_ghosts in [false, true] {
        let file = vtu::encode(&moment, with_ghosts).unwrap();
        let kept: Vec<usize> =
            (0..particles.len()).filter(|&i| with_ghosts || particles.kind[i] != Kind::Ghost).collect();
        assert!(String::from_utf8_lossy(&file).contains(&format!("NumberOfPoints=\"{}\"", kept.len())));
        assert_eq!(doubles(&array(&file, "TimeValue")), [0.009]);
        assert_eq!(integers(&array(&file, "id")), kept.iter().map(|&i| i as i64).collect::<Vec<_>>());
        let kinds: Vec<u8> = kept.iter().map(|&i| particles.kind[i] as u8).collect();
        assert_eq!(array(&file, "kind"), kinds);
        let vectors = [("Points", &particles.position), ("velocity_m_s", &particles.velocity)];
        for (name, column) in vectors {
            assert_eq!(
                doubles(&array(&file, name)),
                kept.iter().flat_map(|&i| column[i]).collect::<Vec<_>>()
            );
        }
        let scalars = [("pressure_pa", &particles.pressure), ("number_density", &particles.number_density)];
        for (name, column) in scalars {
            assert_eq!(doubles(&array(&file, name)), kept.iter().map(|&i| column[i]).collect::<Vec<_>>());
        }
        let count = kept.len() as i64;
        assert_eq!(integers(&array(&file, "connectivity")), (0..count).collect::<Vec<_>>());
        assert_eq!(integers(&array(&file, "offsets")), (1..=count).collect::<Vec<_>>());
        assert_eq!(array(&file, "types"), vec![1; kept.len()]);
    }
}

/// Prints what meshio reads: count, cell type, and a sum of each array that both programs take in the same order.
const READER: &str = r#"
import sys, math, meshio
mesh = meshio.read(sys.argv[1])
print(len(mesh.points), mesh.cells[0].type, len(mesh.cells[0].data))
for name, values in [("Points", mesh.points)] + sorted(mesh.point_data.items()):
    print(name, values.dtype, len(values.shape), values.size, repr(math.fsum(float(v) for v in values.ravel())))
"#;

/// Python with meshio, which the environment may name; `None` where there is none, which is said.
fn python() -> Option<String> {
    let python = std::env::var("REPRO_PYTHON").unwrap_or_else(|_| "python3".to_string());
    match Command::new(&python).args(["-c", "import meshio"]).output() {
        Ok(output) if output.status.success() => Some(python),
        _ => {
            eprintln!("skipped: `{python}` has no meshio (REPRO_PYTHON names a Python that has)");
            None
        }
    }
}

#[test]
fn meshio_reads_the_same_numbers() {
    let Some(python) = python() else {
        return;
    };
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("particles.vtu");
    let particles = particles();
    vtu::write(&path, &Moment { step: 3, time_s: 0.009, particles: &particles }, true).unwrap();
    let output = Command::new(python).args(["-c", READER]).arg(&path).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let count = particles.len();
    assert!(text.starts_with(&format!("{count} vertex {count}\n")), "{text}");
    for (name, kind, size) in [
        ("Points", "float64 2", 3 * count),
        ("id", "int64 1", count),
        ("kind", "uint8 1", count),
        ("velocity_m_s", "float64 2", 3 * count),
        ("pressure_pa", "float64 1", count),
        ("number_density", "float64 1", count),
    ] {
        assert!(text.contains(&format!("{name} {kind} {size} ")), "{name}: {text}");
    }
    let sum: f64 = text
        .lines()
        .find_map(|line| line.strip_prefix("pressure_pa float64 1 7001 "))
        .unwrap()
        .parse()
        .unwrap();
    assert!((sum - particles.pressure.iter().sum::<f64>()).abs() < 1e-6, "{sum}");
}

#[test]
fn a_series_is_valid_after_every_frame() {
    let place = tempfile::tempdir().unwrap();
    let particles = particles();
    let mut series = pvd::Series::new(place.path(), false);
    for (step, time_s) in [(0, 0.0), (10, 0.03)] {
        series.add(&Moment { step, time_s, particles: &particles }).unwrap();
        let list = fs::read_to_string(place.path().join(pvd::FILE_NAME)).unwrap();
        let files: Vec<&str> = list.split("file=\"").skip(1).map(|e| e.split('"').next().unwrap()).collect();
        assert_eq!(files.last(), Some(&vtu::file_name(step).as_str()));
        assert!(files.iter().all(|file| place.path().join(file).is_file()));
        assert!(list.contains(&format!("timestep=\"{time_s}\"")) && list.ends_with("</VTKFile>\n"));
    }
    assert_eq!(fs::read_dir(place.path()).unwrap().count(), 3, "two moments and their list");
    let gone = pvd::Series::new(Path::new("no/such/folder"), false)
        .add(&Moment { step: 0, time_s: 0.0, particles: &particles })
        .unwrap_err();
    assert!(format!("{gone:#}").contains("particles-000000.vtu"), "{gone:#}");
}
