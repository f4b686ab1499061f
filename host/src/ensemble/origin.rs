//! Origin of the touches that an ensemble was trained on.

use super::{Provenance, Trained};
use crate::error::{Error, Result, problem};
use crate::probe::approach::Probe;
use crate::probe::hand;
use crate::probe::noise::Noise;
use crate::probe::unit::{self, tenth};
use crate::touches::{self, Dataset, Longest, Surroundings};
use palpate_shared::format::{Length, Outputs, Tag, TrainedProbe};
use palpate_trees::compile::{self, CompiledModel, OwnedSection};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Statements of an ensemble about its training touches. Empty for ensembles from elsewhere.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TouchOrigin {
    /// The probe that made them, where the data set states it.
    pub probe: Option<StatedProbe>,
    /// Noise added to them in training; none also where that is not known.
    pub noise: Option<Noise>,
    /// For each object, a fingerprint of the first of its touches.
    pub touches: BTreeMap<String, u64>,
    /// Kind of touches, and so which ones are evidence.
    pub trained: Option<Trained>,
    /// For outputs that are placements of objects, called `object/placement`: the weight of each among those of its object.
    pub placements: BTreeMap<String, f64>,
}

impl TouchOrigin {
    const PROBE: &str = "palpate_probe";
    const NOISE: &str = "palpate_noise";
    const TOUCHES: &str = "palpate_touches";
    const TRAINED: &str = "palpate_trained";
    const PLACEMENTS: &str = "palpate_placements";

    /// Statements of touches about themselves, and the probe that they were made with.
    #[cfg(feature = "train")]
    pub(crate) fn new(dataset: &Dataset, probe: Option<StatedProbe>) -> Self {
        Self { probe, touches: fingerprints(dataset), ..Self::default() }
    }

