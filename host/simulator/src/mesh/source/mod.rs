//! Sources of objects: built in, a mesh file, a directory of mesh files.

mod layout;
mod search;

use crate::error::{Error, Kind, Place, Result, problem};
use crate::mesh::file;
use crate::mesh::{BACKGROUND, Instance, Mesh, Object, builtin, facts};
use rayon::prelude::*;
use search::{Finder, Found, LEVELS, lossy};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The objects of all `sources`, sorted by name. A source is one of
///
/// - `builtin`: the ten built-in objects;
/// - `background`: one object of many different shapes, for a model's background column;
/// - a mesh file of any of the kinds that [`mod@file`] reads, or a directory, which is searched for files with one of the
///   extensions of [`file::EXTENSIONS`], subdirectories included; where a folder holds a name with several extensions, the
///   first of them is taken, and the object's notes say so;
/// - the name of a built-in object, unless a file has that name.
///
/// An object is named after its file, except in the layouts of
///
/// - ShapeNet (`<category>/<id>/models/model_normalized.obj`, or `<category>/<id>/model.obj`): after the category, or after
///   category and id where the sources hold several of a category;
/// - YCB (`NNN_name/google_16k/textured.obj`): after the first folder; of its meshes one is taken, google_16k before
///   others;
/// - Google Scanned Objects (`Name/meshes/model.obj`): after the first folder.
///
/// Hidden files and directories, and the directory `__MACOSX`, are passed over.
///
/// # Errors
/// When a source does not exist, holds no mesh file, or a file is not a usable mesh, and when two objects have the same
/// name.
pub fn objects(sources: &[String]) -> Result<Vec<Object>> {
    load(sources, Search::default()).map(|loaded| loaded.objects)
}

/// Settings for searching directories and reading meshes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Search {
    /// True to take a directory inside a directory as one object, with each mesh in it as an instance.
    pub instances: bool,
    /// True to take files that may state their unit before others of the same name.
    pub prefers_units: bool,
    /// True to go on without meshes that cannot be read.
    pub skips_bad: bool,
}

/// Objects that were found and read, with remarks for the user.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Loaded {
    /// The objects, sorted by name.
    pub objects: Vec<Object>,
    /// Sources left out, and objects with the same mesh. Each object has its own notes besides.
    pub notes: Vec<String>,
}

/// The objects of all `sources`, found as [`objects`](fn@objects) finds them, with notes on the search.
///
/// # Errors
/// Errors of [`objects`](fn@objects); where some of several meshes cannot be read, [`Kind::Unread`] names them all.
pub fn load(sources: &[String], search: Search) -> Result<Loaded> {
    let (found, note) = found(sources, search)?;
    let count = found.iter().map(Source::count).sum();
    let read: Vec<(Option<Object>, Vec<Error>)> = found.into_par_iter().map(Source::read_each).collect();
    let (objects, errors): (Vec<_>, Vec<_>) = read.into_iter().unzip();
    let (objects, errors): (Vec<Object>, Vec<Error>) =
        (objects.into_iter().flatten().collect(), errors.into_iter().flatten().collect());
    let mut notes: Vec<String> = note.into_iter().collect();
    if objects.is_empty() || !search.skips_bad {
        refuse(errors, count)?;
    } else {
        notes.extend(errors.iter().map(|error| format!("left out: {}", said(error))));
    }
    notes.extend(same(&objects));
    Ok(Loaded { objects, notes })
}

/// Refuses errors of some of `count` meshes.
fn refuse(mut errors: Vec<Error>, count: usize) -> Result<()> {
    match (errors.len(), count) {
        (0, _) => Ok(()),
        (1, 1) => errors.pop().map_or(Ok(()), Err),
        (unread, _) => {
            let fix = match unread {
                1 => "Repair the file, or leave it out.",
                _ => "Repair these files, or leave them out.",
            };
            let listed = errors.iter().map(said).collect::<Vec<_>>().join("\n  ");
            let error = problem!("{unread} of {count} meshes cannot be read:\n  {listed}");
            Err(error.fix(fix).as_kind(Kind::Unread))
        }
    }
}

/// A directory holds no mesh.
fn no_meshes() -> Error {
    problem!("no mesh here: no file ends in .obj, .stl, .ply, .gltf, .glb or .dae")
        .fix("Give a directory that holds such files.")
}

