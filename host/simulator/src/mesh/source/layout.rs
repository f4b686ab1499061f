//! Layouts of the folders of mesh data sets.

use super::search::{Found, lossy, rank};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The category and the id of a file in ShapeNet's layout: `<category>/<id>/models/model_normalized.obj`, or, with numbers
/// for both, `<category>/<id>/model.obj`.
pub(super) fn shapenet(path: &Path) -> Option<(String, String)> {
    let folder = path.parent()?;
    let is_normalized = path.file_stem()? == "model_normalized" && folder.file_name()? == "models";
    let id = if is_normalized { folder.parent()? } else { folder };
    let category = lossy(id.parent()?.file_name());
    let id = lossy(Some(id.file_name()?));
    let is_number = |name: &str, digits| name.len() >= digits && name.bytes().all(|byte| byte.is_ascii_hexdigit());
    let is_numbered = path.file_stem()? == "model" && is_number(&category, 8) && is_number(&id, 16);
    if !is_normalized && !is_numbered {
        return None;
    }
    Some(if category.is_empty() { (id.clone(), id) } else { (category, id) })
}

/// The folder after which an object is named: in YCB's layout `NNN_name/google_16k/textured.obj`, in that of Google Scanned
/// Objects `Name/meshes/model.obj`.
pub(super) fn folder(path: &Path) -> Option<String> {
    let inner = path.parent()?;
    let is_scanned = path.file_stem()? == "model" && inner.file_name()? == "meshes";
    match ycb(path) {
        Some((folder, _)) => Some(lossy(folder.file_name())),
        None if is_scanned => Some(lossy(Some(inner.parent()?.file_name()?))),
        None => None,
    }
}

/// The folders of meshes in YCB's layout, the one that is taken first.
const FOLDERS: [&str; 6] = ["google_16k", "google_64k", "google_512k", "tsdf", "poisson", "clouds"];

/// In YCB's layout, an object's folder, and how early this file is taken.
fn ycb(path: &Path) -> Option<(PathBuf, [usize; 3])> {
    let inner = path.parent()?;
    let folder_rank = FOLDERS.iter().position(|known| inner.file_name().is_some_and(|name| name == *known))?;
    let folder = inner.parent()?;
    let name = lossy(Some(folder.file_name()?));
    let (number, rest) = name.split_at_checked(3)?;
    let is_numbered = number.bytes().all(|byte| byte.is_ascii_digit()) && rest.starts_with(['_', '-']);
    let stem = ["textured", "nontextured"].iter().position(|known| path.file_stem().is_some_and(|stem| stem == *known));
    is_numbered.then(|| (folder.to_owned(), [folder_rank, stem.unwrap_or(2), rank(path).unwrap_or_default()]))
}

/// Keeps one file of each object that a layout gives several: the others are passed over.
pub(super) fn choose(found: &mut Vec<Found>) {
    let mut objects: BTreeMap<PathBuf, Vec<([usize; 3], Found)>> = BTreeMap::new();
    let mut others = Vec::new();
    for one in found.drain(..) {
        match ycb(&one.path) {
            Some((folder, rank)) => objects.entry(folder).or_default().push((rank, one)),
            None => others.push(one),
        }
    }
    found.extend(others);
    for mut files in objects.into_values() {
        files.sort_by_key(|(rank, _)| *rank);
        let mut files = files.into_iter().map(|(_, one)| one);
        let Some(mut first) = files.next() else { continue };
        for other in files {
            first.passed.push(other.path);
            first.passed.extend(other.passed);
        }
        found.push(first);
    }
}
