//! A cell of a table.

use jiff::Timestamp;
use serde::{Serialize, Serializer};

/// A cell. Numbers are finite.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// Nothing was measured, or nothing applies.
    Missing,
    Text(String),
    Integer(i64),
    Number(f64),
    Boolean(bool),
    Time(Timestamp),
}

impl Value {
    /// Text as it is; nothing where it is empty.
    pub fn text(text: &str) -> Value {
        if text.is_empty() { Value::Missing } else { Value::Text(text.to_string()) }
    }

    /// A time in ISO 8601; other text stays text.
    pub fn time(text: &str) -> Value {
        text.parse().map_or_else(|_| Value::text(text), Value::Time)
    }

    /// What `text` says in `unit`: a number, if there is a unit and the text is one; text otherwise. A name without a
    /// unit may look like a number and is none.
    pub fn quantity(text: &str, unit: &str) -> Value {
        let whole = text.parse().ok().map(Value::Integer);
        let decimal = || text.parse().ok().filter(|number: &f64| number.is_finite()).map(Value::Number);
        let number = if unit.is_empty() { None } else { whole.or_else(decimal) };
        number.unwrap_or_else(|| Value::text(text))
    }
}

/// JSON's types; times as ISO 8601 text.
impl Serialize for Value {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Value::Missing => serializer.serialize_none(),
            Value::Text(text) => serializer.serialize_str(text),
            Value::Integer(number) => serializer.serialize_i64(*number),
            Value::Number(number) => serializer.serialize_f64(*number),
            Value::Boolean(answer) => serializer.serialize_bool(*answer),
            Value::Time(time) => serializer.collect_str(time),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_has_a_unit_is_a_number() {
        assert_eq!(Value::quantity("32768", "bytes"), Value::Integer(32768));
        assert_eq!(Value::quantity("2596.138", "MHz"), Value::Number(2596.138));
        for (text, unit) in
            [("12345e67", ""), ("6.18", ""), ("unlimited", "CPUs"), ("inf", "MHz"), ("NaN", "MHz")]
        {
            assert_eq!(Value::quantity(text, unit), Value::Text(text.to_string()));
        }
        assert_eq!(Value::quantity("", "bytes"), Value::Missing);
    }
}
