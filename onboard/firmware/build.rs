//! Hands the memory to the linker, the built-in model to the images, and the benchmark's models to the benchmark.

mod image;

use std::path::{Path, PathBuf};
use std::{env, fs, io};

fn main() -> io::Result<()> {
    // Not called memory.x, which the linker would take from here in any case.
    image::link("mps2.x")?;
    image::build_in("../../models/household.palpate")?;
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or(io::ErrorKind::NotFound)?);
    models(&out.join("bench"))
}

/// Files that `palpate-tests`' `bench_models` writes, and those of its `located`.
const BENCH: [&str; 17] = [
    "one-i16.palpate",
    "one-i8.palpate",
    "one-d3.palpate",
    "each100-i16.palpate",
    "each100-i8.palpate",
    "each40-i16.palpate",
    "each40-i8.palpate",
    "each40-wide.palpate",
    "each20-d7.palpate",
    "identity.palpate",
    "identity.bin",
    "estimates.bin",
    "one-nodes.bin",
    "one-irithyll.bin",
    "touches.bin",
    "located.palpate",
    "located.bin",
];

/// Copies the benchmarks' files from the directory in `PALPATE_BENCH`; those that are not there are empty, and their benchmark
/// says so.
fn models(out: &Path) -> io::Result<()> {
    println!("cargo::rerun-if-env-changed=PALPATE_BENCH");
    fs::create_dir_all(out)?;
    let source = env::var_os("PALPATE_BENCH").map(PathBuf::from);
    for name in BENCH {
        match &source {
            Some(directory) if directory.join(name).exists() => {
                let file = directory.join(name);
                println!("cargo::rerun-if-changed={}", file.display());
                fs::copy(file, out.join(name))?;
            }
            _ => fs::write(out.join(name), [])?,
        }
    }
    Ok(())
}
