//! Hands memory.x to the linker and the model to the program.

use std::path::PathBuf;
use std::{env, fs, io};

fn main() -> io::Result<()> {
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or(io::ErrorKind::NotFound)?);
    fs::copy("memory.x", out.join("memory.x"))?;
    println!("cargo::rerun-if-changed=memory.x");
    println!("cargo::rustc-link-search={}", out.display());
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    println!("cargo::rustc-link-arg-bins=--nmagic");

    println!("cargo::rerun-if-env-changed=PALPATE_MODEL");
    // The household objects, unless PALPATE_MODEL names another model.
    let model = env::var_os("PALPATE_MODEL").unwrap_or_else(|| "../../../../models/household.palpate".into());
    let model = fs::canonicalize(model)?;
    println!("cargo::rerun-if-changed={}", model.display());
    println!("cargo::rustc-env=PALPATE_MODEL={}", model.display());
    Ok(())
}
