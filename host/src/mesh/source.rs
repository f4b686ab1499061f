//! Where objects come from: built in, an OBJ file, a directory of OBJ files.

use crate::error::{Error, MeshProblem, Place, Result};
use crate::mesh::obj;
use crate::mesh::{BACKGROUND, builtin};
use crate::mesh::{Instance, Object};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The objects of all `sources`, sorted by name. A source is one of
///
/// - `builtin`: the ten built-in objects;
/// - `background`: one object of many different shapes, for a model's background column;
/// - an OBJ file, or a directory, which is searched for OBJ files, subdirectories included;
/// - the name of a built-in object, if there is no file of that name.
///
/// An object is named after its file; in ShapeNet's layout (`<category>/<id>/models/model_normalized.obj`) after the
/// category, or after category and id where the sources hold several of a category.
///
/// # Errors
/// When a source does not exist, holds no OBJ file, or a file is not a usable mesh, and when two objects have the same
/// name.
pub fn objects(sources: &[String]) -> Result<Vec<Object>> {
    let read: Vec<Result<Object>> = files(sources)?.into_par_iter().map(Source::read).collect();
    read.into_iter().collect()
}

/// The only object of `source`, found as [`objects`](fn@objects) finds it.
///
/// # Errors
/// As [`objects`](fn@objects), and [`MeshProblem::SeveralObjects`].
pub fn object(source: &str) -> Result<Object> {
    let mut found = files(&[source.to_owned()])?;
    match (found.pop(), found.len()) {
        (Some(only), 0) => only.read(),
        (_, others) => Err(Error::at(Place::file(source), MeshProblem::SeveralObjects { count: others + 1 })),
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
        /// Its OBJ file.
        path: PathBuf,
    },
    /// An object with a file for each instance.
    Instances {
        /// The object's name.
        name: String,
        /// The instances' names and OBJ files.
        files: Vec<(String, PathBuf)>,
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

    /// The object itself.
    ///
    /// # Errors
    /// As [`obj::read`] and [`builtin::one`].
    pub fn read(self) -> Result<Object> {
        match self {
            Self::BuiltIn(name) => builtin::one(name),
            Self::Background => builtin::background(builtin::BACKGROUND_SHAPES, 1),
            Self::File { name, path } => Ok(Object::new(name, obj::read(&path)?)),
            Self::Instances { name, files } => {
                let read = |(name, path): (String, PathBuf)| Ok(Instance { name, mesh: obj::read(&path)? });
                let instances = files.into_par_iter().map(read).collect::<Result<_>>()?;
                Object::of_instances(name, instances).ok_or_else(|| MeshProblem::NoMeshes.into())
            }
        }
    }
}

/// The objects of all `sources`, sorted by name, where a directory inside a directory is one object: the OBJ files that
/// are found in it, subdirectories included, are its instances, named after their paths in it. Everything else is found
/// as [`objects`](fn@objects) finds it.
///
/// # Errors
/// As [`objects`](fn@objects).
pub fn objects_of_instances(sources: &[String]) -> Result<Vec<Object>> {
    found(sources, true)?.into_par_iter().map(Source::read).collect::<Vec<_>>().into_iter().collect()
}

/// The objects of all `sources` as [`objects`](fn@objects) finds them, neither made nor read; sorted by name.
///
/// # Errors
/// As [`objects`](fn@objects), except for what is wrong inside a file.
pub fn files(sources: &[String]) -> Result<Vec<Source>> {
    found(sources, false)
}

fn found(sources: &[String], instances: bool) -> Result<Vec<Source>> {
    let mut paths = Vec::new();
    let mut found = BTreeMap::new();
    for source in sources {
        if source == "builtin" {
            if builtin::names().is_empty() {
                return builtin::one(source).map(|_| Vec::new());
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
                    Error::at(Place::file(path), MeshProblem::NoSuchSource { builtin: builtin::names().into() })
                }
                _ => Error::io(path, "read the mesh", error),
            })?;
            if metadata.is_dir() {
                let before = paths.len() + found.len();
                if instances {
                    search(path, 0, &mut paths)?;
                    for object in directories(path)? {
                        insert(&mut found, object.name().into(), object)?;
                    }
                } else {
                    search(path, LEVELS, &mut paths)?;
                }
                if paths.len() + found.len() == before {
                    return Err(Error::at(Place::file(path), MeshProblem::NoMeshes));
                }
            } else {
                paths.push(path.to_owned());
            }
        }
    }
    let mut in_category = BTreeMap::new();
    for (category, _) in paths.iter().filter_map(|path| shapenet(path)) {
        *in_category.entry(category).or_insert(0) += 1;
    }
    for path in &paths {
        let name = match shapenet(path) {
            Some((category, id)) if in_category[&category] > 1 => format!("{category}-{id}"),
            Some((category, _)) => category,
            None => lossy(path.file_stem()),
        };
        insert(&mut found, name.clone(), Source::File { name, path: path.clone() })?;
    }
    Ok(found.into_values().collect())
}