/// An error without advice.
fn said(error: &Error) -> String {
    format!("{}{}", error.place(), error.what())
}

/// Notes on objects that have the same mesh, which no touch distinguishes.
fn same(objects: &[Object]) -> Vec<String> {
    let mut named: BTreeMap<u64, Vec<&str>> = BTreeMap::new();
    let checksums: Vec<Vec<u64>> = objects
        .par_iter()
        .map(|object| object.instances().map(|instance| instance.mesh.checksum()).collect())
        .collect();
    for (object, mut checksums) in objects.iter().zip(checksums) {
        checksums.sort_unstable();
        checksums.dedup();
        checksums.into_iter().for_each(|checksum| named.entry(checksum).or_default().push(&object.name));
    }
    let mut groups: Vec<Vec<&str>> = named.into_values().filter(|names| names.len() > 1).collect();
    groups.sort_unstable();
    groups.dedup();
    let note = |names: Vec<&str>| format!("{} have the same mesh: no touch distinguishes them", names.join(" and "));
    groups.into_iter().map(note).collect()
}

/// The only object of `source`, found as [`objects`](fn@objects) finds it.
///
/// # Errors
/// Errors of [`objects`](fn@objects), and if the source gives several objects.
pub fn object(source: &str) -> Result<Object> {
    let (mut found, note) = found(&[source.to_owned()], Search::default())?;
    match (found.pop(), found.len()) {
        (Some(only), 0) => {
            let mut object = only.read()?;
            object.notes.extend(note);
            Ok(object)
        }
        (_, others) => Err(problem!("{} objects, where one is needed", others + 1)
            .fix("Give one mesh file, or the name of one built-in object.")
            .at(Place::file(source))),
    }
}

/// An object that is found, but not yet made or read.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// The built-in object of this name.
    BuiltIn(&'static str),
    /// The shapes of [`builtin::background`].
    Background,
    /// An object in a file.
    File {
        /// The object's name.
        name: String,
        /// Its mesh file.
        path: PathBuf,
        /// Notes on other files that were passed over for it.
        notes: Vec<String>,
    },
    /// An object with a file for each instance.
    Instances {
        /// The object's name.
        name: String,
        /// The instances' names and mesh files.
        files: Vec<(String, PathBuf)>,
        /// Notes on other files that were passed over for them.
        notes: Vec<String>,
    },
}

impl Source {
    /// The object's name.
    pub fn name(&self) -> &str {
        match self {
            Self::BuiltIn(name) => name,
            Self::Background => BACKGROUND,
            Self::File { name, .. } | Self::Instances { name, .. } => name,
        }
    }

    /// Number of its meshes.
    fn count(&self) -> usize {
        match self {
            Self::Instances { files, .. } => files.len(),
            _ => 1,
        }
    }

    /// The object itself.
    ///
    /// # Errors
    /// Errors of [`file::read`] and [`builtin::one`].
    pub fn read(self) -> Result<Object> {
        let count = self.count();
        let (object, errors) = self.read_each();
        refuse(errors, count)?;
        object.ok_or_else(no_meshes)
    }

