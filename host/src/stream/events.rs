//! Verdicts that go on: events in recordings without stated ends, and a promise about false verdicts per hour.
//!
//! A recording is a stream of rows, each with a class. A run of rows with one class other than the background is an event. The
//! chip gives a verdict where it becomes sure of another class, and then none for a hold-off ([`Ongoing`]). A verdict is right if it
//! is the first of an event of its class, from its onset to a grace after its end; otherwise it is false or repeated.
//!
//! The loss of a recording is its false and repeated verdicts less the promised rate times its hours. The promise is that its
//! expectation is not above 0: in the long run, independent recordings have at most that rate of false verdicts. It is
//! tested by betting (Waudby-Smith and Ramdas, *Estimating means of bounded random variables by betting*, 2024). Within a
//! hold-off there is one verdict at most, so that a recording has at most `most` of them; with a fraction up to 1 / `most` no
//! factor 1 − fraction · loss is below 0. Recordings count up to the length of the longest one that was learned from. Thresholds
//! are walked over from strict to loose, and the last one before the first failure is kept: fixed-sequence testing. Nothing of a
//! tested recording decides on the evidence, the memory, the fraction, the length or the order of the thresholds.

use super::Rows;
use super::shape::{STRICTEST, Table};
use crate::calibrate::{margin_of, odds_of};
use crate::compile::{self, Restated, restate};
use crate::error::{CalibrateProblem, Error, Result, RowsProblem};
use crate::evaluate::Finding;
use crate::evaluate::promise::BY_CHANCE;
use crate::evidence::chip;
use crate::progress::Progress;
use crate::random::{self, Purpose};
#[cfg(feature = "train")]
use crate::strangers;
use palpate_onboard::{Model, Ongoing, Stopping};
use palpate_shared::format::{Events, Tag};
use palpate_trees::rows::{RowSequence, Sequences};
use rand::seq::SliceRandom;
use rayon::prelude::*;
use serde::Serialize;

/// One recording in this many is for learning.
const LEARNED: usize = 4;
/// Memories that are tried, in nats.
const MEMORIES: [f64; 6] = [3.0, 5.0, 8.0, 12.0, 18.0, 27.0];
/// Number of thresholds, evenly spaced by their logarithms.
const STEPS: u32 = 200;
/// The loosest threshold, in nats.
const LOOSEST: f64 = 0.1;
/// A table of evidence is kept if it finds this share of an event more, or finds it as much earlier.
const GAIN: f64 = 0.01;
/// Fractions that are tried.
const FRACTIONS: u32 = 20;
/// Largest number of rows of a majority or a debouncing.
const MOST_ROWS: usize = 500;

/// Settings of a promise about events.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct EventSettings {
    /// The class between events, a position in the model's; `None` if every row is of an event.
    pub background: Option<usize>,
    /// Rows in a second.
    pub rows_per_second: f64,
    /// False or repeated verdicts per hour.
    pub false_per_hour: f64,
    /// The probability that the rate is kept.
    pub confidence: f64,
    /// Least time from a verdict to the next, in seconds.
    pub hold_off: f64,
    /// Time after the end of an event in which its verdict still counts, in seconds.
    pub grace: f64,
    /// Seed that chooses the recordings to learn from.
    pub seed: u64,
}

impl Default for EventSettings {
    fn default() -> Self {
        Self {
            background: None,
            rows_per_second: 1.0,
            false_per_hour: 1.0,
            confidence: 0.95,
            hold_off: 2.0,
            grace: 1.0,
            seed: 1,
        }
    }
}

impl EventSettings {
    fn check(&self) -> Result<()> {
        check_range("rows_per_second", self.rows_per_second, f64::MIN_POSITIVE, 1e6)?;
        check_range("false_per_hour", self.false_per_hour, f64::MIN_POSITIVE, 1e6)?;
        check_range("hold_off", self.hold_off, f64::MIN_POSITIVE, 86_400.0)?;
        check_range("grace", self.grace, 0.0, 86_400.0)?;
        if self.confidence > 0.0 && self.confidence < 1.0 {
            return Ok(());
        }
        Err(Error::setting("confidence", self.confidence, "above 0 and below 1"))
    }