fn insert(found: &mut BTreeMap<String, Source>, name: String, source: Source) -> Result<()> {
    let place = |source: &Source| match source {
        Source::BuiltIn(_) => "builtin".into(),
        Source::Background => BACKGROUND.into(),
        Source::File { path, .. } => path.clone(),
        Source::Instances { files, .. } => files.first().map(|(_, path)| path.clone()).unwrap_or_default(),
    };
    if let Some(other) = found.get(&name) {
        return Err(MeshProblem::SameName { first: place(other), second: place(&source), name }.into());
    }
    found.insert(name, source);
    Ok(())
}

/// How many levels of subdirectories are searched.
const LEVELS: usize = 8;

fn search(directory: &Path, levels: usize, paths: &mut Vec<PathBuf>) -> Result<()> {
    let io = |error| Error::io(directory, "read the directory", error);
    let mut entries = std::fs::read_dir(directory).map_err(io)?.collect::<std::io::Result<Vec<_>>>().map_err(io)?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for path in entries.into_iter().map(|entry| entry.path()) {
        if path.is_dir() && levels > 0 {
            search(&path, levels - 1, paths)?;
        } else if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj")) {
            paths.push(path);
        }
    }
    Ok(())
}

/// The objects that the directories in `directory` stand for, one each.
fn directories(directory: &Path) -> Result<Vec<Source>> {
    let io = |error| Error::io(directory, "read the directory", error);
    let mut objects = Vec::new();
    for entry in std::fs::read_dir(directory).map_err(io)? {
        let path = entry.map_err(io)?.path();
        if !path.is_dir() {
            continue;
        }
        let mut paths = Vec::new();
        search(&path, LEVELS - 1, &mut paths)?;
        if paths.is_empty() {
            continue;
        }
        let name = |file: &Path| {
            let inside = file.strip_prefix(&path).unwrap_or(file).with_extension("");
            inside.to_string_lossy().replace('\\', "/")
        };
        let files = paths.iter().map(|file| (name(file), file.clone())).collect();
        objects.push(Source::Instances { name: lossy(path.file_name()), files });
    }
    Ok(objects)
}

/// The category and the id of a file in ShapeNet's layout.
fn shapenet(path: &Path) -> Option<(String, String)> {
    let models = path.parent()?;
    let id = models.parent()?;
    let category = lossy(id.parent()?.file_name());
    let is_shapenet = path.file_stem()? == "model_normalized" && models.file_name()? == "models";
    let id = lossy(Some(id.file_name()?));
    is_shapenet.then(|| if category.is_empty() { (id.clone(), id) } else { (category, id) })
}

