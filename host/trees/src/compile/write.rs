//! Header and sections of a model of trees.

use super::Settings;
use super::container::{Container, OwnedSection, count, too_large};
use super::forest::Forest;
use super::parts::Parts;
use crate::ensemble::{Ensemble, Node, Output};
use crate::error::{Error, Result, problem};
use crate::rows::whole;
use palpate_onboard::Stopping;
use palpate_shared::format::{
    HeaderBuilder, Layout, OutputScale, Position, Prediction, RAW_FEATURES, Sentinel, Strangers, Tag, f32_key,
};

/// The model's bytes; `hash` is that of the ensemble as it was read.
pub(super) fn write(
    ensemble: &Ensemble,
    hash: u64,
    settings: &Settings,
    forest: &Forest<'_>,
    stopping: Stopping,
    layout: Layout,
    parts: &Parts,
) -> Result<Vec<u8>> {
    let priors = priors(settings, forest.objects(), parts.unit)?;
    let (unit_bits, unit_shift) = unit_bits(parts.unit);
    let header = HeaderBuilder::default()
        .with_layout(layout.code())
        .with_leaf(settings.leaf.code())
        .with_descriptor(forest.schema.map_or(RAW_FEATURES, |schema| schema.code))
        .with_key(forest.key.code())
        .with_last_object(byte(forest.objects() - 1)?)
        .with_last_feature(byte(forest.features - 1)?)
        .with_axes(parts.axes.len() as u16)
        .with_groups(parts.groups.len() as u16)
        .with_trees(count(forest.trees.len())?)
        .with_splits(count(forest.splits())?)
        .with_leaves(count(forest.leaves())?)
        .with_unit(parts.unit)
        .with_unit_bits(unit_bits)
        .with_unit_shift(unit_shift)
        .with_margin_error(parts.margin_error)
        .with_odds(stopping.odds())
        .with_max_touches(stopping.max_touches())
        .with_spacing(settings.stated.spacing)
        .with_speed(settings.stated.speed)
        .with_ensemble(hash)
        .with_cuts_length(count(parts.cuts.len())?)
        .with_nodes_length(count(parts.nodes.len())?)
        .with_leaves_length(count(parts.leaves.len())?);
    let sections = sections(ensemble, settings, forest, &parts.scales)?.into_iter().chain(parts.sections()).collect();
    Container { header, text: text(ensemble)?, sections, content: parts.content(&priors) }.bytes()
}

/// Sections that do not depend on the trees.
fn sections(
    ensemble: &Ensemble,
    settings: &Settings,
    forest: &Forest<'_>,
    scales: &[OutputScale],
) -> Result<Vec<OwnedSection>> {
    let mut sections = settings.stated.sections.clone();
    let mut put = |tag, must_understand, content| sections.push(OwnedSection::new(tag, must_understand, content));
    let origin = &ensemble.origin;
    if forest.schema.is_some() {
        if origin.background {
            // Whoever does not know it would name the background.
            put(Tag::Strangers, true, Strangers::header(true, false).to_vec());
        }
    } else if settings.scales.is_some() || ensemble.inputs.are_named() {
        let mut features = Vec::new();
        for (index, name) in ensemble.inputs.names().into_iter().enumerate() {
            let scale = settings.scales.as_ref().map_or(1.0, |scales| scales[index]);
            features.extend(scale.to_le_bytes());
            put_text(&mut features, name)?;
        }
        put(Tag::FeatureNames, false, features);
    }
    let imported = origin.imported.as_ref();
    if let Some(imported) = imported.filter(|_| forest.schema.is_none()) {
        let prediction = imported.prediction;
        if prediction != Prediction::default() || !scales.is_empty() {
            let mut content = Vec::new();
            prediction.write(scales, &mut |part| content.extend_from_slice(part));
            // Whoever does not know it would take scaled margins for values, or targets for classes.
            put(Tag::Prediction, prediction.scale != 1.0 || prediction.targets || !scales.is_empty(), content);
        }
        if let Some(sentinel) = sentinel(ensemble, settings) {
            put(Tag::Sentinel, true, sentinel.to_bytes().to_vec());
        }
    }
    if let Some(name) = &settings.position {
        put(Tag::Position, true, position(ensemble, settings, name)?.to_bytes().to_vec());
    }
    if let Some(columns) = imported.and_then(|imported| imported.columns.as_ref()) {
        // Their number was checked: it is the last one's number that is written.
        let number = |column: usize| u16::try_from(column).unwrap_or(u16::MAX).to_le_bytes();
        let all = std::iter::once(columns.names.len().saturating_sub(1)).chain(columns.used.iter().copied());
        put(Tag::Columns, false, all.flat_map(number).collect());
    }
    Ok(sections)
}

/// The features that stand for a missing value in a model over rows.
pub(super) fn sentinel(ensemble: &Ensemble, settings: &Settings) -> Option<Sentinel> {
    let imported = ensemble.origin.imported.as_ref().filter(|_| ensemble.schema().is_none())?;
    let [low, high] = imported.sentinel?;
    // The same for every feature, which was checked.
    let [low, high] = match settings.scales.as_ref().and_then(|scales| scales.first().copied()) {
        None => [f32_key(low), f32_key(high)],
        Some(scale) => [whole(low, scale), whole(high, scale)],
    };
    Some(Sentinel { low, high })
}