    /// Section that states them, for recordings of up to this many rows.
    fn stated(&self, longest: usize) -> Events {
        let rows = |seconds: f64| (seconds * self.rows_per_second).round().min(f64::from(u32::MAX)) as u32;
        Events {
            background: self.background.and_then(|class| u8::try_from(class).ok()),
            hold_off: rows(self.hold_off).max(1),
            memory: 1,
            rows_per_hour: (self.rows_per_second * 3600.0) as f32,
            per_hour: self.false_per_hour as f32,
            confidence: self.confidence as f32,
            grace: rows(self.grace),
            longest: u32::try_from(longest).unwrap_or(u32::MAX),
        }
    }
}

/// Refuses a number outside of its range.
fn check_range(name: &'static str, value: f64, least: f64, most: f64) -> Result<()> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    let least = if least > 0.0 { "above 0".into() } else { format!("at least {least}") };
    Err(Error::setting(name, value, format!("{least} and at most {most}")))
}

/// Verdicts on recordings, compared with their events.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct EventCounts {
    /// Recordings.
    pub recordings: usize,
    /// Hours of all recordings.
    pub hours: f64,
    /// Events.
    pub events: usize,
    /// Events that got their verdict.
    pub named: usize,
    /// Verdicts that no event of their class explains.
    #[serde(rename = "false")]
    pub wrong: usize,
    /// Further verdicts of an event that had one.
    pub repeated: usize,
    /// False and repeated verdicts per hour.
    pub false_per_hour: f64,
    /// Time from the onset of an event to its verdict, on average, in seconds.
    pub mean_delay: f64,
    /// The delay that half of the verdicts keep.
    pub median_delay: f64,
}

/// A calibrated model of events.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EventsCalibrated {
    /// The model's bytes.
    #[serde(skip)]
    pub model: Vec<u8>,
    /// Promised false or repeated verdicts per hour.
    pub promised: f64,
    /// The probability that the promise is kept.
    pub confidence: f64,
    /// Recordings that were learned from.
    pub learned: usize,
    /// Seconds of the longest recording, up to which the promise holds.
    pub longest: f64,
    /// Evidence by which the leader has to lead, in nats.
    pub threshold: f64,
    /// Most evidence by which a class can be behind, in nats.
    pub memory: f64,
    /// True if evidence comes from a table of margins.
    pub row_evidence: bool,
    /// Verdicts on the recordings that were tested.
    #[serde(flatten)]
    pub counts: EventCounts,
}

/// A rule over the classes of single rows, and its verdicts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RowRule {
    /// Rows that it looks at.
    pub rows: usize,
    /// Its verdicts.
    #[serde(flatten)]
    pub counts: EventCounts,
}

/// Results on recordings of events; as JSON, `palpate evaluate --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EventsEvaluated {
    /// The chip's verdicts.
    #[serde(flatten)]
    pub counts: EventCounts,
    /// Promised false or repeated verdicts per hour; `None` without a promise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub promised: Option<f64>,
    /// Test of the promise, by the standard error over recordings.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub finding: Option<Finding>,
    /// Recordings that are longer than the promise covers.
    pub too_long: usize,
    /// The shortest majority of rows that has as few false verdicts, with the same hold-off.
    pub majority: Option<RowRule>,
    /// The least number of equal rows in succession that has as few.
    pub debounced: Option<RowRule>,
}

/// A row's leader, and the weights of the others.
type Led = (u8, u64);

/// The class that a rule says after each row, and whether it is sure.
type Said = Vec<(u8, bool)>;

/// Verdicts on one recording.
#[derive(Clone, Debug, Default)]
struct Tallied {
    rows: usize,
    events: usize,
    wrong: usize,
    repeated: usize,
    /// For each event with a verdict, the rows up to it, and the rows in which a verdict counts.
    delays: Vec<(usize, usize)>,
}