    /// The object with its readable meshes, and the errors of the others.
    fn read_each(self) -> (Option<Object>, Vec<Error>) {
        let whole = |read: Result<Object>| match read {
            Ok(object) => (Some(object), Vec::new()),
            Err(error) => (None, vec![error]),
        };
        match self {
            Self::BuiltIn(name) => whole(builtin::one(name)),
            Self::Background => whole(builtin::background(builtin::BACKGROUND_SHAPES, 1)),
            Self::File { name, path, notes } => whole(file::read(&path).map(|contents| {
                let (millimeters, step) = (contents.millimeters, contents.step);
                let (mesh, read) = noted(&path, contents);
                let notes = notes.into_iter().chain(read).collect();
                Object { millimeters, step, notes, ..Object::new(name, mesh) }
            })),
            Self::Instances { name, files, notes } => {
                let read = |(name, path): (String, PathBuf)| {
                    let contents = file::read(&path)?;
                    let (millimeters, step) = (contents.millimeters, contents.step);
                    let (mesh, notes) = noted(&path, contents);
                    Ok((Instance { name, mesh }, (millimeters, (step, notes))))
                };
                let read: Vec<Result<_>> = files.into_par_iter().map(read).collect();
                let (mut good, mut errors) = (Vec::new(), Vec::new());
                read.into_iter().for_each(|read| match read {
                    Ok(read) => good.push(read),
                    Err(error) => errors.push(error),
                });
                let (mut instances, stated): (Vec<_>, Vec<_>) = good.into_iter().unzip();
                let (units, read): (Vec<_>, Vec<_>) = stated.into_iter().unzip();
                let (steps, read): (Vec<f64>, Vec<_>) = read.into_iter().unzip();
                let (millimeters, note) = one_unit(&mut instances, &units);
                let scale = |unit: Option<f64>| unit.zip(millimeters).map_or(1.0, |(unit, first)| unit / first);
                let steps = steps.into_iter().zip(units).map(|(step, unit)| step * scale(unit));
                let step = steps.fold(0.0, f64::max);
                let object = Object::of_instances(name, instances).map(|object| Object {
                    millimeters,
                    step,
                    notes: notes.into_iter().chain(read.into_iter().flatten()).chain(note).collect(),
                    ..object
                });
                (object, errors)
            }
        }
    }
}

/// The mesh of a file, and notes about it: that its coordinates count from its center, that they are rounded, and what was noted
/// when it was read.
fn noted(path: &Path, file::Contents { mesh, moved, step, notes, .. }: file::Contents) -> (Mesh, Vec<String>) {
    let [x, y, z] = moved;
    let far = (moved != [0.0; 3]).then(|| {
        format!("{} is far from its origin: its coordinates count from its center, {x}, {y}, {z}", path.display())
    });
    let [low, high] = mesh.bounds();
    let rounded = facts::rounded(step, f64::from((high - low).max_element()));
    let rounded = rounded.map(|why| format!("{} is rounded: {why}", path.display()));
    (mesh, far.into_iter().chain(rounded).chain(notes).collect())
}

/// The unit of an object's instances in millimeters. Each instance may state its own: those that differ are scaled to the
/// first. If only some state one, there is none, and a note that says so.
fn one_unit(instances: &mut [Instance], units: &[Option<f64>]) -> (Option<f64>, Option<String>) {
    let Some(&Some(first)) = units.iter().find(|unit| unit.is_some()) else { return (None, None) };
    if units.contains(&None) {
        let note = "some of its meshes state their unit and others do not, so its size is unknown";
        return (None, Some(note.into()));
    }
    for (instance, unit) in instances.iter_mut().zip(units.iter().flatten()) {
        if *unit != first {
            let scaled = |x: &mut f32| *x = (f64::from(*x) * unit / first) as f32;
            instance.mesh.vertices.iter_mut().flatten().for_each(scaled);
        }
    }
    (Some(first), None)
}

/// The objects of all `sources`, sorted by name, where a directory inside a directory is one object: the mesh files that
/// are found in it, subdirectories included, are its instances, named after their paths in it. Everything else is found
/// as [`objects`](fn@objects) finds it.
///
/// # Errors
/// Errors of [`objects`](fn@objects).
pub fn objects_of_instances(sources: &[String]) -> Result<Vec<Object>> {
    load(sources, Search { instances: true, ..Search::default() }).map(|loaded| loaded.objects)
}

/// The objects of all `sources` as [`objects`](fn@objects) finds them, neither made nor read; sorted by name.
///
/// # Errors
/// Errors of [`objects`](fn@objects), except for errors inside a file.
pub fn files(sources: &[String]) -> Result<Vec<Source>> {
    found(sources, Search::default()).map(|(found, _)| found)
}

