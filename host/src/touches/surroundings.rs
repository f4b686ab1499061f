//! Surroundings of an object while it is touched.

use crate::error::{Error, Result};

/// Surroundings of an object while it is touched: which directions approaches come from, and what stops them. Touches of
/// different surroundings are never mixed.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Surroundings {
    /// Nothing: the object floats, and approaches come from every direction.
    #[default]
    Floating,
    /// A table on which the object lies in one of its placements, turned by any angle. Approaches come from above, and end when
    /// a finger reaches the table.
    Table {
        /// Largest angle between approaches and straight down, in degrees.
        cone: f64,
    },
}

impl Surroundings {
    /// The default cone of a table.
    pub const CONE: f64 = 60.0;

    /// True if the object floats, which files leave out.
    pub fn is_floating(&self) -> bool {
        *self == Self::Floating
    }

    /// The largest angle between approaches and straight down, in degrees; none if the object floats.
    pub fn cone(&self) -> Option<f64> {
        match self {
            Self::Floating => None,
            Self::Table { cone } => Some(*cone),
        }
    }

    /// Refuses a cone that has no directions, or some from below.
    ///
    /// # Errors
    /// [`Kind::Setting`](crate::error::Kind::Setting) naming `cone`.
    pub fn check(&self) -> Result<()> {
        match self.cone() {
            Some(cone) if !(cone > 0.0 && cone <= 90.0) => {
                Err(Error::setting("cone", cone, "an angle above 0 and of at most 90 degrees"))
            }
            _ => Ok(()),
        }
    }
}

impl std::fmt::Display for Surroundings {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Floating => f.write_str("floating"),
            Self::Table { cone } => write!(f, "table with approaches within {cone} degrees of straight down"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cones_that_cannot_be_are_refused() {
        for cone in [0.0, -1.0, 90.1, f64::NAN, f64::INFINITY] {
            assert!(Surroundings::Table { cone }.check().is_err(), "{cone}");
        }
        for surroundings in
            [Surroundings::Floating, Surroundings::Table { cone: 90.0 }, Surroundings::Table { cone: 0.1 }]
        {
            assert!(surroundings.check().is_ok());
            let text = serde_json::to_string(&surroundings).unwrap();
            assert_eq!(serde_json::from_str::<Surroundings>(&text).unwrap(), surroundings);
        }
    }
}
