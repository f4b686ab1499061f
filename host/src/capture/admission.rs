//! Admission of a capture to a directory, given its content.

use super::Settings;
use crate::error::{CaptureProblem, Error, Place, Result};
use crate::touches::{Entry, Listing, Lying, Origin, files};
use std::path::{Path, PathBuf};

/// State that a capture begins with.
pub(super) struct Admission {
    /// The data set to delete first.
    pub(super) replaced: Option<Listing>,
    /// The listing to start or go on from: it names every object of the capture.
    pub(super) listing: Listing,
}

/// The file that an object's touches are in until it is complete.
pub(super) fn part(directory: &Path, name: &str) -> PathBuf {
    directory.join(format!("{name}.part"))
}

/// The files that hold an object's touches, complete or not.
pub(super) fn own_files(directory: &Path, name: &str) -> impl Iterator<Item = PathBuf> {
    let entry = Entry { name: name.into(), ..Entry::default() };
    [entry.file(directory), part(directory, name)].into_iter()
}

/// Compares the content of a directory with the planned capture, and rejects losses.
pub(super) fn admit(directory: &Path, settings: &Settings, objects: &[Entry]) -> Result<Admission> {
    let names: Vec<String> = objects.iter().map(|entry| entry.name.clone()).collect();
    let refuse = |problem| Err(Error::at(Place::file(directory), problem));
    let wanted = Listing { objects: objects.to_vec(), ..Listing::new(&settings.origin, []) };
    let found = match Listing::read(directory) {
        // What cannot be read cannot be compared.
        Err(Error::At { .. }) if settings.force => None,
        found => found?,
    };
    // Files that a capture of these objects writes, and that no capture has listed.
    let is_listed = |name: &str| found.iter().any(|found| found.objects.iter().any(|entry| entry.name == name));
    let unlisted =
        objects.iter().filter(|entry| !is_listed(&entry.name)).flat_map(|entry| own_files(directory, &entry.name));
    let mut foreign: Vec<String> = unlisted.filter(|path| path.exists()).filter_map(|path| file_name(&path)).collect();
    if found.is_none() {
        foreign.extend(files(directory)?.iter().filter_map(|(_, path)| file_name(path)));
    }
    foreign.sort();
    foreign.dedup();
    if !settings.force && !foreign.is_empty() {
        return refuse(CaptureProblem::HoldsFiles { files: foreign });
    }
    let Some(found) = found else { return Ok(Admission { replaced: None, listing: wanted }) };
    if found.is_recorded() {
        let touches = touches(&found.objects);
        return refuse(CaptureProblem::HoldsRecorded { touches, objects: found.names() });
    }
    if settings.force {
        return Ok(Admission { replaced: Some(found), listing: wanted });
    }
    if settings.resume && (!settings.add || !found.complete) {
        return resumed(directory, found, &wanted, settings.add);
    }
    if !found.complete {
        return refuse(CaptureProblem::HoldsUnfinished { touches: touches(&found.objects), objects: found.names() });
    }
    let differences = differences(&found, &wanted);
    if settings.add {
        if !differences.is_empty() {
            return refuse(CaptureProblem::AddsOtherSettings { differences });
        }
        let there: Vec<String> = found.names().into_iter().filter(|name| names.contains(name)).collect();
        // Resumed after it was done, nothing is left to do.
        if !there.is_empty() && !settings.resume {
            return refuse(CaptureProblem::AlreadyThere { objects: there });
        }
        return Ok(Admission { replaced: None, listing: merged(found, &wanted) });
    }
    let others: Vec<Entry> = found.objects.iter().filter(|entry| !names.contains(&entry.name)).cloned().collect();
    if !others.is_empty() {
        let objects = others.iter().map(|entry| entry.name.clone()).collect();
        return refuse(CaptureProblem::HoldsOtherObjects { objects, touches: touches(&others) });
    }
    if !differences.is_empty() {
        return refuse(CaptureProblem::HoldsOtherSettings { objects: found.names(), differences });
    }
    Ok(Admission { replaced: Some(found), listing: wanted })
}

