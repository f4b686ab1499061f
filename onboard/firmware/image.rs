// What the build scripts of every image have in common.

use std::path::PathBuf;
use std::{env, fs, io};

/// Hands the memory that `default` describes, unless `PALPATE_MEMORY` names another file, and cortex-m-rt's linker script to the linker.
///
/// # Errors
/// The file cannot be copied.
pub fn link(default: &str) -> io::Result<()> {
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or(io::ErrorKind::NotFound)?);
    let memory = PathBuf::from(env::var_os("PALPATE_MEMORY").unwrap_or_else(|| default.into()));
    fs::copy(&memory, out.join("memory.x"))?;
    println!("cargo::rerun-if-env-changed=PALPATE_MEMORY");
    println!("cargo::rerun-if-changed={}", memory.display());
    println!("cargo::rustc-link-search={}", out.display());
    // Here and not in .cargo/config.toml, where RUSTFLAGS would override them.
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    println!("cargo::rustc-link-arg-bins=--nmagic");
    Ok(())
}

/// Hands the model to be built in to the program: `default`, unless `PALPATE_MODEL` names another.
///
/// # Errors
/// There is no such file.
pub fn build_in(default: &str) -> io::Result<()> {
    println!("cargo::rerun-if-env-changed=PALPATE_MODEL");
    let model = fs::canonicalize(env::var_os("PALPATE_MODEL").unwrap_or_else(|| default.into()))?;
    println!("cargo::rerun-if-changed={}", model.display());
    println!("cargo::rustc-env=PALPATE_MODEL={}", model.display());
    Ok(())
}
