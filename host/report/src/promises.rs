//! Promised error rates: whether they are kept, and what they cost, compared with the limit.

use super::context::{Context, compiled, compiled_f32};
use super::density::density_model;
use super::limit::Large;
use super::statistics::wilson;
use crate::page::axis::{Axis, short_number};
use crate::page::chart::{Chart, Mark, Shape, Stroke};
use crate::page::color;
use crate::page::document::{Figure, Section};
use palpate::calibrate::{self, Limit, Odds, Per, Sequence, Terms, choose, follow, margin_of, odds_of};
use palpate::compile;
use palpate::error::{Kind, Result};
use palpate::probe::scene::Scene;
use palpate::results::{Results, Value};
use palpate::touches::Origin;
use palpate::wording;
use palpate::{row, with};
use palpate_onboard::Model;
use palpate_shared::Descriptor;

/// The promised rates.
const RATES: [f64; 6] = [0.1, 0.05, 0.02, 0.01, 0.005, 0.001];
/// The one whose objects are shown.
pub(super) const SHOWN: f64 = 0.01;
/// Margin, in nats, by which sequences are followed beyond the posterior of the strictest rate.
const BEYOND: f64 = 2.5;
/// Touches after which a sequence ends undecided.
const MAX_TOUCHES: u32 = 200;
/// The probability that each promise is kept.
const CONFIDENCE: f64 = 0.95;

/// Results of promises.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Promises {
    /// Sequences that thresholds were found on, and others that they were tested on.
    pub(super) sequences: [usize; 2],
    /// The paper's method and ours, stopping when the posterior exceeds 1 − [`SHOWN`].
    pub(super) until_sure: [Stopped; 2],
    /// For each of [`RATES`].
    rates: Vec<Promised>,
    /// For each object at [`SHOWN`].
    objects: Vec<OfObject>,
}

/// The results for one rate; none where there were too few sequences to promise it.
#[derive(Clone, Debug, PartialEq)]
struct Promised {
    rate: f64,
    /// Stopping when the posterior exceeds 1 − rate.
    uncalibrated: Stopped,
    /// Promised on average.
    average: Option<Stopped>,
    /// Results of the limit, under the same promise.
    limit: Option<Stopped>,
    /// Promised of each name, and of each object; `error` is that of the worst.
    name: Option<Stopped>,
    object: Option<Stopped>,
}

/// Results of thresholds on sequences that they were not found on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stopped {
    /// The threshold in nats; the mean of several.
    margin: f64,
    pub(super) touches: f64,
    /// Share of the names given that were wrong, and its 95 % interval.
    pub(super) error: f64,
    low: f64,
    high: f64,
    undecided: f64,
}

/// Meaning of a promise for an object.
#[derive(Clone, Debug, PartialEq)]
struct OfObject {
    name: String,
    /// Meanings of a promise on average, and of one per name; none where there were too few sequences for it.
    promised: [Option<Meaning>; 2],
}

/// Results of thresholds for an object.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Meaning {
    /// Touches until a verdict.
    touches: f64,
    /// Share of wrong names among those given to the object.
    error: f64,
    /// Share of wrong ones when its name is given.
    named_wrongly: f64,
}

