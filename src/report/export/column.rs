//! What a table is, apart from its rows: columns with a type, a unit and a meaning.

use jiff::Timestamp;
use serde_json::Value as Json;

use crate::report::export::value::Value;

/// What the cells of a column are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Text, whatever it looks like.
    Text,
    Integer,
    Number,
    Boolean,
    /// A point in time, UTC.
    Time,
    /// Each cell is what it is: properties of different types under one another.
    Any,
}

/// A column of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Column {
    /// As in the header. Where the unit belongs to the name, it ends in it: `time_s`.
    pub name: &'static str,
    pub kind: Kind,
    /// The unit of numbers: SI, `1` for a ratio, or what is counted; empty for everything else.
    pub unit: &'static str,
    pub description: &'static str,
}

/// A table of a run.
#[derive(Debug, PartialEq, Eq)]
pub struct Table {
    /// The name of its file, sheet and key.
    pub name: &'static str,
    pub title: &'static str,
    /// What a row is.
    pub description: &'static str,
    pub columns: &'static [Column],
}

impl Kind {
    /// The name of the type in a Frictionless Table Schema.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Text => "string",
            Kind::Integer => "integer",
            Kind::Number => "number",
            Kind::Boolean => "boolean",
            Kind::Time => "datetime",
            Kind::Any => "any",
        }
    }

    /// The cell for a serialised field; `None` where it is of another kind. Empty text is a missing value, and so is a
    /// number that is not finite, which JSON cannot hold.
    pub fn value(self, field: Json) -> Option<Value> {
        match (self, field) {
            (_, Json::Null) => Some(Value::Missing),
            (_, Json::String(text)) if text.is_empty() => Some(Value::Missing),
            (Kind::Text | Kind::Any, Json::String(text)) => Some(Value::Text(text)),
            (Kind::Time, Json::String(text)) => Some(Value::Time(text.parse::<Timestamp>().ok()?)),
            (Kind::Integer, Json::Number(number)) => Some(Value::Integer(number.as_i64()?)),
            (Kind::Number, Json::Number(number)) => Some(Value::Number(number.as_f64()?)),
            (Kind::Any, Json::Number(number)) => match number.as_i64() {
                Some(whole) => Some(Value::Integer(whole)),
                None => Some(Value::Number(number.as_f64()?)),
            },
            (Kind::Boolean | Kind::Any, Json::Bool(answer)) => Some(Value::Boolean(answer)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_field_becomes_a_cell_of_its_columns_kind() {
        let text = |text: &str| Some(Value::Text(text.to_string()));
        assert_eq!(Kind::Text.value(json!("12345e67")), text("12345e67"));
        assert_eq!(Kind::Any.value(json!("1-2")), text("1-2"));
        assert_eq!(Kind::Integer.value(json!(7)), Some(Value::Integer(7)));
        assert_eq!(Kind::Number.value(json!(7)), Some(Value::Number(7.0)));
        assert_eq!(Kind::Any.value(json!(0.5)), Some(Value::Number(0.5)));
        assert_eq!(Kind::Boolean.value(json!(true)), Some(Value::Boolean(true)));
        let time = Timestamp::from_second(1_795_398_918).unwrap();
        assert_eq!(Kind::Time.value(json!(time.to_string())), Some(Value::Time(time)));
    }

    #[test]
    fn nothing_is_made_up_where_a_value_is_missing_or_of_another_kind() {
        let kinds = [Kind::Text, Kind::Integer, Kind::Number, Kind::Boolean, Kind::Time, Kind::Any];
        for kind in kinds {
            assert_eq!(kind.value(json!("")), Some(Value::Missing));
            assert_eq!(kind.value(json!(f64::NAN)), Some(Value::Missing));
        }
        assert_eq!(Kind::Time.value(json!("yesterday")), None);
        assert_eq!(Kind::Integer.value(json!(0.5)), None);
        assert_eq!(Kind::Number.value(json!("0.5")), None);
        assert_eq!(Kind::Text.value(json!(1)), None);
    }
}
