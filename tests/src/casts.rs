//! Casts from a file whose times another engine computed, and how the simulator's agree with them.
//!
//! A line is `set,ox,oy,oz,dx,dy,dz,t`: the name of a set of casts, where the sphere's center starts, its direction (not
//! renormalized: times are in lengths of the direction), and the time of contact (`miss` for none). Numbers are rounded to
//! the nearest `f32`, because meshes and engines have those. Lines that begin with `#` are comments.

use glam::{DVec3, Vec3};
use std::path::Path;

/// A sphere to be moved toward a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Cast {
    /// The set it belongs to.
    pub set: String,
    /// Start of the sphere's center.
    pub origin: DVec3,
    /// Its direction.
    pub direction: DVec3,
    /// The time of contact; none for a miss.
    pub known: Option<f64>,
}

/// Reads a file of casts.
///
/// # Panics
/// If the file cannot be read, or a line is wrong.
#[must_use]
pub fn read(path: &Path) -> Vec<Cast> {
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    lines.map(|line| parse(line).unwrap_or_else(|| panic!("{}: {line}", path.display()))).collect()
}

fn parse(line: &str) -> Option<Cast> {
    let [set, numbers @ .., time] = &line.split(',').collect::<Vec<_>>()[..] else { return None };
    let numbers: Vec<f32> = numbers.iter().map(|number| number.parse().ok()).collect::<Option<_>>()?;
    let &[x, y, z, dx, dy, dz] = &numbers[..] else { return None };
    let [origin, direction] = [Vec3::new(x, y, z), Vec3::new(dx, dy, dz)].map(|vector| vector.as_dvec3());
    let known = if *time == "miss" { None } else { Some(time.parse().ok()?) };
    Some(Cast { set: (*set).to_owned(), origin, direction, known })
}

/// Agreement of the times of one set with the known ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Agreement {
    /// The name of the set.
    pub set: String,
    /// Number of its casts.
    pub casts: usize,
    /// Known contacts that were not found.
    pub missed: usize,
    /// Contacts that were found where the file has none.
    pub false_contacts: usize,
    /// The largest difference between a known and a found time.
    pub largest_error: f64,
}

/// Compares times with the known ones; sets in the order in which they first appear.
#[must_use]
pub fn agreement(casts: &[Cast], times: &[Option<f64>]) -> Vec<Agreement> {
    let mut sets: Vec<Agreement> = Vec::new();
    for (cast, found) in casts.iter().zip(times) {
        let place = sets.iter().position(|set| set.set == cast.set).unwrap_or_else(|| {
            sets.push(Agreement { set: cast.set.clone(), ..Agreement::default() });
            sets.len() - 1
        });
        let set = &mut sets[place];
        set.casts += 1;
        match (cast.known, found) {
            (Some(known), Some(found)) => set.largest_error = set.largest_error.max((known - found).abs()),
            (Some(_), None) => set.missed += 1,
            (None, Some(_)) => set.false_contacts += 1,
            (None, None) => {}
        }
    }
    sets
}
