//! Check that objects can be taught to an ensemble.

use super::{LEAST, Settings};
use crate::ensemble::{Ensemble, Output, OverTouches, StatedProbe, TouchOrigin};
use crate::error::{Error, Result, TeachProblem};
use crate::evaluate::{Candidate, OfTouches};
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
    let is_known = |object: &&ObjectTouches| !Candidate::Full(ensemble).outputs_of(&object.name).is_empty();
    if let Some(object) = recorded.objects.iter().find(is_known) {
        return Err(TeachProblem::Known { object: object.name.clone() }.into());
    }
    names(ensemble, recorded)?;
    comparable(ensemble, descriptor, known, recorded)?;
    Ok(descriptor)
}

/// The descriptor of an ensemble whose leaves have a value for each object.
fn of_vectors(ensemble: &Ensemble, settings: &Settings) -> Result<Descriptor> {
    self::settings(settings)?;
    ensemble.check()?;
    let descriptor = ensemble.descriptor().ok_or(TeachProblem::NotOfTouches)?;
    if ensemble.trees.iter().any(|tree| tree.output != Output::Each) {
        return Err(TeachProblem::OneValue.into());
    }
    Ok(descriptor)
}

/// Touches of each of the ensemble's objects.
fn none_missing(ensemble: &Ensemble, known: &Dataset) -> Result<()> {
    let has_touches = |name: &&String| known.objects.iter().any(|object| object.name == **name && !object.is_empty());
    let missing: Vec<String> = ensemble.objects.iter().filter(|name| !has_touches(name)).cloned().collect();
    if missing.is_empty() { Ok(()) } else { Err(TeachProblem::Missing { objects: missing }.into()) }
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
        return Err(TeachProblem::Nothing.into());
    }
    if recorded.objects.iter().any(|object| object.name == BACKGROUND) {
        return Err(TeachProblem::Known { object: BACKGROUND.into() }.into());
    }
    let names: Vec<String> = ensemble.objects.iter().cloned().chain(recorded.names()).collect();
    crate::ensemble::check_names(&names)?;
    if names.len() > crate::ensemble::MAX_OBJECTS {
        return Err(crate::ensemble::train::too_many_objects(names.len()));
    }
    Ok(())
}

/// Checks that both sides have the same probe, if they state one, and the same stroke.
fn same_probe(stated: Option<StatedProbe>, longest: u32, recorded: &Dataset) -> Result<()> {
    let stated = stated.as_ref().map(StatedProbe::trained);
    StatedProbe::compare_with(["the simulation", "the recording"], stated, longest, recorded)
}

/// Partial touches are evidence only where every approach was recorded.
pub(super) fn approaches(counted: Counted, recorded: &Dataset) -> Result<()> {
    match counted {
        Counted::Full => Ok(()),
        Counted::Contacts | Counted::All if recorded.holds_approaches() => Ok(()),
        Counted::Contacts | Counted::All => Err(TeachProblem::FullTouches { counted }.into()),
    }
}

/// Every touch has a pose, if the descriptor needs one.
pub(super) fn poses(descriptor: Descriptor, recorded: &Dataset) -> Result<()> {
    let without = |object: &&ObjectTouches| object.touches().iter().any(|touch| touch.pose().is_none());
    match recorded.objects.iter().find(without) {
        Some(object) if descriptor.needs_pose() => {
            Err(TeachProblem::NoPose { object: object.name.clone(), descriptor }.into())
        }
        _ => Ok(()),
    }
}

/// Enough touches that are evidence to each recorded object, so that parts of them can be held out.
pub(super) fn enough(recorded: &Dataset, evidence: &[usize]) -> Result<()> {
    match recorded.objects.iter().zip(evidence).find(|(_, touches)| **touches < LEAST) {
        Some((object, &touches)) => {
            Err(TeachProblem::TooFew { object: object.name.clone(), touches, least: LEAST }.into())
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
        _ => Err(TeachProblem::OtherNoise { stated: stated.to_string(), there: there.to_string() }.into()),
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