impl Tallied {
    /// Compares verdicts, as rows and classes, with the runs of a recording.
    fn new(runs: &[RowSequence], events: &Events, verdicts: impl Iterator<Item = (usize, usize)>) -> Self {
        let is_event = |run: &&RowSequence| events.background.map(usize::from) != Some(run.class);
        let mut all: Vec<(&RowSequence, bool)> = runs.iter().filter(is_event).map(|run| (run, false)).collect();
        let rows = runs.iter().map(|run| run.rows.len()).sum();
        let mut tallied = Self { rows, events: all.len(), ..Self::default() };
        let grace = events.grace as usize;
        for (row, class) in verdicts {
            let counts = |run: &RowSequence| run.class == class && row >= run.rows.start && row < run.rows.end + grace;
            let has_any = all.iter().any(|(run, _)| counts(run));
            match all.iter_mut().find(|(run, has_verdict)| !has_verdict && counts(run)) {
                Some((run, has_verdict)) => {
                    *has_verdict = true;
                    tallied.delays.push((row + 1 - run.rows.start, run.rows.len() + grace));
                }
                None if has_any => tallied.repeated += 1,
                None => tallied.wrong += 1,
            }
        }
        tallied
    }

    /// False and repeated verdicts less those that the rate allows.
    fn loss(&self, events: &Events) -> f64 {
        let hours = self.rows as f64 / f64::from(events.rows_per_hour);
        (self.wrong + self.repeated) as f64 - f64::from(events.per_hour) * hours
    }
}

fn loss(all: &[Tallied], events: &Events) -> f64 {
    all.iter().map(|tallied| tallied.loss(events)).sum()
}

/// The share of events that got a verdict, an early one counting more.
fn score(all: &[Tallied]) -> f64 {
    let events: usize = all.iter().map(|tallied| tallied.events).sum();
    let early = |(delay, rows): &(usize, usize)| 1.0 - *delay as f64 / (*rows + 1) as f64;
    all.iter().flat_map(|tallied| &tallied.delays).map(early).sum::<f64>() / events.max(1) as f64
}

fn counts(all: &[Tallied], events: &Events) -> EventCounts {
    let sum = |of: fn(&Tallied) -> usize| all.iter().map(of).sum::<usize>();
    let (wrong, repeated) = (sum(|one| one.wrong), sum(|one| one.repeated));
    let hours = sum(|one| one.rows) as f64 / f64::from(events.rows_per_hour);
    let second = f64::from(events.rows_per_hour) / 3600.0;
    let mut delays: Vec<usize> = all.iter().flat_map(|one| &one.delays).map(|(delay, _)| *delay).collect();
    delays.sort_unstable();
    EventCounts {
        recordings: all.len(),
        hours,
        events: sum(|one| one.events),
        named: delays.len(),
        wrong,
        repeated,
        false_per_hour: (wrong + repeated) as f64 / hours,
        mean_delay: delays.iter().sum::<usize>() as f64 / delays.len().max(1) as f64 / second,
        median_delay: delays.get(delays.len() / 2).copied().unwrap_or(0) as f64 / second,
    }
}

/// A recording: its runs of rows, one after the other.
type Recording = Vec<RowSequence>;

/// The recordings: runs of rows that follow each other in one group.
fn recordings(sequences: &Sequences) -> Vec<Recording> {
    let runs = sequences.sequences.chunk_by(|one, next| one.group.is_some() && one.group == next.group);
    runs.map(<[RowSequence]>::to_vec).collect()
}

/// Number of rows of a recording.
fn rows_of(runs: &[RowSequence]) -> usize {
    runs.iter().map(|run| run.rows.len()).sum()
}

/// Cuts a recording after this many rows.
fn cut(mut runs: Recording, rows: usize) -> Recording {
    let end = runs.first().map_or(0, |run| run.rows.start) + rows;
    runs.retain(|run| run.rows.start < end);
    if let Some(last) = runs.last_mut() {
        last.rows.end = last.rows.end.min(end);
    }
    runs
}