    /// Statements of `origin`.
    ///
    /// # Errors
    /// For an attribute that is not what this crate writes.
    pub fn of(origin: &Provenance) -> Result<Self> {
        let attributes = &origin.attributes;
        let numbers = |name: &'static str| -> Result<BTreeMap<String, u64>> {
            let expected = "a JSON object of hexadecimal numbers";
            let read: Option<BTreeMap<String, String>> = parsed(attributes, name, expected)?;
            let number = |(object, text): (String, String)| match u64::from_str_radix(&text, 16) {
                Ok(number) => Ok((object, number)),
                Err(error) => Err(wrong_attribute(name, expected, error)),
            };
            read.into_iter().flatten().map(number).collect()
        };
        Ok(Self {
            probe: parsed(attributes, Self::PROBE, "a JSON object of radius, spacing, speed, tilt and length")?,
            noise: parsed(attributes, Self::NOISE, "a JSON object of what was added to the touches in training")?,
            touches: numbers(Self::TOUCHES)?,
            trained: trained(origin)?,
            placements: parsed(attributes, Self::PLACEMENTS, "a JSON object of weights")?.unwrap_or_default(),
        })
    }

    /// Makes `origin` state this.
    pub fn state(&self, origin: &mut Provenance) {
        let hexadecimal = |touches: &BTreeMap<String, u64>| {
            let numbers = touches.iter().map(|(name, fingerprint)| (name, format!("{fingerprint:016x}")));
            let numbers = Some(numbers.collect::<BTreeMap<_, _>>()).filter(|touches| !touches.is_empty());
            numbers.and_then(|numbers| serde_json::to_string(&numbers).ok())
        };
        let placements = Some(&self.placements).filter(|placements| !placements.is_empty());
        // Numbers and strings are always JSON.
        let statements = [
            (Self::PROBE, self.probe.and_then(|probe| serde_json::to_string(&probe).ok())),
            (Self::NOISE, self.noise.and_then(|noise| serde_json::to_string(&noise).ok())),
            (Self::TOUCHES, hexadecimal(&self.touches)),
            (Self::TRAINED, self.trained.and_then(|trained| serde_json::to_string(&trained).ok())),
            (Self::PLACEMENTS, placements.and_then(|placements| serde_json::to_string(placements).ok())),
        ];
        for (name, statement) in statements {
            match statement {
                Some(text) => origin.attributes.insert(name.into(), text),
                None => origin.attributes.remove(name),
            };
        }
    }

    /// Provenance of an ensemble that states this and nothing else.
    #[cfg(feature = "train")]
    pub(crate) fn origin(&self) -> Provenance {
        let mut origin = Provenance::default();
        self.state(&mut origin);
        origin
    }

    /// Statements of a compiled model of these objects.
    pub(crate) fn stated(&self, objects: &[String]) -> compile::Stated {
        // Where nothing is known, the published probe.
        let probe = self.probe.map_or_else(Probe::default, |stated| stated.probe);
        let mut sections = Vec::new();
        let mut put = |tag, must_understand, content: &[u8]| {
            sections.push(OwnedSection::new(tag, must_understand, content));
        };
        if let Some(probe) = self.probe.map(|stated| stated.trained()) {
            put(Tag::Probe, false, &probe.to_bytes()[..probe.length()]);
        }
        if let Some(trained) = &self.trained {
            // Whoever does not know it would take as evidence what is none.
            put(Tag::Touches, true, &trained.touches.to_bytes());
        }
        if let Some(noise) = self.noise {
            put(Tag::Noise, false, &noise.trained().to_bytes());
        }
        if let Some(shares) = self.trained.and_then(|trained| trained.pattern_shares()) {
            put(Tag::PatternShares, false, &shares.to_bytes());
        }
        if let Some(fingerprints) = self.section(objects) {
            put(Tag::Fingerprints, false, &fingerprints);
        }
        if let Some(outputs) = self.outputs(objects) {
            let mut content = Vec::new();
            Outputs::write(outputs.into_iter(), &mut |part| content.extend_from_slice(part));
            put(Tag::Outputs, true, &content);
        }
        compile::Stated { spacing: probe.spacing as f32, speed: probe.speed as f32, sections }
    }

    /// For each output of an ensemble the number of its object, and its share of the object; none if each output is an object.
    pub(crate) fn outputs(&self, names: &[String]) -> Option<Vec<(u8, f64)>> {
        if self.placements.is_empty() {
            return None;
        }
        let (mut before, mut number) = (None, 0_u8);
        let output = |name: &String| {
            let object = object_of(name);
            number = number.saturating_add(u8::from(before.as_deref().is_some_and(|before| before != object)));
            before = Some(object.to_owned());
            (number, self.placements.get(name).copied().unwrap_or(1.0))
        };
        Some(names.iter().map(output).collect())
    }

    /// The content of the section that says which touches they were, for a model of these objects; none where nothing is known.
    fn section(&self, objects: &[String]) -> Option<Vec<u8>> {
        let fingerprint = |name: &String| self.touches.get(name).map_or(0, |&fingerprint| short(fingerprint));
        let fingerprints: Vec<u16> = objects.iter().map(fingerprint).collect();
        let is_known = fingerprints.iter().any(|&fingerprint| fingerprint != 0);
        is_known.then(|| fingerprints.into_iter().flat_map(u16::to_le_bytes).collect())
    }
}

/// The object of an output: the part of the output's name before the last slash.
pub(crate) fn object_of(output: &str) -> &str {
    output.rsplit_once('/').map_or(output, |(object, _)| object)
}

/// The probe that a data set was made with, and the size of its objects.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StatedProbe {
    /// The probe's measures.
    #[serde(flatten)]
    pub probe: Probe,
    /// Unit of its lengths.
    #[serde(default = "tenth", with = "unit")]
    pub unit: Length,
    /// The longest side of an object's bounding box, in units; of no meaning in millimeters.
    pub length: f64,
    /// Surroundings of the objects.
    #[serde(default, skip_serializing_if = "Surroundings::is_floating")]
    pub scene: Surroundings,
}

/// The probe that a model of unknown origin is for: the published one.
impl Default for StatedProbe {
    fn default() -> Self {
        Self { probe: Probe::default(), unit: Length::Tenth, length: 10.0, scene: Surroundings::Floating }
    }
}

impl StatedProbe {
    /// The probe that a data set states, if it states one.
    pub fn of(dataset: &Dataset) -> Option<Self> {
        dataset.origin.as_ref().map(Self::from)
    }

