//! Units of length by name, as files state them: `unit` or `mm`.

use palpate_shared::format::Length;
use serde::{Deserialize, Deserializer, Serializer, de::Error};

/// The unit of data sets, ensembles and probe files that state none.
pub fn tenth() -> Length {
    Length::Tenth
}

/// Writes the name, for serde.
///
/// # Errors
/// Errors of the serializer.
pub fn serialize<S: Serializer>(unit: &Length, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(unit.name())
}

/// Reads the name, for serde.
///
/// # Errors
/// If it is not one of the names.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Length, D::Error> {
    let name = std::borrow::Cow::<str>::deserialize(deserializer)?;
    let named = Length::ALL.iter().copied().find(|unit| unit.name() == name);
    named.ok_or_else(|| D::Error::custom(format!("unit {name:?}, where \"unit\" or \"mm\" is expected")))
}
