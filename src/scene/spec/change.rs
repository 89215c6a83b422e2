//! Changes to a scene from the command line or an experiment: `dotted.key=value`.

use super::effects::EffectsSpec;
use crate::base::input::InputError;

/// Sets the value behind a dotted key; `false` removes the table there, which switches an effect off. A key that the
/// scene format does not know is refused when the scene is read.
pub fn apply(table: &mut toml::Table, set: &str, file: &str) -> Result<(), InputError> {
    let wrong = |allowed: &str| InputError::new(file, "--set", format!("`{set}`"), allowed.to_string());
    let (key, value) = set.split_once('=').ok_or_else(|| wrong("allowed is `dotted.key=value`"))?;
    let value = format!("value = {value}")
        .parse::<toml::Table>()
        .ok()
        .and_then(|mut parsed| parsed.remove("value"))
        .unwrap_or_else(|| toml::Value::String(value.to_string()));
    let mut path: Vec<&str> = key.split('.').collect();
    let last =
        path.pop().filter(|last| !last.is_empty()).ok_or_else(|| wrong("allowed is `dotted.key=value`"))?;
    let mut target = table;
    for part in path {
        let entry = target.entry(part).or_insert_with(|| toml::Value::Table(toml::Table::new()));
        target = entry.as_table_mut().ok_or_else(|| wrong("a part of its key is a value, not a table"))?;
    }
    if value == toml::Value::Boolean(false) {
        return remove_table(target, last, key).map_err(|allowed| wrong(&allowed));
    }
    // A whole number is as good as a decimal one where a length or a time is asked for.
    let value = match (target.get(last), value) {
        (Some(toml::Value::Float(_)), toml::Value::Integer(whole)) => toml::Value::Float(whole as f64),
        (_, value) => value,
    };
    target.insert(last.to_string(), value);
    Ok(())
}

/// Removes the table `last` of `target`. An effect that the scene does not name is off already; any other missing table
/// is a mistake that nothing would notice later.
fn remove_table(target: &mut toml::Table, last: &str, key: &str) -> Result<(), String> {
    match target.get(last) {
        Some(toml::Value::Table(_)) => {
            target.remove(last);
            Ok(())
        }
        None if key.strip_prefix("effects.").is_some_and(|name| EffectsSpec::NAMES.contains(&name)) => Ok(()),
        Some(_) => Err("`false` removes a table, and this key is a value".to_string()),
        None => {
            let effects = EffectsSpec::NAMES
                .iter()
                .map(|name| format!("effects.{name}"))
                .collect::<Vec<_>>()
                .join(", ");
            Err(format!(
                "`false` removes a table, and there is none; allowed besides the scene's own are {effects}"
            ))
        }
    }
}
