//! What the tests between the floors share.

pub mod desk;
pub mod flash;
#[path = "../../onboard/firmware/src/identity.rs"]
pub mod identity;
pub mod random;
pub mod sections;
