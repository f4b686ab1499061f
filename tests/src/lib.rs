//! What the tests between the floors share.

#[path = "../../onboard/firmware/src/identity.rs"]
pub mod identity;
pub mod random;
pub mod sections;
