//! `palpate data objects`.

use crate::commands::probe::{ProbeArguments, reading, tell};
use crate::commands::shape;
use crate::commands::{Global, remark};
use palpate::mesh::obj;
use palpate::mesh::source::{self, Search, Source};
use palpate::mesh::{Instance, Object};
use palpate::output;
use palpate::results::Results;
use palpate::{Error, Result, row, with};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate data objects -o meshes                    ten files: bowl.obj, ...
  palpate data objects fork -o meshes               one of them
  palpate data objects pot.txt -o meshes --probe hand.toml
                                                    of touches on a table

The built-in meshes are closed, in centimeters, with z up; others keep the unit of their file. The same command always writes the same bytes.")]
pub(super) struct Arguments {
    /// Objects: `builtin` or built-in objects' names, meshes (OBJ, STL, PLY, glTF, COLLADA), files of touches with a position (TXT), directories of meshes
    #[arg(value_name = "SOURCE", default_value = "builtin")]
    sources: Vec<String>,
    /// Output; a directory for NAME.obj of each object, NAME/INSTANCE.obj of several instances
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Leave out bad meshes
    #[arg(long)]
    skip_bad: bool,
    #[command(flatten)]
    probe: ProbeArguments,
}

pub(super) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    output::refuse_stdout(&arguments.output)?;
    let (made, files) = made(&arguments)?;
    tell(&made);
    let meshes: Vec<_> = made.iter().flat_map(|object| meshes(object, &arguments.output)).collect();
    for (file, _) in &meshes {
        output::admit(file, &files)?;
    }
    let mut written = Results::new(["name", "file", "vertices", "triangles"]);
    for (file, Instance { name, mesh, .. }) in meshes {
        output::write_whole(&file, |out| obj::write(mesh, out))?;
        let file = file.display().to_string();
        written.push(row![name, file, mesh.vertices.len(), mesh.triangles.len()]);
    }
    global.print(&written, || written.text())
}

/// The objects, and the files that they come from.
fn made(arguments: &Arguments) -> Result<(Vec<Object>, Vec<PathBuf>)> {
    let (touched, others): (Vec<String>, Vec<String>) =
        arguments.sources.iter().cloned().partition(|source| shape::is_touches(source));
    let (mut objects, mut files) = if others.is_empty() { Default::default() } else { of_meshes(arguments, &others)? };
    for source in &touched {
        let file = shape::hand(&arguments.probe)?;
        let shape::Touched { name, shape, .. } = shape::read(Path::new(source), &file)?;
        objects.push(with!(Object::new(name, shape.relief().solid(file.probe.radius)), millimeters = Some(1.0)));
        files.push(source.into());
    }
    for (index, object) in objects.iter().enumerate() {
        if objects[..index].iter().any(|other| other.name == object.name) {
            let twice = format!("two objects of the name {}", object.name);
            return Err(Error::setting("source", twice, "one file for each object, or another directory"));
        }
    }
    Ok((objects, files))
}

fn of_meshes(arguments: &Arguments, given: &[String]) -> Result<(Vec<Object>, Vec<PathBuf>)> {
    let files = source::files(given)?.into_iter().filter_map(|source| match source {
        Source::File { path, .. } => Some(path),
        Source::BuiltIn(_) | Source::Background | Source::Instances { .. } => None,
    });
    let files = files.collect();
    let search = Search { skips_bad: arguments.skip_bad, ..Search::default() };
    let loaded = reading(|| source::load(given, search))?;
    loaded.notes.iter().for_each(|note| remark(&format!("palpate: {note}")));
    Ok((loaded.objects, files))
}

/// The files of an object: `NAME.obj`, or `NAME/INSTANCE.obj` if it has several instances.
fn meshes<'a>(object: &'a Object, directory: &Path) -> Vec<(PathBuf, &'a Instance)> {
    let file = |instance: &'a Instance| match object.instances().len() {
        1 => (directory.join(format!("{}.obj", object.name)), instance),
        _ => (directory.join(&object.name).join(format!("{}.obj", instance.name)), instance),
    };
    object.instances().map(file).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::mesh::Mesh;

    #[test]
    fn all_instances_of_an_object_have_files_of_their_own() {
        let instances = ["round", "flat"].map(|name| Instance { name: name.into(), mesh: Mesh::globe(4) });
        let object = Object::of_instances("cup", instances.to_vec()).unwrap();
        let files: Vec<_> = meshes(&object, Path::new("out")).into_iter().map(|(file, _)| file).collect();
        assert_eq!(files, [Path::new("out/cup/round.obj"), Path::new("out/cup/flat.obj")]);
        let object = Object::new("cup", Mesh::globe(4));
        let files: Vec<_> = meshes(&object, Path::new("out")).into_iter().map(|(file, _)| file).collect();
        assert_eq!(files, [Path::new("out/cup.obj")]);
    }
}