    /// Statements of a compiled model about it. Units are made tenths of the longest side, regardless of the length
    /// that objects were scaled to.
    pub fn trained(&self) -> TrainedProbe {
        let scale = match self.unit {
            Length::Tenth => 10.0 / self.length,
            Length::Millimeter => 1.0,
        };
        let scaled = |number: f64| (number * scale) as f32;
        let Probe { radius, spacing, speed, stroke, travel, stroke_tolerance, .. } = self.probe;
        let [radius, spacing, speed] = [radius, spacing, speed].map(scaled);
        let [stroke, travel, stroke_tolerance] = [stroke, travel, stroke_tolerance].map(|length| length.map(scaled));
        // At least a hundredth of a degree, since 0 is a floating object; a conversion saturates.
        let cone = self.scene.cone().map_or(0, |cone| ((100.0 * cone).round() as u16).max(1));
        TrainedProbe { radius, spacing, speed, length: self.unit, stroke, travel, cone, stroke_tolerance }
    }

    /// Compares what two sides state, such as a data set and a model; `names` says who they are.
    ///
    /// # Errors
    /// If radius, spacing, nominal speed, stroke, scale or scene differ. Tilt and travel are not compared: they are how
    /// approaches were drawn.
    pub fn compare(names: [&str; 2], [first, second]: [TrainedProbe; 2]) -> Result<()> {
        let differs = |a: f32, b: f32| (a - b).abs() > 1e-5 * a.abs().max(b.abs());
        let mut differences = Vec::new();
        if first.length != second.length {
            differences.push(format!("unit {:?} and {:?}", first.length.name(), second.length.name()));
        }
        let numbers = [
            ("radius", first.radius, second.radius),
            ("spacing", first.spacing, second.spacing),
            ("speed", first.speed, second.speed),
        ];
        let different = numbers.into_iter().filter(|(_, first, second)| differs(*first, *second));
        differences.extend(different.map(|(name, first, second)| format!("{name} {first} and {second}")));
        let strokes = [first.stroke, second.stroke];
        let is_same = match strokes {
            [Some(first), Some(second)] => !differs(first, second),
            _ => strokes == [None; 2],
        };
        if !is_same {
            let [first, second] = strokes.map(|stroke| stroke.map_or("none".into(), |stroke| stroke.to_string()));
            differences.push(format!("stroke {first} and {second}"));
        }
        if first.cone != second.cone {
            let [first, second] = [first.cone, second.cone].map(scene);
            differences.push(format!("scene {first} and {second}"));
        }
        if differences.is_empty() {
            return Ok(());
        }
        Err(Self::differs(names, &differences.join(", ")))
    }

    /// Two sides state different probes; `names` says who they are, `differences` what each states: "radius 0.15 and 0.3".
    pub fn differs([first, second]: [&str; 2], differences: &str) -> Error {
        problem!("{first} and {second} state different probes: {differences}")
            .fix("Use both with the same probe: with another, times have another meaning.")
    }
}