/// The leader of each row of these recordings, and the weights of all others, as the chip computes them.
fn led(model: &Model<'_>, rows: &Rows<'_>, recordings: &[Recording]) -> Vec<Vec<Led>> {
    let of = |runs: &Recording| {
        // No verdict silences anything: the evidence depends on none.
        let mut chip = chip(model, Stopping::from_odds(0, u32::MAX), None);
        let rows = runs.iter().flat_map(|run| run.rows.clone()).map(|row| rows.row(row));
        let led = rows.map(|margins| {
            chip.push(margins);
            (u8::try_from(chip.leader()).unwrap_or(u8::MAX), chip.rivals())
        });
        led.collect()
    };
    recordings.par_iter().map(of).collect()
}

/// Verdicts on a recording by a rule that says after each row which class leads, and whether it is sure.
fn tally(runs: &[RowSequence], events: &Events, said: impl Iterator<Item = (u8, bool)>) -> Tallied {
    let (mut ongoing, first) = (Ongoing::new(), runs.first().map_or(0, |run| run.rows.start));
    let verdicts = (first..).zip(said).filter(|(_, (leader, is_sure))| ongoing.take(events, *leader, *is_sure));
    Tallied::new(runs, events, verdicts.map(|(row, (leader, _))| (row, leader.into())))
}

/// Verdicts on recordings at a threshold in nats.
fn tallies(recordings: &[Recording], led: &[Vec<Led>], events: &Events, margin: f64) -> Vec<Tallied> {
    let odds = odds_of(margin);
    let of = |(runs, led): (&Recording, &Vec<Led>)| {
        tally(runs, events, led.iter().map(|(leader, rivals)| (*leader, *rivals <= odds)))
    };
    recordings.iter().zip(led).map(of).collect()
}

/// Thresholds from strict to loose, in nats: a row may add to the memory.
fn thresholds() -> impl Iterator<Item = f64> {
    (0..STEPS).map(|step| STRICTEST * (LOOSEST / STRICTEST).powf(f64::from(step) / f64::from(STEPS - 1)))
}

/// A model with events, and how they are recognized.
struct Shaped {
    bytes: Vec<u8>,
    events: Events,
    table: bool,
}

impl Shaped {
    fn new(model: &Model<'_>, table: Option<&Table>, memory: f64, stated: Events) -> Result<Self> {
        let unit = f64::from(model.unit());
        let events = Events { memory: (memory / unit).round().clamp(1.0, f64::from(i32::MAX)) as i32, ..stated };
        let sections = vec![
            (Tag::Weights, None),
            (Tag::RowEvidence, table.map(|table| (true, table.section(unit)))),
            (Tag::ThresholdsByObject, None),
            (Tag::Promise, None),
            (Tag::Temperature, None),
            (Tag::Guard, None),
            (Tag::Events, Some((true, events.to_bytes().to_vec()))),
        ];
        let bytes = restate(model, &Restated { sections, ..Restated::default() })?;
        Ok(Self { bytes, events, table: table.is_some() })
    }

    /// The best score of thresholds with which these recordings keep a rate per hour, and the verdicts at that threshold. If none
    /// keeps it, its score is below 0.
    fn best(&self, rows: &Rows<'_>, recordings: &[Recording], rate: f64) -> Result<(f64, Vec<Tallied>)> {
        let led = led(&compile::open(&self.bytes)?, rows, recordings);
        let mut best = (f64::NEG_INFINITY, Vec::new());
        let allowed = Events { per_hour: rate as f32, ..self.events };
        for margin in thresholds() {
            let tallies = tallies(recordings, &led, &self.events, margin);
            let over = loss(&tallies, &allowed);
            let own = if over > 0.0 { -over } else { score(&tallies) };
            if own > best.0 {
                best = (own, tallies);
            }
        }
        Ok(best)
    }
}