fn lossy(name: Option<&std::ffi::OsStr>) -> String {
    name.unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Problem;

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

    fn place(directory: &Path, files: &[&str]) -> String {
        for file in files {
            let path = directory.join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, TRIANGLE).unwrap();
        }
        directory.to_str().unwrap().to_owned()
    }

    fn names(sources: &[String]) -> Vec<String> {
        objects(sources).unwrap().into_iter().map(|object| object.name).collect()
    }

    #[test]
    fn files_and_directories_together_are_sorted_by_name() {
        let (one, two) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let one = place(one.path(), &["spoon.OBJ", "deep/er/fork.obj", "notes.txt"]);
        let two = place(two.path(), &["a cup.obj"]) + "/a cup.obj";
        assert_eq!(names(&[one, two]), ["a cup", "fork", "spoon"]);
    }

    #[cfg(feature = "objects")]
    #[test]
    fn a_built_in_object_is_found_by_its_name_unless_a_file_has_it() {
        assert_eq!(names(&["mouse".into(), "bowl".into()]), ["bowl", "mouse"]);
        let error = objects(&["builtin".into(), "mouse".into()]).unwrap_err().to_string();
        assert!(error.contains("two objects are called mouse"), "{error}");
    }

    #[test]
    fn shapenet_objects_are_named_after_category_and_id() {
        let directory = tempfile::tempdir().unwrap();
        let files = ["mug/1a/models/model_normalized.obj", "bowl/2b/models/model_normalized.obj"];
        let source = place(directory.path(), &files);
        assert_eq!(names(&[format!("{source}/mug/1a/models/model_normalized.obj")]), ["mug"]);
        assert_eq!(names(&[source]), ["bowl", "mug"]);
        let source = place(directory.path(), &["mug/3c/models/model_normalized.obj"]);
        assert_eq!(names(&[source]), ["bowl", "mug-1a", "mug-3c"]);
    }

    #[test]
    fn a_directory_inside_a_directory_is_one_object_with_instances() {
        let directory = tempfile::tempdir().unwrap();
        let files =
            ["cup/red.obj", "cup/blue.obj", "cup/far/green.obj", "fork/one.obj", "spoon.obj", "empty/notes.txt"];
        let source = place(directory.path(), &files);
        let objects = objects_of_instances(std::slice::from_ref(&source)).unwrap();
        let found: Vec<(&str, Vec<&str>)> = objects
            .iter()
            .map(|object| (object.name.as_str(), object.instances().map(|one| one.name.as_str()).collect()))
            .collect();
        let cup = vec!["blue", "far/green", "red"];
        assert_eq!(found, [("cup", cup), ("fork", vec!["one"]), ("spoon", vec!["spoon"])]);
        // Without instances, each file is an object.
        assert_eq!(names(std::slice::from_ref(&source)), ["blue", "green", "one", "red", "spoon"]);
        place(directory.path(), &["cup.obj"]);
        let error = objects_of_instances(&[source]).unwrap_err().to_string();
        assert!(error.contains("two objects are called cup"), "{error}");
    }

    #[test]
    fn two_objects_of_one_name_are_refused() {
        let directory = tempfile::tempdir().unwrap();
        let source = place(directory.path(), &["a/cup.obj", "b/cup.obj"]);
        let error = objects(&[source]).unwrap_err().to_string();
        assert!(error.contains("two objects are called cup") && error.contains("b/cup.obj"), "{error}");
    }

    #[test]
    fn missing_and_empty_sources_are_refused() {
        let directory = tempfile::tempdir().unwrap();
        let source = directory.path().to_str().unwrap().to_owned();
        assert!(objects(std::slice::from_ref(&source)).unwrap_err().to_string().contains("no OBJ file here"));
        let error = objects(&[source + "/bultin"]).unwrap_err();
        assert!(error.to_string().contains("bultin: cannot read the mesh"), "{error}");
        assert!(matches!(error.problem(), Some(Problem::Mesh(MeshProblem::NoSuchSource { .. }))), "{error:?}");
    }

    #[cfg(feature = "objects")]
    #[test]
    fn a_misspelled_built_in_object_is_refused_with_the_names_of_all() {
        for error in
            [objects(&["builtin".into(), "mug".into()]), objects(&["mug".into()]), object("mug").map(|one| vec![one])]
        {
            let error = error.unwrap_err().to_string();
            assert!(error.starts_with("mug: ") && !error.contains("os error"), "{error}");
            assert!(builtin::names().iter().all(|name| error.contains(name)), "{error}");
        }
    }

    #[cfg(feature = "objects")]
    #[test]
    fn several_objects_where_one_is_needed_are_refused_with_their_number() {
        let error = object("builtin").unwrap_err().to_string();
        assert!(error.starts_with("builtin: 10 objects"), "{error}");
        let directory = tempfile::tempdir().unwrap();
        let source = place(directory.path(), &["cup.obj"]);
        assert_eq!(object(&source).unwrap().name, "cup");
        place(directory.path(), &["bowl.obj"]);
        assert!(object(&source).unwrap_err().to_string().contains("2 objects, where one is needed"));
    }
}
