//! What an artifact committee wants, in one file: the run folder, what was asked, what the paper says, and how to do it again.
//!
//! The same run gives the same bytes, wherever and whenever it is packed.

use std::io::{Cursor, Write};
use std::path::Path;

use anyhow::{Context, Result, ensure};
use minijinja::{Environment, context};
use zip::write::{SimpleFileOptions, ZipWriter};
use zip::{CompressionMethod, DateTime};

use crate::base::files::write_whole;
use crate::base::input::InputError;
use crate::experiment::spec::Experiment;
use crate::experiment::{foreign, library, scene_files};
use crate::report::measured::Measured;
use crate::report::{claim, effort, manifest, markdown, page, write_up};

/// The scenes and what the paper says, as they stand in the project.
const EMBEDDED: &[(&str, &str)] = &[
    ("paper/README.md", include_str!("../../paper/README.md")),
    ("paper/claims.toml", include_str!("../../paper/claims.toml")),
    ("paper/martin_moyce_1952.toml", include_str!("../../paper/martin_moyce_1952.toml")),
    ("paper/published.toml", include_str!("../../paper/published.toml")),
    ("paper/threats-to-validity.md", include_str!("../../paper/threats-to-validity.md")),
    ("scenes/coincident-pair.toml", include_str!("../../experiments/scenes/coincident-pair.toml")),
    ("scenes/dam-break.toml", include_str!("../../experiments/scenes/dam-break.toml")),
    ("scenes/dam-break-obstacle.toml", include_str!("../../experiments/scenes/dam-break-obstacle.toml")),
    ("scenes/drop-impact.toml", include_str!("../../experiments/scenes/drop-impact.toml")),
    ("scenes/falling-block.toml", include_str!("../../experiments/scenes/falling-block.toml")),
    ("scenes/filling-mould.toml", include_str!("../../experiments/scenes/filling-mould.toml")),
    ("scenes/floating-box.toml", include_str!("../../experiments/scenes/floating-box.toml")),
    ("scenes/heated-cavity.toml", include_str!("../../experiments/scenes/heated-cavity.toml")),
    ("scenes/leaver.toml", include_str!("../../experiments/scenes/leaver.toml")),
    ("scenes/lone-particle.toml", include_str!("../../experiments/scenes/lone-particle.toml")),
    ("scenes/mud-flow.toml", include_str!("../../experiments/scenes/mud-flow.toml")),
    ("scenes/oscillating-drop.toml", include_str!("../../experiments/scenes/oscillating-drop.toml")),
    ("scenes/piston-wave.toml", include_str!("../../experiments/scenes/piston-wave.toml")),
    ("scenes/rotating-cup.toml", include_str!("../../experiments/scenes/rotating-cup.toml")),
    ("scenes/sloshing-tank.toml", include_str!("../../experiments/scenes/sloshing-tank.toml")),
    ("scenes/still-water.toml", include_str!("../../experiments/scenes/still-water.toml")),
];

/// A file of the archive: its path and its content.
type Packed = (String, Vec<u8>);

/// Packs a run folder into `output` and returns the paths of what is in it. Its manifest is verified first; a run that is
/// not finished is refused unless it is `allowed_unfinished`.
pub fn write(folder: &Path, output: &Path, allowed_unfinished: bool) -> Result<Vec<String>> {
    refuse_output(folder, output)?;
    let measured = Measured::read(folder)?;
    ensure!(
        allowed_unfinished || measured.info.finished_utc.is_some(),
        "{}: the run is not finished; the command `{}` goes on with it, `--unfinished` packs it as it is",
        folder.display(),
        measured.info.command
    );
    let mut packed = Vec::new();
    for file in manifest::verify(folder)? {
        let content = foreign::read(&folder.join(&file))?;
        packed.push((format!("run/{file}"), content));
    }
    for experiment in &measured.info.experiments {
        packed.push(experiment_file(&with_kept_scenes(experiment, &packed))?);
    }
    packed.extend(EMBEDDED.iter().map(|(file, text)| (file.to_string(), text.as_bytes().to_vec())));
    packed.push(("paper/reproduction.md".to_string(), write_up::text(&measured)?.into_bytes()));
    let read_me = read_me(&measured, &packed, folder)?;
    packed.push(("README.md".to_string(), read_me.into_bytes()));
    packed.sort();
    let bytes = zip(&packed)?;
    write_whole(output, &bytes).with_context(|| format!("cannot write {}", output.display()))?;
    Ok(packed.into_iter().map(|(file, _)| file).collect())
}