/// The evidence and the memory with which learned recordings are recognized best. A table is fitted to the first half of
/// them and compared on the other, at the `rate` per hour that the test will tolerate.
fn shape(model: &Model<'_>, rows: &Rows<'_>, learned: &[Recording], stated: Events, rate: f64) -> Result<Shaped> {
    let (fitted, compared) = learned.split_at(learned.len() / 2);
    let fit = |recordings: &[Recording]| Table::fit(rows, &recordings.iter().flatten().collect::<Vec<_>>());
    let table = fit(fitted);
    let best_of = |table: Option<&Table>| -> Result<(f64, f64)> {
        let mut best = (f64::NEG_INFINITY, MEMORIES[0]);
        for memory in MEMORIES {
            let (score, _) = Shaped::new(model, table, memory, stated)?.best(rows, compared, rate)?;
            if score > best.0 {
                best = (score, memory);
            }
        }
        Ok(best)
    };
    let plain = best_of(None)?;
    let with_table = table.as_ref().map(|table| best_of(Some(table))).transpose()?;
    match with_table.filter(|with_table| with_table.0 > plain.0 + GAIN) {
        Some((_, memory)) => Shaped::new(model, fit(learned).as_ref(), memory, stated),
        None => Shaped::new(model, None, plain.1, stated),
    }
}

/// The fraction to bet, from the losses of learned recordings: the product over these grows most.
fn fraction(losses: &[f64], most: f64) -> f64 {
    let growth = |fraction: f64| losses.iter().map(|loss| (-fraction * loss).ln_1p()).sum::<f64>();
    // Not the largest of all: a recording may have as many false verdicts as there can be.
    let fractions = (1..FRACTIONS).map(|step| f64::from(step) / f64::from(FRACTIONS) / most);
    fractions.max_by(|a, b| growth(*a).total_cmp(&growth(*b))).unwrap_or(0.5 / most)
}

/// Refuses models and rows that recordings of events cannot be of.
fn check_rows(model: &Model<'_>, sequences: &Sequences) -> Result<()> {
    super::check(model)?;
    if model.position().is_some() {
        return Err(RowsProblem::NumberedEvents.into());
    }
    super::check_columns(model, sequences)
}

