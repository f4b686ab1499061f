//! Search for the best probe: the spacing, radius and tilt, and the aim of approaches, that need the fewest approaches.
//!
//! The simulator touches the objects with every probe that is tried. A model is trained on these approaches and tested on
//! others, with the stopping rule set so that the share of wrong verdicts is the requested one; the figure is the mean
//! number of approaches. The search narrows down: first a coarse grid with a quarter of the approaches per object; then the
//! best of it and the points between them with half; then, with all of them, every spacing at the best radius, tilt and
//! aim, and a few strokes with the best probe: how far the hand goes on after the first contact.
//!
//! The figures compare probes and promise nothing: the stopping threshold is set, and the best probe chosen, on the touches
//! that are counted. The best of many looks somewhat better than it is.
//!
//! ```no_run
//! use palpate::mesh::builtin;
//! use palpate::tune::probe::{self, design};
//!
//! # fn main() -> palpate::Result<()> {
//! let objects = [builtin::one("bowl")?, builtin::one("mouse")?];
//! let design = design(&objects, &probe::Settings::default(), &())?;
//! println!("{}", design.toml());
//! # Ok(())
//! # }
//! ```

use crate::capture;
use crate::ensemble::train;
use crate::error::{Error, Result, TuneProblem};
use crate::evaluate::{Approaches, Candidate, Margins, SequentialSettings};
use crate::mesh::Object;
use crate::probe::approach::{Aim, Probe};
use crate::probe::noise::Noise;
use crate::probe::scene::Scene;
use crate::progress::{self, Progress};
use crate::touches::{Dataset, Origin};
use crate::with;
use palpate_shared::format::{Counted, Length};
use palpate_shared::{ContactPattern, Descriptor};
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::RangeInclusive;

/// Spacings of the coarse grid.
const SPACINGS: usize = 5;
/// Strokes that are tried without a range, in units, beside a hand that goes on past the object.
const USUAL_STROKES: [f64; 5] = [0.5, 1.0, 2.0, 3.0, 5.0];
/// Strokes of a range.
const STROKES: usize = 5;
/// The share of the coarse grid that goes on.
const KEPT: usize = 10;
/// A recognizer gives up after this many touches: later than any that is of use.
const MAX_TOUCHES: u32 = 100_000;
/// Halvings of the range of stopping thresholds.
const HALVINGS: usize = 12;
/// Logarithms of the odds between which the stopping threshold is searched.
const ODDS: [f64; 2] = [-16.0, -0.05];

/// Space of probes to search, and settings for measuring each.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Settings {
    /// Unit of lengths: units, a tenth of the object's longest side, or millimeters, where objects have their true
    /// sizes.
    pub unit: Length,
    /// Distances between neighboring fingers.
    pub spacing: RangeInclusive<f64>,
    /// Radii of the fingers.
    pub radius: RangeInclusive<f64>,
    /// Largest tilts of the row of fingers to either side, in degrees.
    pub tilt: RangeInclusive<f64>,
    /// Strokes of the hand: the best probe is searched with the longest, and every one is tried with it. None: it is searched
    /// for a hand that goes on past the object, and strokes of 0.5 to 5 units are tried with it.
    pub stroke: Option<RangeInclusive<f64>>,
    /// Aims that approaches may have, at least one.
    pub aims: Vec<Aim>,
    /// The probe's speed, per second.
    pub speed: f64,
    /// Probe that the best one is compared with: the published one or, where objects have their true sizes, its
    /// likeness.
    pub published: Probe,
    /// Standard deviation of the Gaussian noise of contact times, in microseconds, in training and testing.
    pub noise: f64,
    /// Features that a touch is turned into.
    pub descriptor: Descriptor,
    /// Approaches that are evidence.
    pub counted: Counted,
    /// The share of wrong verdicts that is asked for, above 0 and at most 0.25.
    pub error_rate: f64,
    /// Approaches per object to train on in the last round, and as many to test on; at least 100.
    pub approaches: u64,
    /// Sequences of approaches for each object.
    pub sequences: usize,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            unit: Length::Tenth,
            spacing: 0.5..=3.0,
            radius: 0.1..=0.3,
            tilt: 0.0..=20.0,
            stroke: None,
            aims: Aim::ALL.into(),
            speed: Probe::default().speed,
            published: Probe::default(),
            noise: 1_000.0,
            descriptor: Descriptor::Curvature,
            counted: Counted::Contacts,
            error_rate: 0.01,
            approaches: 8_000,
            sequences: 300,
            seed: 1,
        }
    }
}