/// An archive inside the run folder would belong to the next one.
fn refuse_output(folder: &Path, output: &Path) -> Result<(), InputError> {
    let refused = |found: &str| {
        let found = format!("`{}`, which {found}", output.display());
        InputError::new("command line", "--output", found, "allowed is a file outside the run folder")
    };
    if output.is_dir() {
        return Err(refused("is a folder"));
    }
    let parent = output.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let parent = parent.canonicalize().map_err(|error| refused(&format!("cannot be written: {error}")))?;
    match folder.canonicalize() {
        Ok(folder) if parent.starts_with(&folder) => Err(refused("lies in the run folder")),
        _ => Ok(()),
    }
}

/// The experiment as it runs from the archive's folder: with the copies of scenes that its run kept.
fn with_kept_scenes(experiment: &Experiment, packed: &[Packed]) -> Experiment {
    let mut experiment = experiment.clone();
    let cases = experiment.case.iter_mut().map(|case| &mut case.scene);
    let sweeps = experiment.sweep.iter_mut().map(|sweep| &mut sweep.scene);
    for scene in std::iter::once(&mut experiment.scene).chain(cases).chain(sweeps) {
        if let Some(kept) = kept(scene, packed) {
            *scene = kept;
        }
    }
    experiment
}

/// Where the archive has the copy of a scene file; `None` where the run kept none.
fn kept(scene: &str, packed: &[Packed]) -> Option<String> {
    let place = format!("run/{}", scene_files::place(scene));
    packed.iter().any(|(file, _)| *file == place).then_some(place)
}

/// An experiment as its file, with its comments where it is one of the program's.
fn experiment_file(experiment: &Experiment) -> Result<Packed> {
    let same = library::embedded(&experiment.id).is_ok_and(|known| known == *experiment);
    let text = match library::text(&experiment.id).filter(|_| same) {
        Some(text) => text.to_string(),
        None => toml::to_string(experiment).context("an experiment cannot be written as TOML")?,
    };
    Ok((format!("experiments/{}.toml", experiment.id), text.into_bytes()))
}

fn read_me(measured: &Measured, packed: &[Packed], folder: &Path) -> Result<String> {
    let mut environment = Environment::new();
    environment.add_filter("text", markdown::plain);
    environment.add_filter("code", markdown::code);
    environment.add_filter("markdown_table", page::markdown_table);
    environment.add_template("archive.md", include_str!("archive.md"))?;
    let judged = claim::judge_all(measured);
    let efforts = effort::of(measured, folder)?;
    let text = environment.get_template("archive.md")?.render(context! {
        info => &measured.info,
        verdicts => claim::in_short(&judged),
        effort => effort::view(&efforts, &judged),
        foreign_scenes => foreign_scenes(measured, packed),
    })?;
    Ok(text)
}

/// Scenes of the run that are files of whoever ran it and of which it kept no copy. A path in a record is not followed.
fn foreign_scenes<'a>(measured: &'a Measured, packed: &[Packed]) -> Vec<&'a str> {
    let mut scenes: Vec<&str> = Vec::new();
    for experiment in &measured.info.experiments {
        let cases = experiment.case.iter().map(|case| &case.scene);
        let sweeps = experiment.sweep.iter().map(|sweep| &sweep.scene);
        scenes.extend(std::iter::once(&experiment.scene).chain(cases).chain(sweeps).map(String::as_str));
    }
    scenes.retain(|scene| kept(scene, packed).is_none());
    scenes.retain(|scene| EMBEDDED.iter().all(|(file, _)| *file != format!("scenes/{scene}.toml")));
    scenes.sort_unstable();
    scenes.dedup();
    scenes
}

/// A deflated archive without times and owners.
fn zip(packed: &[Packed]) -> Result<Vec<u8>> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::default())
        .unix_permissions(0o644);
    for (file, content) in packed {
        writer.start_file(file.as_str(), options)?;
        writer.write_all(content)?;
    }
    Ok(writer.finish()?.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;

    #[test]
    fn every_scene_of_the_program_is_packed() {
        let packed =
            EMBEDDED.iter().filter_map(|(file, _)| file.strip_prefix("scenes/")?.strip_suffix(".toml"));
        let (mut packed, mut known): (Vec<_>, Vec<_>) = (packed.collect(), scene::library::names().collect());
        packed.sort_unstable();
        known.sort_unstable();
        assert_eq!(packed, known);
    }

    #[test]
    fn an_experiment_that_is_not_the_programs_is_written_so_that_it_reads_back() {
        for name in library::names() {
            let mut experiment = library::embedded(name).unwrap();
            assert_eq!(experiment_file(&experiment).unwrap().1, library::text(name).unwrap().as_bytes());
            experiment.title = "\"quoted\"\nand <more>".to_string();
            let (file, text) = experiment_file(&experiment).unwrap();
            let text = String::from_utf8(text).unwrap();
            assert_eq!(Experiment::parse(&text, &file).unwrap(), experiment);
        }
    }
}
