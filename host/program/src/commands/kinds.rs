//! Kinds of models, and the commands that take them.

use palpate::compile::{self, CompiledModel};
use palpate::error::{Error, Place, Result, problem};
use palpate::locate::MapsFile;
use std::path::Path;

/// The evidence that a model recognizes by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ModelKind {
    Touches,
    Rows,
    Maps,
}

impl ModelKind {
    fn name(self) -> &'static str {
        match self {
            Self::Touches => "touches",
            Self::Rows => "rows",
            Self::Maps => "maps",
        }
    }

    /// The command called `name` for models of this kind, such as `rows evaluate`.
    fn command(self, name: &str) -> String {
        match self {
            Self::Touches => name.into(),
            Self::Rows | Self::Maps => format!("{} {name}", self.name()),
        }
    }
}

/// Reads a compiled model for a command that takes models of trees of one kind.
pub(super) fn compiled(path: &Path, wanted: ModelKind, command: &str) -> Result<CompiledModel> {
    trees(path, || CompiledModel::read(path), wanted, command)
}

/// Reads a compiled model, or an ensemble as its exact model, for a command that takes those of one kind.
pub(super) fn file(path: &Path, wanted: ModelKind, command: &str) -> Result<CompiledModel> {
    trees(path, || compile::read_any(path), wanted, command)
}

fn trees(
    path: &Path,
    read: impl FnOnce() -> Result<CompiledModel>,
    wanted: ModelKind,
    command: &str,
) -> Result<CompiledModel> {
    refuse_maps(path, wanted, command)?;
    let compiled = read()?;
    check(path, of_trees(compiled.model().descriptor().is_some()), wanted, command)?;
    Ok(compiled)
}

/// Reads a model of maps.
pub(super) fn maps(path: &Path, command: &str) -> Result<MapsFile> {
    if let Some(maps) = MapsFile::read(path)? {
        return Ok(maps);
    }
    // If the file holds no trees either, its own error says why.
    let compiled = CompiledModel::read(path)?;
    Err(other(path, of_trees(compiled.model().descriptor().is_some()), ModelKind::Maps, command))
}

fn of_trees(has_touches: bool) -> ModelKind {
    if has_touches { ModelKind::Touches } else { ModelKind::Rows }
}

fn refuse_maps(path: &Path, wanted: ModelKind, command: &str) -> Result<()> {
    let is_of_maps = MapsFile::read(path)?.is_some();
    if is_of_maps { Err(other(path, ModelKind::Maps, wanted, command)) } else { Ok(()) }
}

fn check(path: &Path, found: ModelKind, wanted: ModelKind, command: &str) -> Result<()> {
    if found == wanted { Ok(()) } else { Err(other(path, found, wanted, command)) }
}

/// The problem of a model of another kind, with the command that takes it, if there is one.
fn other(path: &Path, found: ModelKind, wanted: ModelKind, command: &str) -> Error {
    let taking = found.command(command);
    let fix = match super::at(&super::cli(), &taking) {
        Some(_) => format!("Use `palpate {taking}`."),
        None => format!("Give a model of {}.", wanted.name()),
    };
    problem!("a model of {}, not of {}", found.name(), wanted.name()).fix(fix).at(Place::file(path))
}
