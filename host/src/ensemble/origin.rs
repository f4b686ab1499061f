//! Where the touches that an ensemble was trained on came from.

use super::nodes::Threshold;
use crate::error::{ProbeProblem, Result};
use crate::probe::approach::Probe;
use crate::touches::noise::Noise;
use crate::touches::{self, Captured, Dataset, short, tenth, unit};
use palpate_shared::format::{
    Counted, Length, PatternShares, Prediction, TrainedCapture, TrainedProbe, TrainedTouches,
};
use palpate_shared::{ContactPattern, Patterns};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Statements of an ensemble about its training touches. Empty for ensembles from elsewhere.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Origin {
    /// The probe that made them, where the data set states it.
    pub probe: Option<StatedProbe>,
    /// Kind of touches they were, and so which ones are evidence.
    pub trained: Option<Trained>,
    /// Noise added to them in training; none also where that is not known.
    pub noise: Option<Noise>,
    /// For each object, a fingerprint of the first of its touches.
    pub touches: BTreeMap<String, u64>,
    /// The capture that made them, where that is known.
    pub captured: Option<Captured>,
    /// The last object is a background: many other shapes, which stand for everything that the ensemble does not know.
    /// It is a rival of the others, and never named.
    pub background: bool,
    /// The file of another library that it was read from, if it was.
    pub imported: Option<Imported>,
}

/// Facts about an ensemble that another library trained.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Imported {
    /// The library and the kind of file, such as "LightGBM text".
    pub kind: String,
    /// The farthest that a margin can be from the library's own, since leaves and sums are f32 here and f64 there; 0
    /// where the library adds the same f32 values in the same order.
    pub rounding: f64,
    /// Notes for the user, each a sentence.
    pub notes: Vec<String>,
    /// Rule that turns margins into a class or a value, as the library's `predict` does it. Its scale makes the
    /// library's margins of what the trees add up to.
    pub prediction: Prediction,
    /// The least and the largest of the numbers that stand for a missing value, beside NaN.
    pub sentinel: Option<[f32; 2]>,
    /// For each node of each tree the threshold as the file has it, of no meaning for leaves; empty where all are the
    /// ensemble's own.
    pub thresholds: Vec<Vec<Threshold>>,
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
}

/// The probe that a model of unknown origin is for: the published one.
impl Default for StatedProbe {
    fn default() -> Self {
        Self { probe: Probe::default(), unit: Length::Tenth, length: 10.0 }
    }
}

impl StatedProbe {
    /// The probe that a data set states, if it states one.
    pub fn of(dataset: &Dataset) -> Option<Self> {
        dataset.origin.as_ref().map(Self::from)
    }

    /// Statements of a compiled model about it. Units are made tenths of the longest side, whatever side objects were
    /// scaled to.
    pub fn trained(&self) -> TrainedProbe {
        let scale = match self.unit {
            Length::Tenth => 10.0 / self.length,
            Length::Millimeter => 1.0,
        };
        let [radius, spacing, speed] =
            [self.probe.radius, self.probe.spacing, self.probe.speed].map(|number| (number * scale) as f32);
        TrainedProbe { radius, spacing, speed, length: self.unit }
    }

    /// Compares what two sides state, such as a data set and a model; `names` says who they are.
    ///
    /// # Errors
    /// [`ProbeProblem::Differs`] if radius, spacing, nominal speed or scale differ. The tilt is not compared: it is how
    /// approaches were drawn.
    pub fn compare(names: [&str; 2], [one, other]: [TrainedProbe; 2]) -> Result<(), ProbeProblem> {
        let differs = |a: f32, b: f32| (a - b).abs() > 1e-5 * a.abs().max(b.abs());
        let mut differences = Vec::new();
        if one.length != other.length {
            differences.push(format!("unit {:?} and {:?}", one.length.name(), other.length.name()));
        }
        let numbers = [
            ("radius", one.radius, other.radius),
            ("spacing", one.spacing, other.spacing),
            ("speed", one.speed, other.speed),
        ];
        let different = numbers.into_iter().filter(|(_, one, other)| differs(*one, *other));
        differences.extend(different.map(|(name, one, other)| format!("{name} {one} and {other}")));
        if differences.is_empty() {
            return Ok(());
        }
        let [first, second] = names.map(str::to_owned);
        Err(ProbeProblem::Differs { first, second, differences: differences.join(", ") })
    }
}

impl From<&touches::Origin> for StatedProbe {
    fn from(origin: &touches::Origin) -> Self {
        Self { probe: origin.probe, unit: origin.unit, length: origin.length }
    }
}

/// The touches that an ensemble was trained on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stated", into = "Stated")]
pub struct Trained {
    /// Patterns, the largest spread, and whether a pose is needed: what is evidence to every model made of the ensemble.
    pub touches: TrainedTouches,
    /// The share of each contact pattern among all approaches, in the order of the patterns' codes, each object weighted
    /// equally; `None` if the data set holds no approaches.
    pub shares: Option<[f64; 6]>,
}

impl Trained {
    /// Statement of the chip's model about [`Trained::shares`].
    pub fn pattern_shares(&self) -> Option<PatternShares> {
        // `as` saturates.
        self.shares.map(|shares| PatternShares(shares.map(|share| (share * 65_535.0).round() as u16)))
    }
}

/// [`Trained`] in files.
#[derive(Serialize, Deserialize)]
struct Stated {
    counted: String,
    patterns: Vec<String>,
    needs_pose: bool,
    largest_spread: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    shares: Option<[f64; 6]>,
}

