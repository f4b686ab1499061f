//! Trees that are a function of the program.

use super::Model;
use crate::bytes::ModelError;
use palpate_shared::MISSING_FEATURE;
use palpate_shared::format::{Key, Layout};

/// A function that adds up trees: from a row of all features to margins in units, one for each object. `palpate export
/// --emit rust-code` writes one, in `model.rs`.
///
/// Features are whole numbers, [`MISSING_FEATURE`] where one is missing; or the bits of f32 values, of NaN where one is
/// missing, if the model's [`key`](Model::key) says so.
pub type Code = fn(&[i32], &mut [i32]);

/// The bits of a NaN.
const NAN: i32 = 0x7fc0_0000;

impl<'a> Model<'a> {
    /// Opens a model of the layout code, as [`Model::new`] does others, with the function that was written with it.
    /// Margins are what that function makes of features: nothing here says whether it is of this model. `model.rs` has the
    /// [`checksum`](Model::checksum) of its model as `CHECKSUM`.
    ///
    /// Cost: in proportion to the bytes, which are few. Cannot fail where the function is another one: margins are then
    /// wrong.
    ///
    /// # Errors
    /// Errors of [`Model::new`]; [`ModelError::Field`] for a model whose trees are in its bytes.
    pub fn with_code(bytes: &'a [u8], code: Code) -> Result<Self, ModelError> {
        let mut model = Self::opened_with_code(bytes)?;
        if model.layout() != Layout::Code {
            return Err(ModelError::Field { offset: 6 });
        }
        model.code = Some(code);
        Ok(model)
    }

    /// Calls the function for a row of features, or keys of f32 values.
    pub(super) fn call(&self, features: &[i32], margins: &mut [i32]) {
        let (Some(code), count) = (self.code, self.feature_count()) else { return };
        match features.get(..count) {
            Some(row) if self.key() == Key::Whole => code(row, margins),
            // Room for a row is cleared, which takes longer than most models: as little as does.
            _ if count <= 16 => self.call_in::<16>(code, features, margins),
            _ if count <= 64 => self.call_in::<64>(code, features, margins),
            _ => self.call_in::<256>(code, features, margins),
        }
    }

    /// Calls it for a row of up to `N` features that has to be made.
    // Apart: only such a model takes the room on the stack.
    #[inline(never)]
    fn call_in<const N: usize>(&self, code: Code, features: &[i32], margins: &mut [i32]) {
        let mut row = [MISSING_FEATURE; N];
        let Some(row) = row.get_mut(..self.feature_count()) else { return };
        row.iter_mut().zip(features).for_each(|(value, &feature)| *value = feature);
        if self.key() == Key::Real {
            row.iter_mut().for_each(|value| *value = bits(*value));
        }
        code(row, margins);
    }
}

/// The bits of the f32 value with a key.
const fn bits(key: i32) -> i32 {
    if key == MISSING_FEATURE {
        NAN
    } else if key < 0 {
        // The sign, and the magnitude.
        i32::MIN.wrapping_sub(key)
    } else {
        key
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_shared::format::f32_key;

    #[test]
    fn the_bits_of_a_key_are_those_of_its_value() {
        let values =
            [0.0, 1.5, -1.5, f32::MIN_POSITIVE, -f32::from_bits(1), f32::MAX, f32::INFINITY, f32::NEG_INFINITY];
        for value in values {
            assert_eq!(bits(f32_key(value)), value.to_bits().cast_signed(), "{value}");
        }
        assert_eq!(bits(f32_key(-0.0)), 0);
        assert!(f32::from_bits(bits(f32_key(f32::NAN)).cast_unsigned()).is_nan());
    }
}