impl Settings {
    /// The usual search at the objects' true sizes, in millimeters: ranges, speed and published probe are scaled so that a
    /// unit is a tenth of the longest side of the median object. None if the true size of an object is not known.
    pub fn at_true_size(objects: &[Object]) -> Option<Self> {
        let unit = median_length(objects)? / LENGTH;
        let Self { spacing, radius, published, .. } = Self::default();
        let scaled = |length: f64| hundredths(length * unit);
        let range = |range: RangeInclusive<f64>| scaled(*range.start())..=scaled(*range.end());
        let published = scaled_probe(&published, unit);
        let (spacing, radius, speed) = (range(spacing), range(radius), published.speed);
        Some(Self { unit: Length::Millimeter, spacing, radius, speed, published, ..Self::default() })
    }

    /// Refuses settings out of their ranges.
    fn check(&self) -> Result<()> {
        let stroke = self.stroke.as_ref().map(|stroke| ("stroke", stroke));
        let ranges = [("spacing", &self.spacing), ("radius", &self.radius), ("tilt", &self.tilt)];
        for (name, range) in ranges.into_iter().chain(stroke) {
            let [low, high] = [*range.start(), *range.end()];
            if !(low.is_finite() && high.is_finite() && low <= high) {
                return Err(Error::setting(name, format!("{low}..{high}"), "the smaller number first, as in 0.5..3"));
            }
        }
        if !(self.error_rate > 0.0 && self.error_rate <= 0.25) {
            return Err(Error::setting("error_rate", self.error_rate, "a number above 0 and at most 0.25"));
        }
        if !(self.noise.is_finite() && self.noise >= 0.0) {
            return Err(Error::setting("noise", self.noise, "a number of microseconds of at least 0"));
        }
        if self.approaches < 100 {
            return Err(Error::setting("approaches", self.approaches, "100 or more"));
        }
        if self.sequences == 0 {
            return Err(Error::setting("sequences", 0, "1 or more"));
        }
        if self.aims.is_empty() {
            return Err(Error::setting("aims", "empty", "one or more of box, middle and mass"));
        }
        let corners = [(self.spacing.start(), self.radius.start()), (self.spacing.end(), self.radius.end())];
        for (&spacing, &radius) in corners {
            for tilt in [*self.tilt.start(), *self.tilt.end()] {
                let stroke = self.stroke.as_ref().map(|stroke| *stroke.start());
                let probe = with!(Probe::default(), radius, spacing, speed = self.speed, tilt, stroke);
                probe.check(if self.unit == Length::Tenth { LENGTH } else { 1.0 })?;
            }
        }
        Ok(())
    }
}

/// The longest side of every object, in units.
const LENGTH: f64 = 10.0;

/// The longest side of the median object in millimeters, by its first instance.
pub fn median_length(objects: &[Object]) -> Option<f64> {
    let length = |object: &Object| object.instances().next().and_then(|instance| object.true_length(instance));
    let mut lengths: Vec<f64> = objects.iter().map(length).collect::<Option<_>>()?;
    lengths.sort_by(f64::total_cmp);
    lengths.get(lengths.len() / 2).copied()
}

/// The probe scaled so that a unit becomes `unit`; lengths are rounded to hundredths.
pub fn scaled_probe(probe: &Probe, unit: f64) -> Probe {
    let scaled = |length: f64| hundredths(length * unit);
    let Probe { radius, spacing, speed, tilt, stroke, travel, stroke_tolerance, .. } = *probe;
    let [radius, spacing, speed] = [radius, spacing, speed].map(scaled);
    let [stroke, travel, stroke_tolerance] = [stroke, travel, stroke_tolerance].map(|length| length.map(scaled));
    // A length of nothing is none.
    let stroke_tolerance = stroke_tolerance.filter(|length| *length > 0.0);
    with!(Probe::default(), radius, spacing, speed, tilt, stroke, travel, stroke_tolerance)
}