impl From<Trained> for Stated {
    fn from(Trained { touches, shares }: Trained) -> Self {
        Self {
            counted: touches.counted.name().into(),
            patterns: touches.patterns.iter().map(|pattern| pattern.name().into()).collect(),
            needs_pose: touches.needs_pose,
            largest_spread: touches.largest_spread,
            shares,
        }
    }
}

impl TryFrom<Stated> for Trained {
    type Error = String;

    fn try_from(stated: Stated) -> Result<Self, String> {
        let counted = Counted::ALL.iter().copied().find(|counted| counted.name() == stated.counted);
        let counted = counted.ok_or_else(|| format!("{:?} is not full, contacts or all", stated.counted))?;
        let pattern = |name: &String| {
            let pattern = ContactPattern::ALL.into_iter().find(|pattern| pattern.name() == name);
            pattern.filter(|pattern| counted.patterns().contains(*pattern)).ok_or_else(|| format!("pattern {name:?}"))
        };
        let patterns = stated.patterns.iter().map(pattern).collect::<Result<Patterns, _>>()?;
        if patterns.is_empty() {
            return Err("no pattern".into());
        }
        if let Some(share) = stated.shares.into_iter().flatten().find(|share| !(0.0..=1.0).contains(share)) {
            return Err(format!("the share {share}"));
        }
        let Stated { needs_pose, largest_spread, shares, .. } = stated;
        Ok(Self { touches: TrainedTouches { patterns, counted, needs_pose, largest_spread }, shares })
    }
}

/// A fingerprint is made of this many touches at most.
const FINGERPRINTED: usize = 16;

impl Origin {
    /// The content of the section that says which touches they were, for a model of these objects; none where nothing is known.
    pub(crate) fn section(&self, objects: &[String]) -> Option<Vec<u8>> {
        let captured = self.captured.as_ref();
        let stated = |name: &String| {
            let captured = captured.and_then(|captured| captured.stated_of(name));
            captured.or_else(|| self.touches.get(name).map(|&fingerprint| short(fingerprint))).unwrap_or_default()
        };
        let stated: Vec<u16> = objects.iter().map(stated).collect();
        let (settings, samples) = captured.map_or((0, 0..u32::MAX), Captured::stated);
        let is_known = stated.iter().any(|&object| object != 0);
        is_known.then(|| {
            let head = TrainedCapture::head(settings, samples).into_iter();
            head.chain(stated.iter().flat_map(|object| object.to_le_bytes())).collect()
        })
    }

    /// Creates the origin from the data set, the probe that they were made with, and which of them were trained on.
    pub fn new(dataset: &Dataset, probe: Option<StatedProbe>, trained: Option<Trained>) -> Self {
        Self { probe, trained, touches: fingerprints(dataset), captured: Captured::of(dataset), ..Self::default() }
    }

    /// The objects whose touches in `dataset` are of the capture that made those of the training, or begin like those: the
    /// same touches, or more or fewer of them. What becomes of them elsewhere, such as noise, does not count. A part of a data
    /// set that was trained on counts as the whole.
    pub fn trained_on<'d>(&self, dataset: &'d Dataset) -> Vec<&'d str> {
        let own = fingerprints(dataset);
        let captured = self.captured.as_ref().zip(Captured::of(dataset));
        let shared: Vec<String> = captured
            .map_or_else(Vec::new, |(trained, tested)| trained.shared(&tested).into_iter().map(String::from).collect());
        let begins = |name: &&str| own.get(*name).is_some_and(|own| self.touches.get(*name) == Some(own));
        let same = |name: &&str| begins(name) || shared.iter().any(|shared| shared == name);
        dataset.objects.iter().map(|object| object.name.as_str()).filter(same).collect()
    }
}

/// The same for a compiled model of the objects `names`, as far as it states its training touches.
pub fn compiled_trained_on<'d>(stated: &TrainedCapture<'_>, names: &[String], dataset: &'d Dataset) -> Vec<&'d str> {
    let captured = Captured::of(dataset);
    let is_near = captured.as_ref().is_some_and(|captured| captured.is_near(stated));
    // A capture of another seed has other touches; what is not captured is identified by its first touches.
    let fingerprints = if captured.is_none() || stated.settings == 0 { fingerprints(dataset) } else { BTreeMap::new() };
    let same = |name: &&str| {
        let object = names.iter().position(|own| own == name).and_then(|object| stated.object(object));
        let is_captured = is_near && captured.as_ref().and_then(|captured| captured.stated_of(name)) == object;
        let begins = fingerprints.get(*name).map(|&fingerprint| short(fingerprint));
        object.is_some() && (is_captured || begins == object)
    };
    dataset.objects.iter().map(|object| object.name.as_str()).filter(same).collect()
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
    use crate::touches::synthetic;

    #[test]
    fn training_touches_are_known_again_and_others_are_not() {
        let trained = synthetic::dataset(&[100, 100, 100], 1);
        let origin = Origin::new(&trained, None, None);
        assert_eq!(origin.trained_on(&trained), ["object0", "object1", "object2"]);
        assert_eq!(origin.trained_on(&synthetic::dataset(&[30, 400, 100], 1)).len(), 3, "of the same capture");
        assert!(origin.trained_on(&synthetic::dataset(&[100, 100, 100], 2)).is_empty());
        assert!(Origin::default().trained_on(&trained).is_empty());
    }
}
