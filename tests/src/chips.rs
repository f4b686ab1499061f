//! Images of the firmware.

use crate::ROOT;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The target of a Cortex-M4F.
pub const M4F: &str = "thumbv7em-none-eabihf";
/// The target of a Cortex-M0 or M0+.
pub const M0: &str = "thumbv6m-none-eabi";

/// Cargo in the firmware's workspace, with the release profile.
pub fn cargo(what: &str, image: &str, target: &str, more: &[&str]) -> Command {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args([what, "--locked", "--release", "--quiet", "--bin", image, "--target", target]).args(more);
    cargo.current_dir(Path::new(ROOT).join("onboard/firmware")).stdin(Stdio::null());
    // What a test was built with is not what the firmware is built with.
    cargo.env_remove("CARGO_TARGET_DIR").env_remove("RUSTFLAGS").env_remove("PALPATE_MODEL");
    cargo
}

/// Builds an image, with a model in it where one is given.
///
/// # Panics
/// If it does not build.
pub fn build(image: &str, target: &str, more: &[&str], model: Option<&Path>) -> PathBuf {
    let mut cargo = cargo("build", image, target, more);
    model.map(|model| cargo.env("PALPATE_MODEL", model));
    assert!(cargo.status().expect("cargo runs").success(), "the image {image} does not link");
    Path::new(ROOT).join("onboard/firmware/target").join(target).join("release").join(image)
}