/// The objects of all sources, and which files of formats that are not read were found.
fn found(sources: &[String], search: Search) -> Result<(Vec<Source>, Option<String>)> {
    let mut finder = Finder { prefers_units: search.prefers_units, ..Finder::default() };
    let mut found = BTreeMap::new();
    for source in sources {
        if source == "builtin" {
            if builtin::names().is_empty() {
                return builtin::one(source).map(|_| Default::default());
            }
            for name in builtin::names() {
                insert(&mut found, name.into(), Source::BuiltIn(name))?;
            }
        } else if source == BACKGROUND && !Path::new(source).exists() {
            insert(&mut found, BACKGROUND.into(), Source::Background)?;
        } else if let Some(name) = builtin::names().into_iter().find(|name| name == source)
            && !Path::new(source).exists()
        {
            insert(&mut found, name.into(), Source::BuiltIn(name))?;
        } else {
            let path = Path::new(source);
            let metadata = std::fs::metadata(path).map_err(|error| match error.kind() {
                std::io::ErrorKind::NotFound => {
                    let known = builtin::names().join(", ");
                    problem!("cannot read the mesh: this is neither a file, a directory nor a built-in object")
                        .fix(format!("Check the path, or give one of the built-in objects: {known}."))
                        .at(Place::file(path))
                }
                _ => Error::io(path, "read the mesh", error),
            })?;
            if metadata.is_dir() {
                let before = finder.found.len() + found.len();
                if search.instances {
                    finder.search(path, 0)?;
                    for object in directories(path, &mut finder)? {
                        insert(&mut found, object.name().into(), object)?;
                    }
                } else {
                    finder.search(path, LEVELS)?;
                }
                if finder.found.len() + found.len() == before {
                    let none_read = |files: String| {
                        problem!("no mesh that is read here: {files}")
                            .fix("Convert them, then give the directory again.")
                    };
                    return Err(finder.note().map_or_else(no_meshes, none_read).at(Place::file(path)));
                }
            } else {
                finder.found.push(Found { path: path.to_owned(), passed: Vec::new() });
            }
        }
    }
    let note = finder.note();
    let mut paths = finder.found;
    layout::choose(&mut paths);
    let mut in_category = BTreeMap::new();
    for (category, _) in paths.iter().filter_map(|found| layout::shapenet(&found.path)) {
        *in_category.entry(category).or_insert(0) += 1;
    }
    for one in paths {
        let name = match (layout::shapenet(&one.path), layout::folder(&one.path)) {
            (Some((category, id)), _) if in_category[&category] > 1 => format!("{category}-{id}"),
            (Some((category, _)), _) => category,
            (None, Some(folder)) => folder,
            (None, None) => lossy(one.path.file_stem()),
        };
        let notes = one.note().into_iter().collect();
        insert(&mut found, name.clone(), Source::File { name, path: one.path, notes })?;
    }
    Ok((found.into_values().collect(), note))
}

fn insert(found: &mut BTreeMap<String, Source>, name: String, source: Source) -> Result<()> {
    let place = |source: &Source| -> PathBuf {
        match source {
            Source::BuiltIn(_) => "builtin".into(),
            Source::Background => BACKGROUND.into(),
            Source::File { path, .. } => path.clone(),
            Source::Instances { files, .. } => files.first().map(|(_, path)| path.clone()).unwrap_or_default(),
        }
    };
    if let Some(other) = found.get(&name) {
        return Err(same_name(&name, [place(other), place(&source)]));
    }
    found.insert(name, source);
    Ok(())
}

/// Two sources, such as a file or `builtin`, give objects of one name.
pub fn same_name(name: &str, [first, second]: [PathBuf; 2]) -> Error {
    problem!("two objects are called {name}: {} and {}", first.display(), second.display())
        .fix("Rename one of the files, or leave one out.")
        .as_kind(Kind::SameName { first, second })
}

/// The objects that the directories in `directory` stand for, one each.
fn directories(directory: &Path, finder: &mut Finder) -> Result<Vec<Source>> {
    let mut objects = Vec::new();
    for path in search::entries(directory)?.into_iter().filter(|path| path.is_dir()) {
        let others = std::mem::take(&mut finder.found);
        finder.search(&path, LEVELS - 1)?;
        let mut paths = std::mem::replace(&mut finder.found, others);
        if paths.is_empty() {
            continue;
        }
        layout::choose(&mut paths);
        let name = |file: &Path| {
            let inside = file.strip_prefix(&path).unwrap_or(file).with_extension("");
            inside.to_string_lossy().replace('\\', "/")
        };
        let notes = paths.iter().filter_map(Found::note).collect();
        let files = paths.into_iter().map(|found| (name(&found.path), found.path)).collect();
        objects.push(Source::Instances { name: lossy(path.file_name()), files, notes });
    }
    Ok(objects)
}
