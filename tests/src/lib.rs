//! What the tests between the floors share.

pub mod random;