/// Sets a model's threshold so that, on recordings like these, it has at most a promised rate of false or repeated verdicts per
/// hour; also its memory, and evidence of a row if that finds more events. `sequences` are the runs of recordings that nothing was
/// trained on ([`SequencesBuilder::by_run`](palpate_trees::rows::SequencesBuilder::by_run)), which must be independent.
///
/// # Errors
/// [`CalibrateProblem::TooFewRecordings`] and [`CalibrateProblem::NotKeptByEvents`]; [`RowsProblem`] for a model without classes
/// of rows, or with row numbers; [`Setting`](crate::error::Setting) for settings out of their ranges.
pub fn calibrate_events(
    model: &Model<'_>,
    sequences: &Sequences,
    settings: &EventSettings,
    progress: &dyn Progress,
) -> Result<EventsCalibrated> {
    settings.check()?;
    check_rows(model, sequences)?;
    if model.outputs().is_some() {
        return Err(RowsProblem::EventsOfOutputs.into());
    }
    if settings.background.is_some_and(|class| class >= model.known_count()) {
        return Err(Error::setting("background", settings.background.unwrap_or(0), "a class of the model"));
    }
    progress.begin("computing margins", None);
    #[cfg(feature = "train")]
    let bytes = strangers::without(model)?;
    #[cfg(feature = "train")]
    let model = &compile::open(&bytes)?;
    let rows = Rows::new(model, sequences);
    progress.begin("calibrating", None);
    let mut all = recordings(sequences);
    all.shuffle(&mut random::generator(settings.seed, Purpose::Calibration, "recordings", 0));
    let tested = all.split_off(all.len() / LEARNED);
    let learned = all;
    // A single recording is tested on, and only tells how many more are needed.
    let known = if learned.is_empty() { &tested } else { &learned };
    let longest = known.iter().map(|runs| rows_of(runs)).max().unwrap_or(0);
    let tested: Vec<Recording> = tested.into_iter().map(|runs| cut(runs, longest)).collect();
    let stated = settings.stated(longest);
    let most = longest.div_ceil(stated.hold_off as usize).max(1) as f64;
    // Slack for the last bits of a sum.
    let enough = -(1.0 - settings.confidence).ln() - 1e-9;
    let hours = tested.iter().map(|runs| rows_of(runs)).sum::<usize>() as f64 / f64::from(stated.rows_per_hour);
    // Without a false verdict, with recordings of the mean length.
    let largest = f64::from(FRACTIONS - 1) / f64::from(FRACTIONS) / most;
    let growth = (largest * settings.false_per_hour * hours / tested.len().max(1) as f64).ln_1p();
    let found = learned.len() + tested.len();
    let too_few = || CalibrateProblem::TooFewRecordings {
        found: found as u64,
        needed: if growth > 0.0 { (enough / growth * LEARNED as f64 / (LEARNED - 1) as f64).ceil() as u64 } else { 0 },
        per_hour: settings.false_per_hour,
        hours,
        most: most as u64,
    };
    if learned.is_empty() || growth * (tested.len() as f64) < enough {
        return Err(too_few().into());
    }
    let (learned, tested) = (&*learned, &*tested);
    // While losses are small, the bet is won if about this rate of verdicts is false.
    let tolerated = (settings.false_per_hour - enough / largest / hours).max(0.0);
    let shaped = shape(model, &rows, learned, stated, tolerated)?;
    let Shaped { bytes, events, table } = &shaped;
    let open = compile::open(bytes)?;
    let losses = |tallies: &[Tallied]| -> Vec<f64> { tallies.iter().map(|one| one.loss(events)).collect() };
    let fraction = fraction(&losses(&shaped.best(&rows, learned, tolerated)?.1), most);
    let led = led(&open, &rows, tested);
    let mut kept = None;
    let mut failed = None;
    for margin in thresholds() {
        let tallies = tallies(tested, &led, events, margin);
        let won: f64 = losses(&tallies).iter().map(|loss| (-fraction * loss).ln_1p()).sum();
        if won < enough {
            failed = Some(tallies);
            break;
        }
        kept = Some((margin, tallies));
    }
    let counted = |tallies: &[Tallied]| counts(tallies, events);
    let named = kept.as_ref().filter(|(_, tallies)| tallies.iter().any(|one| !one.delays.is_empty()));
    let Some((margin, tallies)) = named else {
        let counts = counted(&failed.or(kept.map(|(_, tallies)| tallies)).unwrap_or_default());
        if counts.wrong + counts.repeated == 0 {
            return Err(too_few().into());
        }
        return Err(CalibrateProblem::NotKeptByEvents {
            per_hour: settings.false_per_hour,
            wrong: (counts.wrong + counts.repeated) as u64,
            hours: counts.hours,
            named: counts.named as u64,
            events: counts.events as u64,
            recordings: tested.len() as u64,
        }
        .into());
    };
    let odds = odds_of(*margin);
    Ok(EventsCalibrated {
        model: restate(&open, &Restated { odds: Some(odds), ..Restated::default() })?,
        promised: settings.false_per_hour,
        confidence: settings.confidence,
        learned: learned.len(),
        longest: longest as f64 / settings.rows_per_second,
        threshold: margin_of(odds),
        memory: f64::from(events.memory) * f64::from(model.unit()),
        row_evidence: *table,
        counts: counted(tallies),
    })
}

