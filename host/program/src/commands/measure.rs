//! `palpate probe`.

use super::fit;

group! {
    /// Measure how your probe differs from the ideal, from its touches
    Fit => fit,
}
