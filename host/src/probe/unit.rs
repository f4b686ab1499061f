//! Units of length by name, as files state them: `unit` or `mm`.

use palpate_shared::format::Length;
use serde::{Deserialize, Deserializer, Serializer, de::Error};

/// The unit of data sets, ensembles and probe files that state none.
pub(crate) fn tenth() -> Length {
    Length::Tenth
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "the signature is serde's")]
pub(crate) fn serialize<S: Serializer>(unit: &Length, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(unit.name())
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Length, D::Error> {
    let name = std::borrow::Cow::<str>::deserialize(deserializer)?;
    let named = Length::ALL.iter().copied().find(|unit| unit.name() == name);
    named.ok_or_else(|| D::Error::custom(format!("unit {name:?}, where \"unit\" or \"mm\" is expected")))
}