/// Measures a model with [events](Model::events) on recordings, and what rules over the classes of single rows give.
///
/// # Errors
/// [`RowsProblem`] for a model without classes of rows, with row numbers, or without events.
pub fn evaluate_events(model: &Model<'_>, sequences: &Sequences) -> Result<EventsEvaluated> {
    check_rows(model, sequences)?;
    let Some(events) = model.events() else { return Err(RowsProblem::NoEvents.into()) };
    let rows = Rows::new(model, sequences);
    let all = recordings(sequences);
    let led = led(model, &rows, &all);
    let odds = Stopping::from_model(model);
    let own: Vec<Tallied> = all
        .iter()
        .zip(&led)
        .map(|(runs, led)| {
            let sure = |(leader, rivals): &Led| (*leader, *rivals <= odds.odds_of((*leader).into(), model));
            tally(runs, &events, led.iter().map(sure))
        })
        .collect();
    let counted = counts(&own, &events);
    let promised = (events.per_hour > 0.0).then(|| f64::from(events.per_hour));
    let classes: Vec<Vec<u8>> = all
        .iter()
        .map(|runs| {
            let rows = runs.iter().flat_map(|run| run.rows.clone()).map(|row| rows.row(row));
            rows.map(|margins| class(margins, model.known_count())).collect()
        })
        .collect();
    let as_few = |rule: fn(&[u8], usize) -> Said| {
        let allowed = counted.wrong + counted.repeated;
        let of = |rows: usize| {
            let one = |(runs, classes): (&Recording, &Vec<u8>)| tally(runs, &events, rule(classes, rows).into_iter());
            let tallies: Vec<Tallied> = all.par_iter().zip(&classes).map(one).collect();
            RowRule { rows, counts: counts(&tallies, &events) }
        };
        numbers().map(of).find(|rule| rule.counts.wrong + rule.counts.repeated <= allowed)
    };
    Ok(EventsEvaluated {
        promised,
        finding: promised.map(|_| finding(&own, &events)),
        too_long: own.iter().filter(|one| one.rows > events.longest as usize).count(),
        majority: as_few(majority),
        debounced: as_few(debounced),
        counts: counted,
    })
}

/// Numbers of rows from 1 on, about 5 % apart.
fn numbers() -> impl Iterator<Item = usize> {
    let next = |rows: &usize| Some((*rows + 1).max(rows * 21 / 20));
    std::iter::successors(Some(1), next).take_while(|rows| *rows <= MOST_ROWS)
}

/// The class of a row by itself.
fn class(margins: &[i32], known: usize) -> u8 {
    let known = margins.get(..known).unwrap_or(margins);
    let best = (1..known.len()).fold(0, |best, other| if known[other] > known[best] { other } else { best });
    u8::try_from(best).unwrap_or(u8::MAX)
}

/// The class of most of the last rows, sure if it is that of more than half of them.
fn majority(classes: &[u8], rows: usize) -> Said {
    let mut votes = [0_usize; 256];
    let said = classes.iter().enumerate().map(|(at, class)| {
        votes[usize::from(*class)] += 1;
        if let Some(gone) = at.checked_sub(rows) {
            votes[usize::from(classes[gone])] -= 1;
        }
        let best = (1..256).fold(0, |best, other| if votes[other] > votes[best] { other } else { best });
        (best as u8, votes[best] * 2 > rows)
    });
    said.collect()
}

/// The class of a row, sure if it is that of all the last rows.
fn debounced(classes: &[u8], rows: usize) -> Said {
    let (mut last, mut run) = (None, 0);
    let said = classes.iter().map(|class| {
        run = if last == Some(*class) { run + 1 } else { 1 };
        last = Some(*class);
        (*class, run >= rows)
    });
    said.collect()
}