/// Returns the state to resume from.
fn resumed(directory: &Path, found: Listing, wanted: &Listing, add: bool) -> Result<Admission> {
    let refuse = |problem| Err(Error::at(Place::file(Listing::path(directory)), problem));
    if found.palpate != wanted.palpate {
        return refuse(CaptureProblem::ResumesOtherVersion { found: found.palpate });
    }
    let differences = differences(&found, wanted);
    if !differences.is_empty() {
        return refuse(CaptureProblem::ResumesOtherSettings { differences });
    }
    let samples = found.origin.samples();
    let is_wanted = |entry: &Entry| wanted.objects.iter().any(|wanted| wanted.name == entry.name);
    let is_done = |entry: &Entry| entry.touches == samples.end - samples.start;
    let is_same = if add {
        found.objects.iter().all(|entry| is_wanted(entry) || is_done(entry))
    } else {
        found.names() == wanted.names()
    };
    if !is_same {
        return refuse(CaptureProblem::ResumesOtherObjects { objects: found.names() });
    }
    Ok(Admission { replaced: None, listing: merged(found, wanted) })
}

/// Returns the listing that was found, incomplete again, with the wanted objects that it lacks.
fn merged(found: Listing, wanted: &Listing) -> Listing {
    let mut objects = found.objects;
    for entry in &wanted.objects {
        if !objects.iter().any(|there| there.name == entry.name) {
            objects.push(entry.clone());
        }
    }
    objects.sort_by(|a, b| a.name.cmp(&b.name));
    let complete = false;
    Listing { palpate: wanted.palpate.clone(), complete, origin: found.origin, objects, recorded: Vec::new() }
}

/// Settings that differ, with both values: "touches is 20 there and 30 here". Empty if none does.
fn differences(there: &Listing, here: &Listing) -> String {
    let differences = [settings(&there.origin, &here.origin), meshes(there, here)].concat();
    differences.join(", ")
}

/// Differences between the meshes of the same objects.
fn meshes(there: &Listing, here: &Listing) -> Vec<String> {
    let mut differences = Vec::new();
    for (name, own) in here.objects.iter().map(|entry| (&entry.name, entry)) {
        let Some(other) = there.objects.iter().find(|entry| entry.name == *name) else { continue };
        let count = |entry: &Entry| entry.instances.len().max(1);
        if own.instances.len() != other.instances.len() {
            differences.push(format!("{name} has {} instances there and {} here", count(other), count(own)));
        } else if own.instances != other.instances {
            differences.push(format!("{name} has other instances there than here"));
        }
        if own.placements != other.placements {
            let said = |entry: &Entry| {
                let of = |one: &Lying| match &one.instance {
                    Some(instance) => format!("{instance} {}={}", one.name, one.weight),
                    None => format!("{}={}", one.name, one.weight),
                };
                entry.placements.iter().map(of).collect::<Vec<_>>().join(", ")
            };
            differences.push(format!("{name}'s placements are {} there and {} here", said(other), said(own)));
        }
        // Earlier versions stated no checksums.
        let is_known = own.meshes.len() == other.meshes.len();
        for (index, _) in own.meshes.iter().zip(&other.meshes).enumerate().filter(|(_, (a, b))| is_known && a != b) {
            let of = own.instances.get(index).map_or_else(String::new, |instance| format!(" of instance {instance}"));
            differences.push(format!("{name}'s mesh{of} is another one there than here"));
        }
        if let (Some(own), Some(other)) = (own.millimeters, other.millimeters)
            && own != other
        {
            differences.push(format!("a unit of {name}'s mesh is {other} mm there and {own} mm here"));
        }
    }
    differences
}

/// Settings that differ, with both values.
fn settings(there: &Origin, here: &Origin) -> Vec<String> {
    let fields = |origin| match serde_json::to_value(origin) {
        Ok(serde_json::Value::Object(fields)) => fields,
        _ => serde_json::Map::new(),
    };
    let (there, here) = (fields(there), fields(here));
    // Settings that are the default may be left out on either side.
    let mut names: Vec<&String> = there.keys().chain(here.keys().filter(|name| !there.contains_key(*name))).collect();
    names.retain(|name| there.get(*name) != here.get(*name));
    let value = |fields: &serde_json::Map<_, _>, name: &String| match fields.get(name) {
        Some(value) => serde_json::Value::to_string(value),
        None => "the default".to_owned(),
    };
    let said = names
        .into_iter()
        .map(|name| format!("{name} is {} there and {} here", value(&there, name), value(&here, name)));
    said.collect()
}

fn touches(entries: &[Entry]) -> u64 {
    entries.iter().map(|entry| entry.touches).sum()
}

fn file_name(path: &Path) -> Option<String> {
    Some(path.file_name()?.to_string_lossy().into_owned())
}
