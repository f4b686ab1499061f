//! What the tests between the floors share.

pub mod identity;
pub mod random;
