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
    let model = match env::var_os("PALPATE_MODEL").map(PathBuf::from) {
        Some(model) => fs::canonicalize(model)?,
        None => {
            println!("cargo::warning=no model: build with PALPATE_MODEL=/path/to/model.palpate");
            let empty = out.join("empty.palpate");
            fs::write(&empty, [])?;
            empty
        }
    };
    println!("cargo::rerun-if-changed={}", model.display());
    println!("cargo::rustc-env=PALPATE_MODEL={}", model.display());
    Ok(())
}