/// Finds thresholds on a capture of their own and tests them on another.
pub(super) fn measure(context: &Context, large: &Large) -> Result<Promises> {
    let ours = compiled(&context.models()?.ours)?.bytes;
    let (density, _) = density_model(Descriptor::Curvature, &large.train, &large.held)?;
    let limit = compiled_f32(&density)?.bytes;
    let paper = compiled_f32(&context.models()?.paper)?.bytes;
    let [paper, ours, limit] = [compile::open(&paper)?, compile::open(&ours)?, compile::open(&limit)?];
    let names = context.names();
    // Other seeds than those of the folds and of the large capture.
    let seeds = [0x11_1118, 0x11_1119].map(|other| context.settings.seed.wrapping_add(other));
    // All models on the same touches, captured once.
    let kept = &mut calibrate::Fresh::default();
    let [ours_chosen, limit_chosen] =
        [sequences(context, &ours, seeds[0], kept)?, sequences(context, &limit, seeds[0], kept)?];
    let kept = &mut calibrate::Fresh::default();
    let tested = |model| sequences(context, model, seeds[1], kept);
    let [ours_tested, limit_tested, paper] = [&ours, &limit, &paper].map(tested);
    let (ours, limit) = ([ours_chosen, ours_tested?], [limit_chosen, limit_tested?]);
    let until_sure = [&paper?, &ours[1]].map(|sequences| stopped(sequences, &at_posterior(SHOWN)));
    let mut found = Vec::new();
    let chosen = |sequences: &[Sequence], rate: f64, per: Per| -> Result<Option<Odds>> {
        let terms = Terms { rate, confidence: CONFIDENCE, per };
        match choose(sequences, &names, strictest(), &terms) {
            Ok(chosen) => Ok(Some(chosen.odds)),
            Err(error) if matches!(error.kind(), Kind::NotKept | Kind::TooFew) => Ok(None),
            Err(error) => Err(error),
        }
    };
    let mut objects = Vec::new();
    for rate in RATES {
        context.check()?;
        let [average, name, object] = [Per::Average, Per::Name, Per::Object].map(|per| chosen(&ours[0], rate, per));
        let (average, name, object) = (average?, name?, object?);
        let of_limit = chosen(&limit[0], rate, Per::Average)?;
        if rate == SHOWN {
            objects = of_objects(&ours[1], &names, [&average, &name]);
        }
        let by = |of: &dyn Fn(&Sequence, usize) -> usize, odds: &Odds| worst(&ours[1], names.len(), odds, of);
        found.push(Promised {
            rate,
            uncalibrated: stopped(&ours[1], &at_posterior(rate)),
            average: average.map(|odds| stopped(&ours[1], &odds)),
            limit: of_limit.map(|odds| stopped(&limit[1], &odds)),
            name: name.map(|odds| by(&|_, name| name, &odds)),
            object: object.map(|odds| by(&|sequence, _| sequence.object, &odds)),
        });
    }
    Ok(Promises { sequences: [ours[0].len(), ours[1].len()], until_sure, rates: found, objects })
}

/// The threshold that a posterior of 1 − `rate` exceeds.
fn at_posterior(rate: f64) -> Odds {
    Odds::All(odds_of(((1.0 - rate) / rate).ln()))
}

/// The margin that sequences are followed to.
fn strictest() -> f64 {
    let least = RATES[RATES.len() - 1];
    ((1.0 - least) / least).ln() + BEYOND
}

/// Sequences of full touches captured for this, the same for any number of rates; what is `kept` is not captured again.
fn sequences(context: &Context, model: &Model<'_>, seed: u64, kept: &mut calibrate::Fresh) -> Result<Vec<Sequence>> {
    let names = context.names();
    let objects: Vec<(&str, &[Scene])> =
        names.iter().map(String::as_str).zip(context.all_scenes().iter().map(Vec::as_slice)).collect();
    let settings = with!(
        calibrate::Settings::default(),
        rate = RATES[RATES.len() - 1],
        sequences = context.settings.promise_sequences,
        max_touches = Some(MAX_TOUCHES),
        seed
    );
    let origin = Origin { seed, approaches: false, ..context.settings.capture.clone() };
    let captured = calibrate::fresh(model, &objects, &origin, &settings, kept, context.progress)?;
    // The model's objects are the context's, in the same order.
    let mut supplies = captured.supplies(&(0..names.len()).collect::<Vec<_>>(), seed);
    let wanted = vec![settings.sequences / names.len().max(1); names.len()];
    let limit = Limit { margin: strictest(), max_touches: MAX_TOUCHES };
    follow(model, &mut supplies, &wanted, limit, context.progress)
}

/// Results of thresholds, all objects together.
fn stopped(sequences: &[Sequence], odds: &Odds) -> Stopped {
    let (mut given, mut wrong, mut touches) = (0.0, 0.0, 0.0);
    for sequence in sequences {
        let look = sequence.given(odds);
        touches += f64::from(look.map_or(sequence.touches, |look| look.touches));
        given += f64::from(u8::from(look.is_some()));
        wrong += f64::from(u8::from(look.is_some_and(|look| look.name != sequence.object)));
    }
    let all = sequences.len().max(1) as f64;
    let (low, high) = wilson(wrong, given);
    let margin = match odds {
        Odds::All(odds) => margin_of(*odds),
        Odds::ByObject(odds) => odds.iter().map(|&odds| margin_of(odds)).sum::<f64>() / odds.len().max(1) as f64,
    };
    let error = if given > 0.0 { wrong / given } else { 0.0 };
    Stopped { margin, touches: touches / all, error, low, high, undecided: 1.0 - given / all }
}

