//! Trees in as many bytes as there is room for.

use super::container::FEWER_SPLITS;
use super::{Compiled, Leaf, Settings, compile};
use crate::ensemble::Ensemble;
use crate::error::{Result, problem};

/// Compiles an ensemble to at most `most` bytes. No tree is left out: leaves are stored in fewer bits. Of what fits, the first
/// is taken, so that margins are as exact as there is room for.
///
/// # Errors
/// Errors of [`compile`]; with the fewest bytes that were found, if these are too many.
pub fn compile_within(ensemble: &Ensemble, settings: &Settings, most: usize) -> Result<Compiled> {
    let narrower = match settings.leaf {
        Leaf::F32 => &[Leaf::F32, Leaf::I16, Leaf::I8][..],
        Leaf::I16 => &[Leaf::I16, Leaf::I8],
        Leaf::I8 => &[Leaf::I8],
    };
    let mut fewest = usize::MAX;
    for &leaf in narrower {
        let compiled = compile(ensemble, &Settings { leaf, ..settings.clone() })?;
        if compiled.bytes.len() <= most {
            return Ok(compiled);
        }
        fewest = fewest.min(compiled.bytes.len());
    }
    Err(problem!("the model has {fewest} bytes at least, more than the {most} that fit").fix(FEWER_SPLITS))
}
