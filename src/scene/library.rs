//! The scenes that come with the program, so that it works anywhere. A new scene is one new file and one line here.

use std::path::Path;

use crate::base::input::InputError;
use crate::scene::Scene;

/// Name and text of each scene.
const SCENES: &[(&str, &str)] = &[
    ("dam-break", include_str!("../../experiments/scenes/dam-break.toml")),
    ("dam-break-obstacle", include_str!("../../experiments/scenes/dam-break-obstacle.toml")),
    ("still-water", include_str!("../../experiments/scenes/still-water.toml")),
    ("falling-block", include_str!("../../experiments/scenes/falling-block.toml")),
    ("lone-particle", include_str!("../../experiments/scenes/lone-particle.toml")),
    ("drop-impact", include_str!("../../experiments/scenes/drop-impact.toml")),
    ("oscillating-drop", include_str!("../../experiments/scenes/oscillating-drop.toml")),
    ("leaver", include_str!("../../experiments/scenes/leaver.toml")),
    ("coincident-pair", include_str!("../../experiments/scenes/coincident-pair.toml")),
    ("filling-mould", include_str!("../../experiments/scenes/filling-mould.toml")),
    ("floating-box", include_str!("../../experiments/scenes/floating-box.toml")),
    ("piston-wave", include_str!("../../experiments/scenes/piston-wave.toml")),
    ("rotating-cup", include_str!("../../experiments/scenes/rotating-cup.toml")),
    ("sloshing-tank", include_str!("../../experiments/scenes/sloshing-tank.toml")),
    ("heated-cavity", include_str!("../../experiments/scenes/heated-cavity.toml")),
    ("mud-flow", include_str!("../../experiments/scenes/mud-flow.toml")),
];

/// The names of all embedded scenes.
pub fn names() -> impl Iterator<Item = &'static str> {
    SCENES.iter().map(|(name, _)| *name)
}

/// The scene of that name or, where there is such a file, the one it describes: a path given by the user wins.
pub fn load(name_or_path: &str, sets: &[String]) -> Result<Scene, InputError> {
    let path = Path::new(name_or_path);
    if path.is_file() {
        let text = std::fs::read_to_string(path)
            .map_err(|error| InputError::new(name_or_path, "scene", "not readable", error))?;
        return Scene::parse(&text, name_or_path, sets);
    }
    let text =
        SCENES.iter().find(|(name, _)| *name == name_or_path).map(|(_, text)| *text).ok_or_else(|| {
            let known: Vec<&str> = names().collect();
            let allowed = format!("allowed are the path of a scene file or one of: {}", known.join(", "));
            InputError::new("command line", "SCENE", format!("`{name_or_path}`"), allowed)
        })?;
    Scene::parse(text, &format!("scenes/{name_or_path}.toml"), sets)
}