/// A probe that was tried, and its results.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trial {
    /// The probe's measures.
    #[serde(flatten)]
    pub probe: Probe,
    /// Aim of its approaches.
    pub aim: Aim,
    /// Approaches per object that a model was trained on; it was tested on as many others.
    pub trained_on: u64,
    /// Approaches to a verdict on average at the error rate asked for, or at the least that was reached.
    pub approaches: f64,
    /// Standard error of [`Trial::approaches`], from the drawing of sequences.
    pub approaches_standard_error: f64,
    /// True if no more verdicts than asked for were wrong, and no more than that missing after all test approaches.
    pub reached: bool,
    /// The share of wrong verdicts.
    pub error: f64,
    /// The share of sequences that used up the test approaches without a verdict.
    pub undecided: f64,
    /// The posterior at which the recognizer stopped is 1 minus this.
    pub threshold: f64,
    /// Approaches to a verdict on average, for each object.
    pub per_object: BTreeMap<String, f64>,
    /// The share of each contact pattern among the approaches, each object weighted equally.
    pub patterns: BTreeMap<&'static str, f64>,
}

impl Trial {
    /// Rank of a probe: first, reaching the error rate at all; then fewer approaches.
    fn rank(&self) -> (bool, f64) {
        if self.reached { (false, self.approaches) } else { (true, self.error + self.undecided) }
    }
}

/// The outcome of a search.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Design {
    /// The best probe.
    pub best: Trial,
    /// The published probe or its likeness, measured in the same way.
    pub published: Trial,
    /// The trade-off: probes of every spacing with the best radius, tilt and aim, by spacing; the best is one of them.
    pub by_spacing: Vec<Trial>,
    /// The best probe with hands of other strokes, the longest last: the best itself.
    pub by_stroke: Vec<Trial>,
    /// All probes tried in the rounds before, the best of each round first.
    pub rounds: Vec<Vec<Trial>>,
    /// Unit of lengths.
    #[serde(with = "crate::probe::unit")]
    pub unit: Length,
    /// The error rate that was asked for.
    pub error_rate: f64,
    /// Standard deviation of the noise of contact times that was assumed, in microseconds.
    pub noise: f64,
    /// Features that a touch was turned into.
    pub descriptor: &'static str,
    /// Approaches that were evidence.
    pub counted: &'static str,
}

impl Design {
    /// The best probe as the text of a `probe.toml`.
    pub fn toml(&self) -> String {
        let Trial { probe, aim, approaches, .. } = &self.best;
        let verdict = if self.best.reached { "" } else { "NOT REACHED: " };
        let unit = match self.unit {
            Length::Tenth => "# A unit is a tenth of the object's longest side.\nunit = \"unit\"\n",
            Length::Millimeter => "unit = \"mm\"\n",
        };
        format!(
            "# Found by `palpate probe design`: {verdict}{approaches:.1} approaches to {} % errors,\n\
             # aiming at: {} (`palpate capture --aim {}`). Assumed: noise of {} ms on contact times.\n\
             {unit}radius = {:?}\nspacing = {:?}\nspeed = {:?}\ntilt = {:?}\n{}",
            100.0 * self.error_rate,
            aim.name(),
            aim.name(),
            self.noise / 1e3,
            probe.radius,
            probe.spacing,
            probe.speed,
            probe.tilt,
            probe.stroke.map_or_else(String::new, |stroke| format!("stroke = {stroke:?}\n")),
        )
    }
}

