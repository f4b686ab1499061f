//! Mesh files in directories.

use crate::error::{Error, Result};
use crate::mesh::file::EXTENSIONS;
use crate::mesh::unread;
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// A mesh file that was found.
pub(super) struct Found {
    pub(super) path: PathBuf,
    /// Files that are passed over, since this one stands for the same.
    pub(super) passed: Vec<PathBuf>,
}

impl Found {
    /// Says which files were passed over for this one.
    pub(super) fn note(&self) -> Option<String> {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let named = |path: &PathBuf| path.strip_prefix(folder).unwrap_or(path).display().to_string();
        let passed: Vec<String> = self.passed.iter().map(named).collect();
        let are = if passed.len() == 1 { "is" } else { "are" };
        let passed = (!passed.is_empty()).then(|| passed.join(", "))?;
        Some(format!("{} is used; {passed} {are} passed over, of the same object", self.path.display()))
    }
}

/// Number of levels of subdirectories that are searched.
pub(super) const LEVELS: usize = 8;

/// Position of a file's extension among those of meshes; none for other files.
pub(super) fn rank(path: &Path) -> Option<usize> {
    let extension = path.extension()?;
    EXTENSIONS.iter().position(|known| extension.eq_ignore_ascii_case(known))
}

/// A search of directories.
#[derive(Default)]
pub(super) struct Finder {
    /// True if files that may state their unit are taken before others of the same name.
    pub(super) prefers_units: bool,
    pub(super) found: Vec<Found>,
    /// Files of formats that are not read, unless a mesh that is read has their name.
    pub(super) unread: Vec<PathBuf>,
}

impl Finder {
    /// Finds the mesh files in a directory and in its subdirectories: of one name, the one with the first extension.
    pub(super) fn search(&mut self, directory: &Path, levels: usize) -> Result<()> {
        let paths = entries(directory)?;
        let mut names: BTreeMap<&OsStr, Vec<(usize, &PathBuf)>> = BTreeMap::new();
        let order = |path: &PathBuf| match rank(path)? {
            rank if self.prefers_units && !states_unit(path) => Some(rank + EXTENSIONS.len()),
            rank => Some(rank),
        };
        let is_unread = |path: &PathBuf| unread::of_name(path).is_some();
        for path in paths.iter().filter(|path| !path.is_dir()) {
            // What is not read comes last.
            if let Some(order) = order(path).or_else(|| is_unread(path).then_some(usize::MAX)) {
                names.entry(path.file_stem().unwrap_or_default()).or_default().push((order, path));
            }
        }
        names.values_mut().for_each(|files| files.sort());
        for path in &paths {
            match names.get(path.file_stem().unwrap_or_default()).map(Vec::as_slice) {
                Some([(usize::MAX, first), ..]) if *first == path => self.unread.push(path.clone()),
                Some([(_, first), others @ ..]) if *first == path => {
                    let passed = others.iter().map(|(_, other)| (*other).clone()).collect();
                    self.found.push(Found { path: path.clone(), passed });
                }
                _ if path.is_dir() && levels > 0 && !leads_back(path, directory) => self.search(path, levels - 1)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// Says which files of formats that are not read there are, and what converts them.
    pub(super) fn note(&self) -> Option<String> {
        const SHOWN: usize = 5;
        let (first, rest) = self.unread.split_at(SHOWN.min(self.unread.len()));
        let shown = first.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ");
        let more = if rest.is_empty() { String::new() } else { format!(" and {} more", rest.len()) };
        let are = if self.unread.len() == 1 { "is" } else { "are" };
        let mut formats: Vec<_> = self.unread.iter().filter_map(|path| unread::of_name(path)).collect();
        formats.sort_unstable();
        formats.dedup();
        let advice: Vec<String> = formats.iter().map(|(name, instead)| format!("{name}: {instead}.")).collect();
        (!first.is_empty()).then(|| format!("{shown}{more} {are} not read. {}", advice.join(" ")))
    }
}

/// Content of a directory, without hidden entries and `__MACOSX`, the copies that archives of a Mac hold.
pub(super) fn entries(directory: &Path) -> Result<Vec<PathBuf>> {
    let io = |error| Error::io(directory, "read the directory", error);
    let mut entries = std::fs::read_dir(directory).map_err(io)?.collect::<std::io::Result<Vec<_>>>().map_err(io)?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    let is_hidden = |name: &OsStr| name.as_encoded_bytes().starts_with(b".") || name == "__MACOSX";
    Ok(entries.into_iter().filter(|entry| !is_hidden(&entry.file_name())).map(|entry| entry.path()).collect())
}

/// True if a directory is a link to the one that it is in, or to one above that.
fn leads_back(path: &Path, directory: &Path) -> bool {
    path.is_symlink()
        && path.canonicalize().ok().zip(directory.canonicalize().ok()).is_some_and(|(to, own)| own.starts_with(to))
}

/// True if files of this extension may state their unit.
fn states_unit(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| ["gltf", "glb", "dae"].iter().any(|own| extension.eq_ignore_ascii_case(own)))
}

/// The name of a file or directory as text.
pub(super) fn lossy(name: Option<&OsStr>) -> String {
    name.unwrap_or_default().to_string_lossy().into_owned()
}
