//! Mesh files in directories.

use crate::error::{Error, Result};
use crate::mesh::file::{DEPTH_LIST, EXTENSIONS};
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

/// Position of a file's extension among those of meshes; none if it is no mesh's.
pub(super) fn rank(path: &Path) -> Option<usize> {
    if path.file_name().is_some_and(|name| name == DEPTH_LIST) {
        return Some(EXTENSIONS.len());
    }
    let extension = path.extension()?;
    EXTENSIONS.iter().position(|known| extension.eq_ignore_ascii_case(known))
}

/// The object of a scene of depth images that a source chooses: `scene@3`, or `scene/scene_camera.json@3`.
pub(super) fn chosen(source: &str) -> Option<PathBuf> {
    let (scene, number) = source.rsplit_once('@')?;
    let number: u32 = number.parse().ok()?;
    let scene = Path::new(scene);
    let list = if scene.is_dir() { scene.join(DEPTH_LIST) } else { scene.to_owned() };
    let is_list = list.file_name().is_some_and(|name| name == DEPTH_LIST) && list.is_file();
    (is_list && !Path::new(source).exists()).then(|| list.with_file_name(format!("{DEPTH_LIST}@{number}")))
}

/// Appends the mesh files in a directory and in its subdirectories: of one name, the one with the first extension.
pub(super) fn search(directory: &Path, levels: usize, found: &mut Vec<Found>) -> Result<()> {
    let io = |error| Error::io(directory, "read the directory", error);
    let mut entries = std::fs::read_dir(directory).map_err(io)?.collect::<std::io::Result<Vec<_>>>().map_err(io)?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    let paths: Vec<PathBuf> = entries.into_iter().map(|entry| entry.path()).collect();
    let mut names: BTreeMap<&OsStr, Vec<(usize, &PathBuf)>> = BTreeMap::new();
    let files = paths.iter().filter(|path| !path.is_dir()).filter_map(|path| Some((rank(path)?, path)));
    for (rank, path) in files {
        names.entry(path.file_stem().unwrap_or_default()).or_default().push((rank, path));
    }
    names.values_mut().for_each(|files| files.sort());
    for path in &paths {
        if let Some([(_, first), others @ ..]) = names.get(path.file_stem().unwrap_or_default()).map(Vec::as_slice)
            && *first == path
        {
            found
                .push(Found { path: path.clone(), passed: others.iter().map(|(_, other)| (*other).clone()).collect() });
        } else if path.is_dir() && levels > 0 {
            search(path, levels - 1, found)?;
        }
    }
    Ok(())
}

/// The name of a file or directory as text.
pub(super) fn lossy(name: Option<&OsStr>) -> String {
    name.unwrap_or_default().to_string_lossy().into_owned()
}