/// Searches for the probe that needs the fewest approaches on these objects. The same objects and settings give the same
/// design on any number of threads. Progress is counted in probes tried.
///
/// # Errors
/// [`Setting`](crate::error::Setting) for a setting out of its range; [`TuneProblem::FewObjects`] for
/// fewer than two objects; an object that cannot be touched or whose true size is not known, by its name; as [`train::train`]; [`Error::Cancelled`] if
/// `progress` cancels it.
pub fn design(objects: &[Object], settings: &Settings, progress: &dyn Progress) -> Result<Design> {
    settings.check()?;
    if objects.len() < 2 {
        return Err(TuneProblem::FewObjects { objects: objects.len() }.into());
    }
    let mut sorted: Vec<&Object> = objects.iter().collect();
    sorted.sort_by(|a, b| a.name.cmp(&b.name));
    let origin = Origin { length: LENGTH, unit: settings.unit, ..Origin::default() };
    let scenes = capture::scenes(&sorted, &origin, &Quiet(progress))?;
    let names = sorted.iter().map(|object| object.name.clone());
    let search = Search { objects: names.zip(scenes).collect(), settings, progress };
    let coarse = search.coarse();
    // The second round has the kept ones, and at most two neighbors in each of three directions; the third the spacings.
    progress.begin("trying probes", Some((coarse.len() + 2 * KEPT + SPACINGS + STROKES) as u64));
    let first = search.try_all(coarse, settings.approaches / 4)?;
    let second = search.try_all(search.finer(&first), settings.approaches / 2)?;
    let best = &second[0];
    let mut spacings = steps(&settings.spacing, SPACINGS);
    let nearest = neighbors(&spacings, best.probe.spacing);
    spacings.extend(nearest);
    spacings.push(best.probe.spacing);
    spacings.sort_by(f64::total_cmp);
    spacings.dedup();
    let line = spacings.into_iter().map(|spacing| (with!(best.probe, spacing), best.aim)).collect();
    let mut by_spacing = search.try_all(line, settings.approaches)?;
    let best = by_spacing[0].clone();
    by_spacing.sort_by(|a, b| a.probe.spacing.total_cmp(&b.probe.spacing));
    let by_stroke = search.by_stroke(&best)?;
    let published = with!(settings.published, speed = settings.speed, stroke = search.stroke());
    let published = search.attempt(published, Aim::Box, settings.approaches)?;
    Ok(Design {
        best,
        published,
        by_spacing,
        by_stroke,
        rounds: vec![first, second],
        unit: settings.unit,
        error_rate: settings.error_rate,
        noise: settings.noise,
        descriptor: settings.descriptor.name(),
        counted: settings.counted.name(),
    })
}

struct Search<'a> {
    /// Names, and the scenes of the instances.
    objects: Vec<(String, Vec<Scene>)>,
    settings: &'a Settings,
    progress: &'a dyn Progress,
}

/// A probe, and where it aims.
type Plan = (Probe, Aim);

