//! Casts from a file, to compare this simulator with another engine.
//!
//! A line is `set,ox,oy,oz,dx,dy,dz` or `set,ox,oy,oz,dx,dy,dz,t`: the name of a set of casts, where the sphere's center
//! starts, its direction (not renormalized: times are in lengths of the direction), and the time of contact that another
//! engine found (`miss` for none). Numbers are rounded to the nearest `f32`, because meshes and engines have those. Lines
//! that begin with `#` and blank lines are kept as they are.

use crate::error::{Error, Place, ProbeProblem, Result};
use crate::probe::scene::Scene;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// A line of a file of casts.
#[derive(Clone, Debug, PartialEq)]
pub enum Line {
    /// A comment or a blank line.
    Other(String),
    /// A cast.
    Cast(Cast),
}

/// A sphere to be moved toward a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Cast {
    /// The line as it stands in the file.
    pub text: String,
    /// The set it belongs to.
    pub set: String,
    /// Start of the sphere's center.
    pub origin: DVec3,
    /// Its direction.
    pub direction: DVec3,
    /// The time that the file gives: `Some(None)` for a miss, `None` if it gives none.
    pub known: Option<Option<f64>>,
}

/// Reads a file of casts.
///
/// # Errors
/// [`Error::Io`] when the file cannot be read; a [`ProbeProblem`] with its line when a line is wrong.
pub fn read(path: &Path) -> Result<Vec<Line>> {
    let io = |error| Error::io(path, "read the casts", error);
    let reader = BufReader::new(File::open(path).map_err(io)?);
    let line = |(index, text): (usize, std::io::Result<String>)| {
        let text = text.map_err(io)?;
        if text.trim().is_empty() || text.starts_with('#') {
            return Ok(Line::Other(text));
        }
        let wrong = |problem| Error::at(Place::line(path, index as u64 + 1), problem);
        parse(text).map(Line::Cast).map_err(wrong)
    };
    reader.lines().enumerate().map(line).collect()
}

fn parse(text: String) -> Result<Cast, ProbeProblem> {
    let fields: Vec<&str> = text.trim().split(',').map(str::trim).collect();
    if fields.len() != 7 && fields.len() != 8 {
        return Err(ProbeProblem::CastFields { fields: fields.len() });
    }
    let vector = |first: usize| -> Result<DVec3, ProbeProblem> {
        let mut vector = Vec3::ZERO;
        for axis in 0..3 {
            let field = fields[first + axis];
            let value = field.parse::<f32>().ok().filter(|value| value.is_finite());
            vector[axis] = value.ok_or_else(|| ProbeProblem::CastCoordinate { text: field.to_owned() })?;
        }
        Ok(vector.as_dvec3())
    };
    let known = match fields.get(7) {
        None => None,
        Some(&"miss") => Some(None),
        Some(&field) => {
            let time = field.parse().ok().filter(|time: &f64| time.is_finite() && *time >= 0.0);
            Some(Some(time.ok_or_else(|| ProbeProblem::CastTime { text: field.to_owned() })?))
        }
    };
    let (set, origin, direction) = (fields[0].to_owned(), vector(1)?, vector(4)?);
    Ok(Cast { set, origin, direction, known, text })
}

/// The times of contact of the casts among the lines, in their order; `radius` in the units of the scene.
pub fn times(scene: &Scene, lines: &[Line], radius: f64) -> Vec<Option<f64>> {
    let time = |line: &Line| match line {
        Line::Other(_) => None,
        Line::Cast(cast) => Some(scene.first_contact(cast.origin, cast.direction, radius)),
    };
    lines.par_iter().filter_map(time).collect()
}

/// The lines with the casts' times appended: the shortest decimals that are read back as the same `f64`, or `miss`.
pub fn annotate(lines: &[Line], times: &[Option<f64>]) -> String {
    let mut text = String::new();
    let mut times = times.iter();
    for line in lines {
        // Writing to a string cannot fail.
        let _ = match line {
            Line::Other(other) => writeln!(text, "{other}"),
            Line::Cast(cast) => match times.next().copied().flatten() {
                Some(time) => writeln!(text, "{},{time}", cast.text.trim_end()),
                None => writeln!(text, "{},miss", cast.text.trim_end()),
            },
        };
    }
    text
}

/// Agreement of the times of one set with those that a file gives.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Agreement {
    /// The name of the set.
    pub set: String,
    /// Number of its casts with a known time.
    pub casts: usize,
    /// Known contacts that were not found.
    pub missed: usize,
    /// Contacts that were found where the file has none.
    pub false_contacts: usize,
    /// The largest difference between a known and a found time.
    pub largest_error: f64,
}

/// Compares times with the known ones; sets in the order in which they first appear.
pub fn agreement(lines: &[Line], times: &[Option<f64>]) -> Vec<Agreement> {
    let mut sets: Vec<Agreement> = Vec::new();
    let casts = lines.iter().filter_map(|line| match line {
        Line::Cast(cast) => Some(cast),
        Line::Other(_) => None,
    });
    for (cast, found) in casts.zip(times) {
        let Some(known) = cast.known else { continue };
        let place = sets.iter().position(|set| set.set == cast.set).unwrap_or_else(|| {
            sets.push(Agreement { set: cast.set.clone(), ..Agreement::default() });
            sets.len() - 1
        });
        let set = &mut sets[place];
        set.casts += 1;
        match (known, found) {
            (Some(known), Some(found)) => set.largest_error = set.largest_error.max((known - found).abs()),
            (Some(_), None) => set.missed += 1,
            (None, Some(_)) => set.false_contacts += 1,
            (None, None) => {}
        }
    }
    sets
}
