//! Check that objects can be taught to an ensemble.

use super::{LEAST, Settings};
use crate::ensemble::{Ensemble, Output, OverTouches, StatedProbe, TouchOrigin, object_of};
use crate::error::{Error, Result, problem};
use crate::mesh::BACKGROUND;
use crate::probe::noise::Noise;
use crate::touches::{Dataset, ObjectTouches};
use palpate_shared::Descriptor;
use palpate_shared::format::Counted;

/// Rejects recordings that cannot be taught, before the work begins.
pub(super) fn check(
    ensemble: &Ensemble,
    known: &Dataset,
    recorded: &Dataset,
    settings: &Settings,
) -> Result<Descriptor> {
    let descriptor = of_vectors(ensemble, settings)?;
    none_missing(ensemble, known)?;
    let has_placements = TouchOrigin::of(&ensemble.origin)?.outputs(&ensemble.objects).is_some();
    let is_known = |object: &&ObjectTouches| {
        let mut known = ensemble.objects.iter().take(ensemble.known_count());
        known.any(|known| *known == object.name || has_placements && object_of(known) == object.name)
    };
    if let Some(object) = recorded.objects.iter().find(is_known) {
        return Err(is_known_already(&object.name));
    }
    names(ensemble, recorded)?;
    comparable(ensemble, descriptor, known, recorded)?;
    Ok(descriptor)
}

/// The descriptor of an ensemble whose leaves have a value for each object.
fn of_vectors(ensemble: &Ensemble, settings: &Settings) -> Result<Descriptor> {
    self::settings(settings)?;
    ensemble.check()?;
    let descriptor = ensemble.descriptor().ok_or_else(|| {
        problem!("objects are taught by touches, and the ensemble is over rows of features")
            .fix("Give an ensemble that was trained on touches.")
    })?;
    if ensemble.trees.iter().any(|tree| tree.output != Output::Each) {
        let what = "a leaf of the ensemble holds one value, so that no object can be added to its trees";
        let fix = "Train with leaves that hold a value for each object, as the preset compact does.";
        return Err(Error::new(what).fix(fix));
    }
    Ok(descriptor)
}

/// Touches of each of the ensemble's objects.
fn none_missing(ensemble: &Ensemble, known: &Dataset) -> Result<()> {
    let has_touches = |name: &&String| known.objects.iter().any(|object| object.name == **name && !object.is_empty());
    let missing: Vec<String> = ensemble.objects.iter().filter(|name| !has_touches(name)).cloned().collect();
    if missing.is_empty() {
        return Ok(());
    }
    Err(problem!("there are no touches of {}, which the ensemble knows", missing.join(", "))
        .fix("Give the data set that the ensemble was trained on, or another one of the same objects."))
}

/// Recorded touches that may be compared with the simulated ones.
fn comparable(ensemble: &Ensemble, descriptor: Descriptor, known: &Dataset, recorded: &Dataset) -> Result<()> {
    let stated = TouchOrigin::of(&ensemble.origin)?.probe.or_else(|| StatedProbe::of(known));
    same_probe(stated, ensemble.trained_touches().largest_spread, recorded)?;
    approaches(ensemble.trained_touches().counted, recorded)?;
    poses(descriptor, recorded)
}

/// Names that the ensemble, with the recorded objects, can have.
fn names(ensemble: &Ensemble, recorded: &Dataset) -> Result<()> {
    if recorded.objects.is_empty() {
        let none = problem!("there are no recorded touches");
        return Err(none.fix("Record approaches to the object, one line per approach."));
    }
    if recorded.objects.iter().any(|object| object.name == BACKGROUND) {
        return Err(is_known_already(BACKGROUND));
    }
    let names: Vec<String> = ensemble.objects.iter().cloned().chain(recorded.names()).collect();
    crate::ensemble::check_names(&names)?;
    if names.len() > crate::ensemble::MAX_OBJECTS {
        return Err(crate::ensemble::train::too_many_objects(names.len()));
    }
    Ok(())
}

fn is_known_already(object: &str) -> Error {
    problem!("{object} is known already: a taught object needs a name that no other object has").fix(
        "Fit the probe to recordings of objects that it knows, or rename the recording to teach it as another object.",
    )
}

/// Checks that both sides have the same probe, if they state one, and the same stroke.
fn same_probe(stated: Option<StatedProbe>, longest: u32, recorded: &Dataset) -> Result<()> {
    let stated = stated.as_ref().map(StatedProbe::trained);
    StatedProbe::compare_with(["the simulation", "the recording"], stated, longest, recorded)
}

/// Partial touches are evidence only where every approach was recorded.
pub(super) fn approaches(counted: Counted, recorded: &Dataset) -> Result<()> {
    let evidence = match counted {
        Counted::Full => return Ok(()),
        Counted::Contacts => "every touch with a contact",
        Counted::All => "every approach",
    };
    if recorded.holds_approaches() {
        return Ok(());
    }
    let full = problem!(
        "only full touches were recorded, but the model takes {evidence} as evidence: it would learn that the objects never \
         cause other touches"
    );
    Err(full.fix("Record every approach, also those that missed a finger, or train on full touches."))
}

/// Every touch has a pose, if the descriptor needs one.
pub(super) fn poses(descriptor: Descriptor, recorded: &Dataset) -> Result<()> {
    let without = |object: &&ObjectTouches| object.touches().iter().any(|touch| touch.pose().is_none());
    match recorded.objects.iter().find(without) {
        Some(object) if descriptor.needs_pose() => {
            let (object, descriptor) = (&object.name, descriptor.name());
            Err(problem!("touches of {object} have no pose, which the descriptor {descriptor} needs")
                .fix("Record the pose with every touch, or train without."))
        }
        _ => Ok(()),
    }
}

/// Enough touches that are evidence to each recorded object, so that parts of them can be held out.
pub(super) fn enough(recorded: &Dataset, evidence: &[usize]) -> Result<()> {
    match recorded.objects.iter().zip(evidence).find(|(_, touches)| **touches < LEAST) {
        Some((object, &touches)) => {
            let object = &object.name;
            Err(problem!("only {touches} recorded touches of {object} are evidence, and at least {LEAST} are needed")
                .fix("Record more approaches; 300 are a good start."))
        }
        None => Ok(()),
    }
}

/// Noise that the ensemble was trained for and touches of the known objects lack.
pub(super) fn missing_noise(ensemble: &Ensemble, known: &Dataset) -> Result<Noise> {
    let (stated, there) = (TouchOrigin::of(&ensemble.origin)?.noise.unwrap_or_default(), known.real());
    match there {
        _ if there == stated => Ok(Noise::default()),
        _ if there.is_none() => Ok(stated),
        // What was added to noise that was there is not stated.
        _ => {
            Err(problem!("the ensemble was trained for {stated}, and the touches of its objects have {there} already")
                .fix("Give simulated touches without noise, or train again on these."))
        }
    }
}

/// Settings in their ranges.
pub(super) fn settings(settings: &Settings) -> Result<()> {
    if settings.approaches == 0 {
        return Err(Error::setting("approaches", 0, "1 or more"));
    }
    if settings.groups == 0 {
        return Err(Error::setting("groups", 0, "1 or more"));
    }
    if settings.threads == Some(0) {
        return Err(Error::setting("threads", 0, "at least 1"));
    }
    settings.noise.iter().try_for_each(Noise::check)?;
    Ok(())
}