impl Search<'_> {
    /// Every combination of a few spacings, the ends of the other ranges, and the aims.
    fn coarse(&self) -> Vec<Plan> {
        let settings = self.settings;
        let mut plans = Vec::new();
        for spacing in steps(&settings.spacing, SPACINGS) {
            for radius in steps(&settings.radius, 2) {
                for tilt in steps(&settings.tilt, 2) {
                    let stroke = self.stroke();
                    let probe = with!(Probe::default(), radius, spacing, speed = settings.speed, tilt, stroke);
                    plans.extend(settings.aims.iter().map(|&aim| (probe, aim)));
                }
            }
        }
        plans
    }

    /// The stroke with which the best probe is searched: the longest.
    fn stroke(&self) -> Option<f64> {
        self.settings.stroke.as_ref().map(|stroke| *stroke.end())
    }

    /// The best probe with shorter strokes, and the best itself.
    fn by_stroke(&self, best: &Trial) -> Result<Vec<Trial>> {
        let unit = self.settings.published.spacing / Probe::default().spacing;
        let mut strokes = match &self.settings.stroke {
            Some(range) => steps(range, STROKES),
            None => USUAL_STROKES.map(|stroke| hundredths(stroke * unit)).into(),
        };
        strokes.retain(|stroke| Some(*stroke) != best.probe.stroke);
        let with = |stroke: &f64| (with!(best.probe, stroke = Some(*stroke)), best.aim);
        let mut trials = self.try_all(strokes.iter().map(with).collect(), self.settings.approaches)?;
        trials.sort_by(|a, b| {
            a.probe.stroke.unwrap_or(f64::INFINITY).total_cmp(&b.probe.stroke.unwrap_or(f64::INFINITY))
        });
        trials.push(best.clone());
        Ok(trials)
    }

    /// The best of a round, and what lies between the best and its neighbors.
    fn finer(&self, ranked: &[Trial]) -> Vec<Plan> {
        let best = &ranked[0];
        let Probe { spacing, radius, tilt, .. } = best.probe;
        let spacings = neighbors(&steps(&self.settings.spacing, SPACINGS), spacing);
        let radii = neighbors(&steps(&self.settings.radius, 2), radius);
        let tilts = neighbors(&steps(&self.settings.tilt, 2), tilt);
        let kept = ranked.iter().take(KEPT.min(ranked.len().div_ceil(2))).map(|trial| (trial.probe, trial.aim));
        kept.chain(spacings.into_iter().map(|spacing| (with!(best.probe, spacing), best.aim)))
            .chain(radii.into_iter().map(|radius| (with!(best.probe, radius), best.aim)))
            .chain(tilts.into_iter().map(|tilt| (with!(best.probe, tilt), best.aim)))
            .collect()
    }

    /// Tries probes, and ranks them, the best first.
    fn try_all(&self, plans: Vec<Plan>, approaches: u64) -> Result<Vec<Trial>> {
        let mut trials = Vec::with_capacity(plans.len());
        for (probe, aim) in plans {
            trials.push(self.attempt(probe, aim, approaches)?);
            progress::advance(self.progress, 1)?;
        }
        trials.sort_by(|a: &Trial, b| {
            let (a, b) = (a.rank(), b.rank());
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        Ok(trials)
    }

    /// Trains on the first approaches with a probe, and measures on the next.
    fn attempt(&self, probe: Probe, aim: Aim, approaches: u64) -> Result<Trial> {
        let settings = self.settings;
        let [data, test] = [0, approaches].map(|start| self.touch(probe, aim, start..start + approaches));
        let (data, test) = (data?, test?);
        let recipe = train::Settings {
            descriptor: settings.descriptor,
            counted: Some(settings.counted),
            rounds: 25,
            depth: 5,
            bins: 64,
            leaf_bits: None,
            ..train::Settings::compact()
        };
        let ensemble = train::train(&data, &recipe, &Quiet(self.progress))?;
        let margins = Margins::new(Candidate::Full(&ensemble), &test)?;
        let (threshold, stopped) = self.at_the_rate(&margins)?;
        let sequential = stopped.sequential;
        Ok(Trial {
            probe,
            aim,
            trained_on: approaches,
            approaches: sequential.mean().value,
            approaches_standard_error: sequential.mean().standard_error,
            reached: sequential.error.max(sequential.undecided) <= settings.error_rate,
            error: sequential.error,
            undecided: sequential.undecided,
            threshold,
            per_object: sequential.per_object,
            patterns: ContactPattern::ALL.iter().map(|pattern| pattern.name()).zip(margins.shares).collect(),
        })
    }

    /// Approaches to every object in memory, with noise.
    fn touch(&self, probe: Probe, aim: Aim, samples: std::ops::Range<u64>) -> Result<Dataset> {
        let Settings { seed, noise, unit, .. } = *self.settings;
        let touches = samples.end - samples.start;
        let origin = Origin {
            touches,
            seed,
            length: LENGTH,
            unit,
            probe,
            aim,
            pose: true,
            approaches: true,
            ..Origin::default()
        };
        let touch = |(name, scenes): &(String, Vec<Scene>)| {
            progress::check(self.progress)?;
            let touches = capture::touches(scenes, name, &origin, samples.clone())?;
            // Other noise for other samples.
            Ok(touches.noisy(&Noise::gaussian(noise), seed ^ samples.start, 1))
        };
        let objects = self.objects.iter().map(touch).collect::<Result<_>>()?;
        Ok(Dataset { origin: Some(origin), ..Dataset::new(objects) })
    }

    /// The loosest stopping threshold with at most the error rate asked for in wrong verdicts, and what it achieves; the
    /// strictest, if none has.
    fn at_the_rate(&self, margins: &Margins<'_>) -> Result<(f64, Approaches)> {
        let Settings { error_rate, sequences, seed, .. } = *self.settings;
        let stopped = |log_odds: f64| {
            progress::check(self.progress)?;
            let threshold = 1.0 / (1.0 + (-log_odds).exp());
            let settings =
                SequentialSettings { error_rate: Some(threshold), max_touches: Some(MAX_TOUCHES), sequences, seed };
            Ok::<_, Error>((threshold, margins.approaches(&[], &settings)?))
        };
        let [mut strict, mut loose] = ODDS;
        let mut best = None;
        for _ in 0..HALVINGS {
            let middle = (strict + loose) / 2.0;
            let found = stopped(middle)?;
            if found.1.sequential.error <= error_rate {
                (strict, best) = (middle, Some(found));
            } else {
                loose = middle;
            }
        }
        best.map_or_else(|| stopped(strict), Ok)
    }
}

/// Up to `count` numbers from end to end, in equal ratios where the range is above 0, rounded to hundredths.
fn steps(range: &RangeInclusive<f64>, count: usize) -> Vec<f64> {
    let [low, high] = [*range.start(), *range.end()];
    let step = |index: usize| {
        let part = index as f64 / (count - 1) as f64;
        match index {
            0 => low,
            last if last == count - 1 => high,
            _ if low > 0.0 => hundredths(low * libm::pow(high / low, part)).clamp(low, high),
            _ => hundredths(low + (high - low) * part).clamp(low, high),
        }
    };
    let mut steps: Vec<f64> = (0..count).map(step).collect();
    steps.dedup();
    steps
}

/// The numbers halfway between one of `steps` and those beside it.
fn neighbors(steps: &[f64], number: f64) -> Vec<f64> {
    let halfway = |pair: &[f64]| {
        let middle = if pair[0] > 0.0 { (pair[0] * pair[1]).sqrt() } else { (pair[0] + pair[1]) / 2.0 };
        hundredths(middle).clamp(pair[0], pair[1])
    };
    let beside = steps.windows(2).filter(|pair| pair.contains(&number));
    beside.map(halfway).filter(|middle| !steps.contains(middle)).collect()
}

fn hundredths(number: f64) -> f64 {
    (number * 100.0).round() / 100.0
}

/// Passes on cancellation, and no stages of its own.
struct Quiet<'a>(&'a dyn Progress);