/// The feature that is a row's number.
fn position(ensemble: &Ensemble, settings: &Settings, name: &str) -> Result<Position> {
    let wrong = |allowed: &str| Err(Error::setting("row_number", name, allowed));
    if ensemble.schema().is_some() || ensemble.objects.len() < 2 || ensemble.prediction().targets {
        return wrong("it with classes of rows, which a sequence has one of");
    }
    let names = ensemble.inputs.names();
    let Some(feature) = names.iter().position(|own| *own == name) else {
        return wrong(&format!("the name of a feature that the trees split on, such as {}", names.join(", ")));
    };
    let scale = settings.scales.as_ref().map_or(1.0, |scales| scales[feature]);
    if names.len() < 2 || scale < 1.0 || scale.fract() != 0.0 || scale >= 2_147_483_648.0 {
        return wrong("one feature of several, with a whole number as its scale");
    }
    Ok(Position { feature: byte(feature)?, step: scale as i32 })
}

/// Returns an error unless the features that stand for a missing value are the same whole numbers for every feature: a
/// model states one range of them.
pub(super) fn check_sentinel(ensemble: &Ensemble, settings: &Settings) -> Result<()> {
    let sentinel = ensemble.origin.imported.as_ref().and_then(|imported| imported.sentinel);
    let (Some(sentinel), Some(scales)) = (sentinel, &settings.scales) else { return Ok(()) };
    let ends = |scale: &f32| sentinel.map(|end| whole(end, *scale));
    if scales.iter().any(|scale| ends(scale) != ends(&scales[0])) {
        let text = scales.iter().map(ToString::to_string).collect::<Vec<_>>().join(",");
        let allowed =
            format!("the same scale for all features, since {} stands for a missing value in each", sentinel[0]);
        return Err(Error::setting("scales", text, allowed));
    }
    Ok(())
}

/// The program's version and the objects' names, each with its length in a byte. Zeros follow, so that numbers are aligned
/// where the model is: chips that cannot load words from anywhere are faster then.
fn text(ensemble: &Ensemble) -> Result<Vec<u8>> {
    let mut text = Vec::new();
    for string in std::iter::once(env!("CARGO_PKG_VERSION")).chain(ensemble.objects.iter().map(String::as_str)) {
        put_text(&mut text, string)?;
    }
    text.resize(text.len().next_multiple_of(4), 0);
    Ok(text)
}

/// Appends a text with its length in a byte.
fn put_text(bytes: &mut Vec<u8>, text: &str) -> Result<()> {
    let length = u8::try_from(text.len())
        .map_err(|_| problem!("the name {text:?} is too long for a model").fix("Use names of at most 255 bytes."))?;
    bytes.push(length);
    bytes.extend(text.bytes());
    Ok(())
}

/// The logarithms of the priors in units, the largest 0.
fn priors(settings: &Settings, objects: usize, unit: f32) -> Result<Vec<i32>> {
    let Some(priors) = &settings.priors else { return Ok(vec![0; objects]) };
    if priors.len() != objects || !priors.iter().all(|prior| prior.is_finite() && *prior > 0.0) {
        let priors = priors.iter().map(ToString::to_string).collect::<Vec<_>>().join(",");
        return Err(Error::setting("priors", priors, format!("{objects} positive numbers, one for each object")));
    }
    let largest = priors.iter().copied().fold(0.0, f64::max);
    Ok(priors.iter().map(|prior| ((prior / largest).ln() / f64::from(unit)).round() as i32).collect())
}

/// A unit in bits, in Q32, as a number of 32 binary digits and a shift.
fn unit_bits(unit: f32) -> (u32, u8) {
    let bits = f64::from(unit) * std::f64::consts::LOG2_E * 4_294_967_296.0;
    // Units are from 2^-24 to 0.5 nats, so the shift is from 1 to 32.
    let shift = (0..=63_u8).rev().find(|&shift| bits * f64::from(shift).exp2() < 4_294_967_295.0).unwrap_or(0);
    ((bits * f64::from(shift).exp2()).round() as u32, shift)
}

/// A CRC-64 (XZ) of everything that makes up an ensemble.
pub(super) fn hash(ensemble: &Ensemble) -> u64 {
    const CRC: crc::Crc<u64> = crc::Crc::<u64>::new(&crc::CRC_64_XZ);
    let mut digest = CRC.digest();
    digest.update(&[ensemble.schema().map_or(RAW_FEATURES, |schema| schema.code)]);
    for name in &ensemble.objects {
        digest.update(name.as_bytes());
        digest.update(&[0]);
    }
    ensemble.base_margins.iter().for_each(|value| digest.update(&value.to_bits().to_le_bytes()));
    for tree in &ensemble.trees {
        let object = match tree.output {
            Output::One(object) => object as u64,
            Output::Each => u64::MAX,
        };
        digest.update(&object.to_le_bytes());
        for node in &tree.nodes {
            match node {
                Node::Leaf(values) => values.iter().for_each(|value| digest.update(&value.to_bits().to_le_bytes())),
                Node::Split { feature, threshold, missing_left, left, right } => {
                    for number in [*feature, usize::from(*missing_left), *left, *right] {
                        digest.update(&(number as u64).to_le_bytes());
                    }
                    digest.update(&threshold.to_bits().to_le_bytes());
                }
            }
        }
    }
    digest.finalize()
}

fn byte(number: usize) -> Result<u8> {
    u8::try_from(number).map_err(|_| too_large())
}