/// Results with the error of the worst of the groups that `of` (sequence, name given) divides the names into.
fn worst(sequences: &[Sequence], groups: usize, odds: &Odds, of: &dyn Fn(&Sequence, usize) -> usize) -> Stopped {
    let mut tallies = vec![(0.0, 0.0); groups];
    for sequence in sequences {
        let Some(look) = sequence.given(odds) else { continue };
        let (wrong, given) = &mut tallies[of(sequence, look.name)];
        *given += 1.0;
        *wrong += f64::from(u8::from(look.name != sequence.object));
    }
    let worst =
        tallies.into_iter().filter(|(_, given)| *given > 0.0).max_by(|a, b| (a.0 / a.1).total_cmp(&(b.0 / b.1)));
    let (wrong, given) = worst.unwrap_or((0.0, 1.0));
    let (low, high) = wilson(wrong, given);
    Stopped { error: wrong / given, low, high, ..stopped(sequences, odds) }
}

fn of_objects(sequences: &[Sequence], names: &[String], odds: [&Option<Odds>; 2]) -> Vec<OfObject> {
    let of = |object: usize, odds: &Odds| {
        let own: Vec<Sequence> = sequences.iter().filter(|sequence| sequence.object == object).cloned().collect();
        let named: Vec<Sequence> = sequences
            .iter()
            .filter(|sequence| sequence.given(odds).is_some_and(|look| look.name == object))
            .cloned()
            .collect();
        let own = stopped(&own, odds);
        Meaning { touches: own.touches, error: own.error, named_wrongly: stopped(&named, odds).error }
    };
    let objects = names.iter().enumerate().map(|(object, name)| OfObject {
        name: name.clone(),
        promised: odds.map(|odds| odds.as_ref().map(|odds| of(object, odds))),
    });
    objects.collect()
}

/// The figure and the tables.
pub(super) fn section(promises: &Promises) -> Result<Section> {
    let [found, tested] = promises.sequences;
    let mut section = Section::new("promises", "Promises");
    section.text(format!(
        "A promised error rate is the largest share of wrong names among those given; a sequence that reaches \
         {MAX_TOUCHES} touches without a name is undecided, neither right nor wrong. Thresholds were found by \
         Learn-then-Test on {} sequences of touches captured for that, so that each promise is kept with a \
         probability of {}, and measured on {} other sequences. {} The limit is a density estimate from the large \
         capture, with its own thresholds.",
        wording::count(found),
        wording::rate(CONFIDENCE),
        wording::count(tested),
        uncalibrated(&promises.rates)
    ));
    section.figure(figure(promises)?).figure(table(promises)).figure(objects(promises));
    Ok(section)
}

/// Stopping at the posterior, compared with the rates and with promises.
fn uncalibrated(rates: &[Promised]) -> String {
    let kept = rates.iter().filter(|of| of.uncalibrated.error <= of.rate).count();
    let promised = || rates.iter().filter_map(|of| Some((of.uncalibrated.touches, of.average?.touches)));
    let longer = promised().filter(|(uncalibrated, promised)| uncalibrated > promised).count();
    format!(
        "Stopping when the posterior exceeds 1 − rate, without a calibration, stayed at or below {kept} of {} rates, and took \
         more touches than a promise at {longer} of the {} rates that could be promised.",
        rates.len(),
        promised().count()
    )
}