/// Result of a test of a promise: whether the mean loss of recordings is above 0, by its standard error.
fn finding(all: &[Tallied], events: &Events) -> Finding {
    let count = all.len() as f64;
    let mean = loss(all, events) / count;
    let variance = all.iter().map(|one| (one.loss(events) - mean).powi(2)).sum::<f64>() / count;
    let errors = mean / (variance / count).sqrt().max(f64::MIN_POSITIVE);
    let chance = 0.5 * libm::erfc(errors * std::f64::consts::FRAC_1_SQRT_2);
    match () {
        () if all.iter().all(|one| one.delays.is_empty() && one.wrong == 0) => Finding::Untested,
        () if mean > 0.0 && chance < BY_CHANCE => Finding::Broken,
        () if mean > 0.0 => Finding::Unclear,
        () => Finding::Kept,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EVENTS: Events = Events {
        background: Some(0),
        hold_off: 3,
        memory: 100,
        rows_per_hour: 100.0,
        per_hour: 2.0,
        confidence: 0.95,
        grace: 2,
        longest: 50,
    };

    /// Runs of these classes and lengths.
    fn runs(of: &[(usize, usize)]) -> Recording {
        let mut start = 0;
        let mut run = |(class, length): &(usize, usize)| {
            start += length;
            RowSequence { rows: start - length..start, class: *class, group: Some(0) }
        };
        of.iter().map(&mut run).collect()
    }

    fn tallied(events: &Events, verdicts: &[(usize, usize)]) -> Tallied {
        Tallied::new(&runs(&[(0, 10), (1, 10), (0, 10), (2, 10), (1, 10)]), events, verdicts.iter().copied())
    }

    #[test]
    fn a_verdict_counts_once_from_the_onset_to_the_grace_of_an_event_of_its_class() {
        let of = |verdicts| {
            let tallied = tallied(&EVENTS, verdicts);
            let delays: Vec<usize> = tallied.delays.iter().map(|(delay, _)| *delay).collect();
            (delays, tallied.wrong, tallied.repeated)
        };
        assert_eq!(of(&[]), (vec![], 0, 0));
        assert_eq!(of(&[(10, 1), (30, 2), (49, 1)]), (vec![1, 1, 10], 0, 0));
        // Before the onset, after the grace, of another class.
        assert_eq!(of(&[(9, 1), (22, 1), (15, 2)]), (vec![], 3, 0));
        assert_eq!(of(&[(21, 1), (41, 2)]), (vec![12, 12], 0, 0));
        assert_eq!(of(&[(12, 1), (16, 1), (20, 1)]), (vec![3], 0, 2));
        let without = tallied(&Events { background: None, ..EVENTS }, &[(0, 0), (25, 0)]);
        assert_eq!((without.events, without.delays.len(), without.wrong), (5, 2, 0));
    }

    #[test]
    fn a_loss_is_false_and_repeated_verdicts_less_those_of_the_rate() {
        let tallied = tallied(&EVENTS, &[(12, 1), (16, 1), (25, 2)]);
        assert_eq!((tallied.rows, tallied.events), (50, 3));
        assert!((tallied.loss(&EVENTS) - 1.0).abs() < 1e-9, "two in half an hour, of two in an hour");
        let counts = counts(&[tallied], &EVENTS);
        assert_eq!((counts.named, counts.wrong, counts.repeated, counts.false_per_hour), (1, 1, 1, 4.0));
        assert!((counts.mean_delay - 108.0).abs() < 1e-9, "three rows of 36 s");
    }

    #[test]
    fn recordings_are_cut_and_bets_never_lose_all() {
        let recording = runs(&[(0, 10), (1, 10), (0, 10)]);
        assert_eq!(cut(recording.clone(), 15), runs(&[(0, 10), (1, 5)]));
        assert_eq!(cut(recording.clone(), 20), runs(&[(0, 10), (1, 10)]));
        assert_eq!(cut(recording.clone(), 100), recording);
        for losses in [vec![-0.5; 20], vec![9.0, -0.5, -0.5], vec![]] {
            let fraction = fraction(&losses, 10.0);
            assert!(fraction > 0.0 && 1.0 - fraction * 10.0 > 0.0, "{fraction}");
        }
    }

    #[test]
    fn rules_over_rows_are_sure_of_more_than_half_of_the_last_rows_or_of_equal_ones() {
        let classes = [1, 1, 2, 1, 2, 2, 2];
        let sure =
            |said: Said| -> Vec<Option<u8>> { said.iter().map(|(class, sure)| sure.then_some(*class)).collect() };
        let [one, two] = [Some(1), Some(2)];
        assert_eq!(sure(majority(&classes, 3)), [None, one, one, one, two, two, two]);
        assert_eq!(sure(debounced(&classes, 2)), [None, one, None, None, None, two, two]);
        assert!(numbers().take(20).eq(1..=20));
    }
}
