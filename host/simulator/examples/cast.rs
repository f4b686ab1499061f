//! Moves spheres against a mesh as a file says, to compare the simulator with another engine.
//!
//! ```text
//! cargo run --release -p palpate-simulator --example cast -- MESH CASTS [--as-is] [--radius R] [--length L]
//! ```
//!
//! CASTS is a text file with one cast per line: `set,ox,oy,oz,dx,dy,dz` or `set,ox,oy,oz,dx,dy,dz,t`, where t is the time
//! that another engine found, or `miss`. The output has the same lines with our time appended. Times are in lengths of the
//! direction, which is not renormalized; all numbers are rounded to the nearest f32. The mesh is centered at the origin and
//! scaled until the longest side of its bounding box is L (10), unless `--as-is` is given; the sphere's radius is R (0.15).

use palpate_simulator::mesh::file;
use palpate_simulator::probe::glam::{DVec3, Vec3};
use palpate_simulator::probe::scene::Scene;
use std::error::Error;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    match run(std::env::args().skip(1), BufWriter::new(std::io::stdout().lock())) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// Writes the lines of a file of casts, each with its time.
pub(crate) fn run(mut words: impl Iterator<Item = String>, mut out: impl Write) -> Result<(), Box<dyn Error>> {
    let (mut files, mut as_is, mut radius, mut length) = (Vec::new(), false, 0.15, 10.0);
    while let Some(word) = words.next() {
        let mut number = || {
            let number = words.next().and_then(|text| text.parse::<f32>().ok()).filter(|number| *number > 0.0);
            number.filter(|number| number.is_finite()).ok_or(format!("{word} needs a number greater than 0"))
        };
        match word.as_str() {
            "--as-is" => as_is = true,
            "--radius" => radius = number()?,
            "--length" => length = number()?,
            _ => files.push(word),
        }
    }
    let [mesh, casts] = &files[..] else {
        return Err("give MESH CASTS [--as-is] [--radius R] [--length L]".into());
    };
    let file::Contents { mesh, moved, .. } = file::read(Path::new(mesh))?;
    // Far from the origin, a mesh's coordinates count from its center.
    let (scene, moved) = match as_is {
        true => (Scene::as_is(&mesh)?, DVec3::from(moved)),
        false => (Scene::new(&mesh, length.into())?, DVec3::ZERO),
    };
    for (index, line) in std::fs::read_to_string(casts)?.lines().enumerate() {
        if line.trim().is_empty() || line.starts_with('#') {
            writeln!(out, "{line}")?;
            continue;
        }
        let wrong = || format!("{casts}:{}: give set,ox,oy,oz,dx,dy,dz and, if known, t", index + 1);
        let [origin, direction] = cast(line).ok_or_else(wrong)?;
        match scene.first_contact(origin - moved, direction, radius.into()) {
            Some(time) => writeln!(out, "{},{time}", line.trim_end())?,
            None => writeln!(out, "{},miss", line.trim_end())?,
        }
    }
    Ok(out.flush()?)
}

/// The origin and the direction of a line.
fn cast(line: &str) -> Option<[DVec3; 2]> {
    let fields: Vec<&str> = line.split(',').map(str::trim).collect();
    let [_, numbers @ ..] = &fields[..] else { return None };
    let number = |index: usize| numbers.get(index)?.parse::<f32>().ok().filter(|number| number.is_finite());
    let vector = |first| Some(Vec3::new(number(first)?, number(first + 1)?, number(first + 2)?).as_dvec3());
    matches!(fields.len(), 7 | 8).then(|| Some([vector(0)?, vector(3)?]))?
}