/// Latest contacts of touches without a stated stroke, compared with the stroke of a model.
impl StatedProbe {
    /// Compares a probe, such as a model's, with that of a data set, as [`compare`](Self::compare) does. Recorded touches may
    /// not state their stroke; it is then compared with their latest contacts: none may be later than the stroke of `probe`, by
    /// more than the tolerance that it states, or a fiftieth of it; and where they end at once, long before `longest`, the largest time between contacts that
    /// the model was trained on, another stroke ended them. `longest` of `u32::MAX`: not known.
    ///
    /// Cost: a pass over touches that no capture made.
    ///
    /// # Errors
    /// Errors of [`compare`](Self::compare); recorded touches that show another stroke, with both strokes; and times that are
    /// not in seconds.
    pub fn compare_with(names: [&str; 2], probe: Option<TrainedProbe>, longest: u32, dataset: &Dataset) -> Result<()> {
        let stated = Self::of(dataset).map(|stated| stated.trained());
        let is_simulated = stated.is_some() && !dataset.is_recorded();
        if let Some((probe, stated)) = probe.zip(stated) {
            // Recordings may state neither a stroke nor a scene.
            let completed = TrainedProbe {
                stroke: stated.stroke.or(probe.stroke),
                cone: if stated.cone == 0 { probe.cone } else { stated.cone },
                ..stated
            };
            Self::compare(names, [probe, if is_simulated { stated } else { completed }])?;
        }
        if is_simulated {
            return Ok(());
        }
        // Millimeters have no known scale unless the largest time is known. A data set that states no probe is of the published one.
        let published = || stated.is_none().then(|| Self::default().trained());
        let of_ten_units =
            |probe: &TrainedProbe| (10.0 * 3.0_f64.sqrt() + 2.0 * f64::from(probe.spacing)) / f64::from(probe.speed);
        if let Some(probe) =
            probe.or_else(published).filter(|probe| probe.length == Length::Tenth || longest < u32::MAX)
        {
            let known = if longest < u32::MAX { 4e-6 * f64::from(longest) } else { 0.0 };
            let of_scale = if probe.length == Length::Tenth { of_ten_units(&probe) } else { 0.0 };
            let plausible = Longest::of_scale(names[0], known.max(of_scale), probe.speed, probe.length);
            dataset.objects.iter().try_for_each(|object| object.check_times(&plausible))?;
        }
        // Touches with a position are of a table, whatever the probe states.
        let is_located = dataset.touches().any(|touch| touch.position().is_some());
        if probe.is_some_and(|probe| probe.cone == 0) && !is_located && !dataset.placement_shares().is_empty() {
            return Err(Self::differs(names, "scene floating and table"));
        }
        let stroke = probe.and_then(|probe| probe.stroke);
        let [window, allowed] = match probe.and_then(|probe| stroke_of(&probe)) {
            Some(times) => times.map(Some),
            None => [None; 2],
        };
        let Some(latest) = Latest::of(dataset) else { return Ok(()) };
        let is_later = allowed.is_some_and(|allowed| latest.micros > allowed);
        let is_ended = |window: f64| latest.ends_at_once() && latest.micros < ENDED * window;
        // Without a stroke the longest time of the training is that of the objects' shapes.
        let longest = Some(f64::from(longest)).filter(|_| longest < u32::MAX);
        let is_other = match window {
            Some(window) => is_later || is_ended(window * STATED),
            None => longest.is_some_and(is_ended),
        };
        if !is_other {
            return Ok(());
        }
        let [first, second] = names;
        let seconds = |micros: f64| format!("{:.3} s", micros / 1e6);
        let stroke = match stroke.zip(window).zip(allowed) {
            Some(((stroke, window), allowed)) if is_later => {
                format!(
                    "a stroke of {stroke} ({}), which explains contacts up to {}",
                    seconds(window),
                    seconds(allowed)
                )
            }
            Some(((stroke, window), _)) => format!("a stroke of {stroke} ({})", seconds(window)),
            None => "no stroke".into(),
        };
        let latest = seconds(latest.micros);
        let found = match is_later {
            true => format!("contacts come up to {latest} after the first"),
            false => format!("no contact is later than {latest} after the first, though many come just before"),
        };
        Err(problem!("{first} has {stroke}, and in {second} {found}").fix(
            "Train for the stroke of the hand that made the touches: state it as stroke in probe.toml, or let `palpate probe \
             fit` estimate it, from these touches too.",
        ))
    }
}

/// The time that the stroke of a probe takes, and the latest recorded contact that it explains, in microseconds; none without a
/// stroke.
pub(crate) fn stroke_of(probe: &TrainedProbe) -> Option<[f64; 2]> {
    let time = |length: f32| f64::from(length) / f64::from(probe.speed) * 1e6;
    let window = time(probe.stroke?);
    Some([window, window + probe.stroke_tolerance.map_or(hand::TOLERANCE * window, time)])
}

/// The scene of a cone in hundredths of a degree, in words.
fn scene(cone: u16) -> String {
    let scene = if cone == 0 { Surroundings::Floating } else { Surroundings::Table { cone: f64::from(cone) / 100.0 } };
    scene.to_string()
}

/// Contacts that end before this share of the longest time between them were ended by a stroke.
const ENDED: f64 = 0.75;
/// This share for a stated stroke, at which contacts end at once in any case.
const STATED: f64 = 1.2;

/// The latest contacts of touches.
struct Latest {
    /// The latest of all after the first contact of its touch, in microseconds.
    micros: f64,
    /// Touches of two or more contacts, those that end in the last tenth of the time up to the latest, and in the tenth before.
    touches: usize,
    last: usize,
    before: usize,
}