fn figure(promises: &Promises) -> Result<Figure> {
    let ticks = RATES.map(|rate| (rate, format!("{} %", short_number(rate * 100.0)))).to_vec();
    let (low, high) = (RATES[RATES.len() - 1] * 0.3, RATES[0] * 1.5);
    let axis = || Axis::logarithmic(low, high).with_ticks(ticks.clone());
    let mut chart = Chart::new("promised", axis(), "measured", axis()).sized(520, 420);
    chart.marks.push(Mark::Line { points: vec![(low, low), (high, high)], color: color::GRAY, stroke: Stroke::Dashed });
    let mut data = Results::new(["thresholds", "promised", "measured", "low", "high"]);
    type Of = fn(&Promised) -> Option<Stopped>;
    let ways = [
        ("uncalibrated", color::GRAY, Shape::Ring, (|of| Some(of.uncalibrated)) as Of),
        ("average", color::OURS, Shape::Disc, |of| of.average),
        ("worst name", color::PAPER, Shape::Disc, |of| of.name),
    ];
    for (name, color, shape, of) in ways {
        let measured: Vec<(f64, Stopped)> =
            promises.rates.iter().filter_map(|promised| Some((promised.rate, of(promised)?))).collect();
        for (rate, stopped) in &measured {
            let shares = [*rate, stopped.error, stopped.low, stopped.high].map(|share| Value::Percent(share, 3));
            data.push(row![name].into_iter().chain(shares));
        }
        let visible = || measured.iter().filter(|(_, stopped)| stopped.error > low);
        let spread = visible().map(|(rate, stopped)| (*rate, stopped.low.max(low), stopped.high)).collect();
        chart.marks.push(Mark::Spread { points: spread, color });
        let points: Vec<(f64, f64)> = visible().map(|(rate, stopped)| (*rate, stopped.error)).collect();
        chart.series(name, color, shape, &points);
    }
    let caption = "On the dashed line the measured error rate equals the promised one; above it, the promise is broken. Bars are \
                   95 % intervals (Wilson).";
    Ok(Figure::new("promises-kept", "Promised and measured error rates", caption, data).drawn(vec![chart.svg()?]))
}

fn table(promises: &Promises) -> Figure {
    let mut data = Results::new([
        "promised",
        "uncalibrated",
        "touches",
        "on average",
        "touches",
        "undecided",
        "limit's touches",
        "ratio",
        "per name: worst",
        "touches",
        "per object: worst",
        "touches",
    ]);
    for promised in &promises.rates {
        let Promised { average, limit, name, object, .. } = *promised;
        let uncalibrated = Some(promised.uncalibrated);
        let error = |of: Option<Stopped>| of.map(|of| Value::Percent(of.error, 2));
        let touches = |of: Option<Stopped>| of.map(|of| Value::Number(of.touches, 1));
        data.push(row![
            Value::Percent(promised.rate, 1),
            error(uncalibrated),
            touches(uncalibrated),
            error(average),
            touches(average),
            average.map(|of| Value::Percent(of.undecided, 2)),
            touches(limit),
            average.zip(limit).map(|(ours, limit)| Value::Number(ours.touches / limit.touches, 2)),
            error(name),
            touches(name),
            error(object),
            touches(object),
        ]);
    }
    let caption = "A dash (–) marks a rate that these sequences are too few to promise. A promise per object has one threshold, strict \
                   enough for the object that is mistaken most often.";
    Figure::new("promises-table", "What promises cost", caption, data)
}

fn objects(promises: &Promises) -> Figure {
    let mut data = Results::new([
        "object",
        "touches, on average",
        "mistaken",
        "named wrongly",
        "touches, per name",
        "mistaken",
        "named wrongly",
    ]);
    for object in &promises.objects {
        let cells = object.promised.iter().flat_map(|meaning| {
            let share = |of: fn(&Meaning) -> f64| meaning.as_ref().map(|meaning| Value::Percent(of(meaning), 2));
            let touches = meaning.as_ref().map(|meaning| Value::Number(meaning.touches, 1));
            row![touches, share(|of| of.error), share(|of| of.named_wrongly)]
        });
        data.push(row![&object.name].into_iter().chain(cells));
    }
    let title = format!("A promise of {} for each object", wording::rate(SHOWN));
    let caption = "Mistaken: share of wrong names among those given to the object. Named wrongly: share of wrong ones when its name is \
                   given. Dashes: too few sequences for the promise.";
    Figure::new("promises-objects", title, caption, data)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stopping_at_the_posterior_does_is_counted_and_not_supposed() {
        let stopped =
            |error: f64, touches: f64| Stopped { margin: 0.0, touches, error, low: 0.0, high: 1.0, undecided: 0.0 };
        let promised = |rate: f64, uncalibrated: Stopped, average: Option<Stopped>| Promised {
            rate,
            uncalibrated,
            average,
            limit: None,
            name: None,
            object: None,
        };
        let rates = [
            promised(0.1, stopped(0.04, 20.0), Some(stopped(0.09, 12.0))),
            promised(0.01, stopped(0.02, 30.0), Some(stopped(0.01, 44.0))),
            promised(0.001, stopped(0.01, 40.0), None),
        ];
        let said = uncalibrated(&rates);
        assert!(said.contains("at or below 1 of 3 rates") && said.contains("at 1 of the 2 rates"), "{said}");
    }
}
