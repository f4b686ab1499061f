//! `palpate data objects`.

use crate::commands::Global;
use palpate::Result;
use palpate::mesh::Object;
use palpate::mesh::builtin;
use palpate::mesh::obj;
use palpate::output;
use palpate_report::page::render;
use std::fmt::Write as _;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate data objects -o meshes                    ten files: bowl.obj, ...
  palpate data objects -o meshes --only fork        one of them
  palpate data objects -o meshes --picture all.png  and a picture of them
  palpate data objects -o meshes --varied 7         other proportions

The meshes are closed, in centimeters, with z up. The same command always writes the same bytes.")]
pub(super) struct Arguments {
    /// Where to write; a directory for NAME.obj of each object
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Only these objects; others are not written
    #[arg(long, value_delimiter = ',', value_name = "NAME,…", value_parser = built_in)]
    only: Vec<String>,
    /// Vary the proportions by up to about a fifth, with this seed
    #[arg(long, value_name = "SEED")]
    varied: Option<u64>,
    /// Also draw a contact sheet of the objects into this PNG file
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
}

/// Files written for one object.
#[derive(serde::Serialize)]
struct Written {
    name: String,
    file: PathBuf,
    vertices: usize,
    triangles: usize,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> Result<()> {
    output::refuse_stdout(&arguments.output)?;
    let chosen = |name: &&str| arguments.only.is_empty() || arguments.only.iter().any(|only| only == name);
    let names: Vec<&str> = builtin::names().into_iter().filter(chosen).collect();
    let made = builtin::make(&names, arguments.varied)?;
    let written = made.iter().map(|object| write(object, arguments)).collect::<Result<Vec<_>>>()?;
    if let Some(picture) = &arguments.picture {
        output::write_bytes(picture, &render::sheet(&made, 1200))?;
    }
    if global.json {
        return output::print_json(&written);
    }
    let mut text = String::new();
    for Written { file, vertices, triangles, .. } in &written {
        let _ = writeln!(text, "{}: {vertices} vertices, {triangles} triangles", file.display());
    }
    if let Some(picture) = &arguments.picture {
        let _ = writeln!(text, "{}: a picture of them", picture.display());
    }
    output::print(&text)
}

fn write(object: &Object, arguments: &Arguments) -> Result<Written> {
    let file = arguments.output.join(format!("{}.obj", object.name));
    output::write_whole(&file, |out| obj::write(object.mesh(), out))?;
    let (vertices, triangles) = (object.mesh().vertices.len(), object.mesh().triangles.len());
    Ok(Written { name: object.name.clone(), file, vertices, triangles })
}

fn built_in(name: &str) -> Result<String, String> {
    let names = builtin::names();
    match names.contains(&name) {
        true => Ok(name.into()),
        false => Err(format!("use one of {}", names.join(", "))),
    }
}