impl Latest {
    fn of(dataset: &Dataset) -> Option<Self> {
        let spreads = || dataset.touches().map(|touch| f64::from(touch.spread())).filter(|spread| *spread > 0.0);
        let micros = spreads().max_by(f64::total_cmp)?;
        let between =
            |low: f64, high: f64| spreads().filter(|spread| (low * micros..high * micros).contains(spread)).count();
        Some(Self { micros, touches: spreads().count(), last: between(0.9, 1.1), before: between(0.8, 0.9) })
    }

    /// True if contacts do not become rare before they end: an object's shape makes them rare, a stroke does not.
    fn ends_at_once(&self) -> bool {
        self.last >= 20 && 100 * self.last >= self.touches && 2 * self.last >= self.before
    }
}

impl From<&touches::Origin> for StatedProbe {
    fn from(origin: &touches::Origin) -> Self {
        Self { probe: origin.probe, unit: origin.unit, length: origin.length, scene: origin.scene }
    }
}

/// A fingerprint is made of this many touches at most.
const FINGERPRINTED: usize = 16;

/// The objects whose touches in `dataset` a compiled model was trained on, if it states that: results on them say nothing
/// about others. One in 65,536 other objects is taken for one of these.
pub fn compiled_trained_on<'d>(compiled: &CompiledModel, dataset: &'d Dataset) -> Vec<&'d str> {
    let (model, names) = (compiled.model(), compiled.names());
    let Some(stated) = model.fingerprints() else { return Vec::new() };
    let own = fingerprints(dataset);
    let same = |name: &&str| {
        let object = names.iter().position(|own| own == name).and_then(|object| stated.object(object));
        object.is_some() && object == own.get(*name).map(|&fingerprint| short(fingerprint))
    };
    dataset.objects.iter().map(|object| object.name.as_str()).filter(same).collect()
}

/// The part of a fingerprint that a compiled model states; never 0, which stands for none.
fn short(fingerprint: u64) -> u16 {
    // The upper bits, all that are left.
    u16::try_from(fingerprint >> 48).unwrap_or_default().max(1)
}

/// The touches that an ensemble states to be trained on.
pub(super) fn trained(origin: &Provenance) -> Result<Option<Trained>> {
    let expected = "a JSON object of counted, patterns, needs_pose and largest_spread";
    parsed(&origin.attributes, TouchOrigin::TRAINED, expected)
}

/// An attribute, read as JSON.
fn parsed<T: for<'t> Deserialize<'t>>(
    attributes: &BTreeMap<String, String>,
    name: &str,
    expected: &str,
) -> Result<Option<T>> {
    let Some(text) = attributes.get(name) else { return Ok(None) };
    serde_json::from_str(text).map(Some).map_err(|error| wrong_attribute(name, expected, error))
}

/// An attribute that this crate did not write.
fn wrong_attribute(name: &str, expected: &str, detail: impl std::fmt::Display) -> Error {
    problem!("{name} is not {expected}: {detail}").fix("Correct the attribute, or remove it.")
}

/// A CRC-64 (XZ) of the contact times of each object's first touches.
fn fingerprints(dataset: &Dataset) -> BTreeMap<String, u64> {
    const CRC: crc::Crc<u64> = crc::Crc::<u64>::new(&crc::CRC_64_XZ);
    let fingerprint = |object: &crate::touches::ObjectTouches| {
        let mut digest = CRC.digest();
        for time in object.touches().iter().take(FINGERPRINTED).flat_map(|touch| touch.times()) {
            digest.update(&time.micros().unwrap_or(u32::MAX).to_le_bytes());
        }
        (object.name.clone(), digest.finalize())
    };
    dataset.objects.iter().map(fingerprint).collect()
}

#[cfg(all(test, feature = "train"))]
mod tests {
    use super::*;
    use crate::tests::synthetic;

    #[test]
    fn training_touches_are_known_again_and_others_are_not() {
        let trained = synthetic::dataset(&[100, 100, 100], 1);
        let origin = TouchOrigin::new(&trained, None);
        let known = |dataset: &Dataset| {
            fingerprints(dataset).iter().filter(|(name, own)| origin.touches.get(*name) == Some(*own)).count()
        };
        assert_eq!(known(&trained), 3);
        assert_eq!(known(&synthetic::dataset(&[30, 400, 100], 1)), 3, "of the same capture");
        assert_eq!(known(&synthetic::dataset(&[100, 100, 100], 2)), 0);
    }
}