impl Progress for Quiet<'_> {
    fn is_cancelled(&self) -> bool {
        self.0.is_cancelled()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Setting;
    use crate::mesh::Mesh;

    /// A globe and a disc: a row of fingers sees how much they bend, if it is wide enough for that to stand out of noise.
    fn objects() -> Vec<Object> {
        [("globe", 1.0), ("disc", 0.1)]
            .map(|(name, height)| Object::new(name, Mesh::globe(12).stretched([1.0, 1.0, height])))
            .into()
    }

    fn settings() -> Settings {
        Settings {
            spacing: 0.05..=1.5,
            radius: 0.15..=0.15,
            tilt: 10.0..=10.0,
            aims: vec![Aim::Box],
            approaches: 800,
            sequences: 100,
            error_rate: 0.05,
            noise: 10_000.0,
            ..Settings::default()
        }
    }

    #[test]
    fn fingers_that_are_nearly_at_one_place_lose_against_a_wider_row() {
        let design = design(&objects(), &settings(), &()).unwrap();
        let narrow = &design.by_spacing[0];
        assert_eq!(narrow.probe.spacing, 0.05);
        assert!(design.best.reached && design.best.error <= 0.05);
        assert!(design.best.probe.spacing > 0.3, "{:?}", design.best);
        assert!(!narrow.reached || narrow.approaches > 1.5 * design.best.approaches, "{narrow:?} {:?}", design.best);
        assert!(design.by_spacing.contains(&design.best));
        assert!(design.by_spacing.is_sorted_by(|a, b| a.probe.spacing < b.probe.spacing));
        assert!((design.best.patterns.values().sum::<f64>() - 1.0).abs() < 1e-9);
        assert_eq!(design.best.per_object.keys().collect::<Vec<_>>(), ["disc", "globe"]);
    }

    #[test]
    fn a_shorter_stroke_loses_contacts_and_the_longest_is_the_best_probes() {
        let objects = objects();
        let found = design(&objects, &Settings { spacing: 1.0..=1.0, ..settings() }, &()).unwrap();
        let strokes: Vec<Option<f64>> = found.by_stroke.iter().map(|trial| trial.probe.stroke).collect();
        assert_eq!(strokes, [Some(0.5), Some(1.0), Some(2.0), Some(3.0), Some(5.0), None]);
        assert_eq!(found.by_stroke.last(), Some(&found.best));
        let full = |trial: &Trial| trial.patterns["all"];
        assert!(found.by_stroke.is_sorted_by(|a, b| full(a) <= full(b)), "{:?}", found.by_stroke);
        assert!(full(&found.by_stroke[0]) < 0.9 * full(&found.best), "{:?}", found.by_stroke);
        assert!(!found.toml().contains("stroke"));
        let settings = Settings { spacing: 1.0..=1.0, stroke: Some(0.5..=2.0), approaches: 200, ..settings() };
        let short = design(&objects, &settings, &()).unwrap();
        assert_eq!((short.best.probe.stroke, short.published.probe.stroke), (Some(2.0), Some(2.0)));
        assert_eq!(short.by_stroke.len(), STROKES);
        assert!(short.toml().ends_with("stroke = 2.0\n"), "{}", short.toml());
    }

    #[test]
    fn at_true_size_the_search_is_in_millimeters_and_takes_objects_of_known_size_only() {
        let mut objects = objects();
        assert!(Settings::at_true_size(&objects).is_none());
        // A globe is 20 of its units wide.
        objects.iter_mut().for_each(|object| object.millimeters = Some(5.0));
        let unit = median_length(&objects).unwrap() / LENGTH;
        let usual = Settings::at_true_size(&objects).unwrap();
        assert_eq!(usual.published.spacing, hundredths(1.5 * unit));
        assert_eq!(usual.spacing, hundredths(0.5 * unit)..=hundredths(3.0 * unit));
        let Settings { radius, tilt, aims, sequences, error_rate, .. } = settings();
        let radius = radius.start() * unit..=radius.end() * unit;
        let settings = Settings { radius, tilt, aims, sequences, error_rate, approaches: 400, ..usual };
        let found = design(&objects, &settings, &()).unwrap();
        assert!(found.toml().contains("unit = \"mm\"\nradius = "), "{}", found.toml());
        assert!(found.best.probe.spacing >= 0.5 * unit - 0.01, "{:?}", found.best);
        objects[0].millimeters = None;
        let error = design(&objects, &settings, &()).unwrap_err().to_string();
        assert!(error.starts_with("globe: "), "{error}");
    }

    #[test]
    fn the_same_seed_gives_the_same_design_on_any_number_of_threads() {
        let settings = Settings { spacing: 0.5..=1.0, approaches: 200, sequences: 30, ..settings() };
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| design(&objects(), &settings, &()).unwrap())
        };
        let one = with(1);
        assert_eq!(one, with(3));
        assert_eq!(one.toml(), with(2).toml());
        let other = Settings { seed: 2, ..settings.clone() };
        assert_ne!(design(&objects(), &other, &()).unwrap(), one);
    }

    #[test]
    fn steps_go_from_end_to_end_and_neighbors_lie_between_them() {
        assert_eq!(steps(&(0.5..=3.0), 5), [0.5, 0.78, 1.22, 1.92, 3.0]);
        assert_eq!(steps(&(0.0..=20.0), 2), [0.0, 20.0]);
        assert_eq!(steps(&(0.15..=0.15), 5), [0.15]);
        assert_eq!(neighbors(&[0.5, 1.0, 2.0], 1.0), [0.71, 1.41]);
        assert_eq!(neighbors(&[0.0, 20.0], 20.0), [10.0]);
        assert_eq!(neighbors(&[0.15], 0.15), [0.0; 0]);
    }

    #[test]
    fn settings_out_of_range_are_refused_by_name() {
        let base = settings();
        let cases = [
            ("spacing", Settings { spacing: RangeInclusive::new(2.0, 1.0), ..base.clone() }),
            ("radius", Settings { radius: 0.0..=1.0, ..base.clone() }),
            ("tilt", Settings { tilt: 0.0..=90.0, ..base.clone() }),
            ("speed", Settings { speed: 0.0, ..base.clone() }),
            ("stroke", Settings { stroke: Some(0.0..=3.0), ..base.clone() }),
            ("noise", Settings { noise: f64::NAN, ..base.clone() }),
            ("error_rate", Settings { error_rate: 0.0, ..base.clone() }),
            ("approaches", Settings { approaches: 99, ..base.clone() }),
            ("sequences", Settings { sequences: 0, ..base.clone() }),
            ("aims", Settings { aims: Vec::new(), ..base }),
        ];
        for (wrong, settings) in cases {
            let error = design(&objects(), &settings, &()).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(matches!(error.problem::<Setting>(), Some(Setting { name, .. }) if *name == wrong), "{error}");
        }
        let error = design(&objects()[..1], &settings(), &()).unwrap_err();
        assert_eq!(error.problem(), Some(&TuneProblem::FewObjects { objects: 1 }));
    }
}
