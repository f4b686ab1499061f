//! Noise on contact times: signal-to-noise ratio, accuracy and confusion (the paper's figures 10 to 13).

use super::confusion::{self, normalized};
use super::context::{Context, Models, NOISE, compiled, compiled_f32};
use super::statistics::{mean_deviation, savitzky_golay, wilson};
use crate::page::axis::Axis;
use crate::page::chart::{Chart, Mark, Shape, Stroke};
use crate::page::color;
use crate::page::document::{Figure, Section};
use palpate::compile;
use palpate::ensemble::train;
use palpate::error::Result;
use palpate::evaluate::{Margins, add_noise};
use palpate::probe::noise::{self, Noise};
use palpate::results::{Results, Value};
use palpate::touches::folds::Split;
use palpate::touches::{Dataset, ObjectTouches};
use palpate::wording::{count, counted};
use palpate::{row, with};
use plotters::style::RGBColor;

/// The methods, in the order of [`Fold::methods`].
pub(super) const METHODS: [&str; 3] = ["paper", "ours", "ours, trained for noise"];
const COLORS: [RGBColor; 3] = [color::PAPER, color::OURS, color::GREEN];
const SHAPES: [Shape; 3] = [Shape::Ring, Shape::Disc, Shape::Triangle];

/// Results of one fold, one entry per method and noise level.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Fold {
    /// For each of [`METHODS`], for each level: accuracy after ten touches of each object.
    pub(super) accuracy: Vec<Vec<Vec<f64>>>,
    /// For each of [`METHODS`]: the confusion matrix after ten touches at 5 ms.
    pub(super) confusion: Vec<Vec<Vec<usize>>>,
    /// For each of [`METHODS`], for each of [`kinds`]: accuracy after ten touches.
    pub(super) kinds: Vec<Vec<f64>>,
}

/// Other errors of a sensor, a timer or a robot, one at a time and then together.
fn kinds() -> [Noise; 9] {
    let none = Noise::default();
    let timer = 1_000.0;
    [
        none,
        with!(none, timer),
        with!(none, debounce = 2_000.0),
        with!(none, missed = [0.02; 3]),
        with!(none, bent = [3_000.0, 0.0, 0.0]),
        with!(none, speed_error = 0.05),
        with!(none, speed_bias = 0.01),
        with!(none, speed_bias = 0.1),
        with!(Noise::gaussian(1_000.0), debounce = 2_000.0, timer, speed_bias = 0.02),
    ]
}

/// Tests on noisy touches.
pub(super) fn measure(context: &Context) -> Result<Vec<Fold>> {
    (0..context.settings.noise_folds.min(context.settings.folds)).map(|fold| one_fold(context, fold)).collect()
}

fn one_fold(context: &Context, fold: usize) -> Result<Fold> {
    let split = context.fold(fold)?;
    if fold == 0 {
        return tested(context, fold, &split, context.models()?);
    }
    let train = |settings: &train::Settings| context.train(&split.train, settings);
    let models = Models {
        paper: train(&context.paper())?,
        ours: train(&context.ours())?,
        noise: train(&context.ours_for_noise())?,
    };
    tested(context, fold, &split, &models)
}

fn tested(context: &Context, fold: usize, split: &Split, models: &Models) -> Result<Fold> {
    let settings = context.settings;
    let compiled = [compiled_f32(&models.paper)?.bytes, compiled(&models.ours)?.bytes, compiled(&models.noise)?.bytes];
    let models = [compile::open(&compiled[0])?, compile::open(&compiled[1])?, compile::open(&compiled[2])?];
    let mut result = Fold {
        accuracy: vec![Vec::new(); METHODS.len()],
        confusion: vec![Vec::new(); METHODS.len()],
        kinds: vec![Vec::new(); METHODS.len()],
    };
    // Noise that no training saw: training uses the seed itself.
    let seed = settings.seed.wrapping_add(1_000 + fold as u64);
    for deviation in settings.deviations() {
        context.check()?;
        let test = noisy(&split.test, deviation, seed);
        for (method, model) in models.iter().enumerate() {
            let margins = Margins::new(model, &test)?;
            let confusion = margins.confusion(10, settings.many_groups, seed)?;
            let right = |(object, row): (usize, &Vec<usize>)| row[object] as f64 / settings.many_groups as f64;
            result.accuracy[method].push(confusion.iter().enumerate().map(right).collect());
            if (deviation - NOISE / 1e3).abs() < 0.01 {
                result.confusion[method] = confusion;
            }
        }
    }
    for kind in kinds() {
        context.check()?;
        let mut test = split.test.clone();
        add_noise(&mut test, &kind, seed)?;
        for (method, model) in models.iter().enumerate() {
            let margins = Margins::new(model, &test)?;
            result.kinds[method].push(margins.curve(10, settings.many_groups, seed)?.accuracy(10).value);
        }
    }
    // The quick levels leave 5 ms out.
    if result.confusion[0].is_empty() {
        let test = noisy(&split.test, NOISE / 1e3, seed);
        for (method, model) in models.iter().enumerate() {
            result.confusion[method] = Margins::new(model, &test)?.confusion(10, settings.many_groups, seed)?;
        }
    }
    Ok(result)
}

/// A data set with noise of `deviation` milliseconds.
fn noisy(data: &Dataset, deviation: f64, seed: u64) -> Dataset {
    let mut noisy = data.clone();
    noisy.add_noise(&noise::Noise::gaussian(deviation * 1e3), seed, 1);
    noisy
}

/// Accuracy of a method at the level nearest to `deviation` ms: mean and deviation over folds.
pub(super) fn accuracy_at(context: &Context, folds: &[Fold], method: usize, deviation: f64) -> (f64, f64) {
    let right = |fold: &Fold| {
        // The matrix at 5 ms is always there, the level need not be.
        if (deviation - NOISE / 1e3).abs() < 1e-9 {
            let shares = normalized(&[&fold.confusion[method]]);
            return (0..shares.len()).map(|k| shares[k][k]).sum::<f64>() / shares.len().max(1) as f64;
        }
        let levels = context.settings.deviations();
        let level = levels.iter().position(|&level| level >= deviation - 1e-9).unwrap_or(levels.len() - 1);
        let objects = &fold.accuracy[method][level];
        objects.iter().sum::<f64>() / objects.len().max(1) as f64
    };
    mean_deviation(&folds.iter().map(right).collect::<Vec<_>>())
}

/// The signal-to-noise ratio in decibels of one object's touches under noise of `deviation` milliseconds: the signal of a
/// touch is the sum of its three contact times, and its noise the sum of three independent ones; powers are means of
/// squares over touches.
fn signal_to_noise(object: &ObjectTouches, deviation: f64) -> f64 {
    let signals = object.touches().iter().map(|touch| {
        let micros = touch.times().into_iter().filter_map(|time| time.micros());
        micros.map(|micros| f64::from(micros) / 1e3).sum::<f64>()
    });
    let power = signals.map(|signal| signal * signal).sum::<f64>() / object.len().max(1) as f64;
    10.0 * (power / (3.0 * deviation * deviation)).log10()
}

/// The figures.
pub(super) fn section(context: &Context, folds: &[Fold]) -> Result<Section> {
    let mut section = Section::new("noise", "Noise on contact times");
    section.text(format!(
        "Gaussian noise was added to each contact time independently, then the earliest time subtracted, so that the \
         first contact is 0 again. The paper's method and ours were trained on clean touches, as in the paper; the third was \
         trained on touches with {}. {} test touches per object and fold, {}, {} per object and fold.",
        context.settings.noise,
        count(context.settings.touches / context.settings.folds),
        counted(folds.len(), "fold", "folds"),
        counted(context.settings.many_groups, "group", "groups")
    ));
    section.figure(signal(context)?);
    section.figure(overall(context, folds)?);
    section.figure(objects(context, folds)?);
    section.figure(confusions(context, folds)?);
    let title = "Accuracy after ten touches under other noise";
    let caption = "Other errors of a sensor, a timer or a robot, one at a time and then together. A robot's own error is the same \
                   for all touches of a group.";
    section.figure(Figure::new("noise-kinds", title, caption, other_kinds(folds)));
    Ok(section)
}

/// Accuracy under other noise than Gaussian, one row for each kind.
fn other_kinds(folds: &[Fold]) -> Results {
    let mut table = Results::new(std::iter::once("what is added").chain(METHODS));
    for (row, kind) in kinds().into_iter().enumerate() {
        let accuracy = |method: usize| {
            let (mean, deviation) =
                mean_deviation(&folds.iter().map(|fold| fold.kinds[method][row]).collect::<Vec<_>>());
            if folds.len() > 1 { Value::PercentSpread(mean, deviation, 1) } else { Value::Percent(mean, 1) }
        };
        table.push(row![kind.to_string()].into_iter().chain((0..METHODS.len()).map(accuracy)));
    }
    table
}

fn signal(context: &Context) -> Result<Figure> {
    let captured = context.captured()?;
    let deviations: Vec<f64> = context.settings.deviations().into_iter().filter(|&d| d > 0.0).collect();
    let mut data = Results::new(["object", "noise (ms)", "signal-to-noise ratio (dB)"]);
    let mut lines = Vec::new();
    for object in &captured.data.objects {
        let points: Vec<(f64, f64)> = deviations.iter().map(|&d| (d, signal_to_noise(object, d))).collect();
        for &(deviation, ratio) in &points {
            data.push(row![&object.name, Value::Number(deviation, 2), Value::Number(ratio, 2)]);
        }
        lines.push((object.name.as_str(), points));
    }
    let all = || lines.iter().flat_map(|line| line.1.iter().map(|point| point.1));
    let (low, high) = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    let mut chart = Chart::new(
        "standard deviation of the noise (ms)",
        Axis::linear(0.0, 10.0, 5),
        "signal-to-noise ratio (dB)",
        Axis::linear((low / 5.0).floor() * 5.0, (high / 5.0).ceil() * 5.0, 6),
    )
    .sized(620, 400);
    for (index, (name, points)) in lines.iter().enumerate() {
        let stroke = if index % 2 == 0 { Stroke::Solid } else { Stroke::Dashed };
        chart.line(name, color::series(index), stroke, points);
    }
    let caption = "The signal of a touch is the sum of its three contact times, its noise the sum of three independent ones of this \
                   deviation, before the earliest time is subtracted; the ratio is of mean squares, over all captured touches. The \
                   paper does not say if noise is taken before or after the subtraction.";
    let title = "Signal-to-noise ratio of each object (figure 10)";
    Ok(Figure::new("signal-to-noise", title, caption, data).drawn(vec![chart.svg()?]))
}

/// Mean over folds, for each level, of what `of` takes from a fold's accuracies of objects.
fn over_levels(context: &Context, folds: &[Fold], method: usize, of: impl Fn(&[f64]) -> f64) -> Vec<(f64, f64)> {
    let mean = |(level, deviation): (usize, f64)| {
        let values: Vec<f64> = folds.iter().map(|fold| of(&fold.accuracy[method][level])).collect();
        (deviation, mean_deviation(&values).0)
    };
    context.settings.deviations().into_iter().enumerate().map(mean).collect()
}

/// The levels to either side that a smoothed value rests on, where there are enough.
const HALF: usize = 5;
/// Degrees of the polynomials that smooth, and their names.
const DEGREES: [&str; 4] = ["constant", "linear", "quadratic", "cubic"];

/// Levels to either side, and the polynomial's degree, for a curve over so many levels.
fn smoothing(levels: usize) -> (usize, usize) {
    let half = HALF.min((levels.max(1) - 1) / 2);
    (half, half.min(DEGREES.len() - 1))
}

/// Smoothing of a curve over so many levels, in words.
fn smoothed_by(levels: usize) -> String {
    let (half, degree) = smoothing(levels);
    match DEGREES.get(degree) {
        Some(name) if half > 0 => format!(
            "Points are measured; lines are smoothed by a {name} Savitzky–Golay filter over {} levels, within the 95 % \
             interval (Wilson) of each point.",
            2 * half + 1
        ),
        _ => "Points are measured; lines join them.".to_owned(),
    }
}

/// A smoothed curve at the same places. It stays within the 95 % interval of what was measured in `trials` groups, so that
/// it never denies a steep fall that was measured.
fn smoothed(points: &[(f64, f64)], trials: usize) -> Vec<(f64, f64)> {
    let values: Vec<f64> = points.iter().map(|point| point.1).collect();
    let (half, degree) = smoothing(points.len());
    points
        .iter()
        .zip(savitzky_golay(&values, half, degree))
        .map(|(&(x, share), y)| {
            let (low, high) = wilson(share * trials as f64, trials as f64);
            (x, y.clamp(low, high))
        })
        .collect()
}

fn overall(context: &Context, folds: &[Fold]) -> Result<Figure> {
    let raw = |method| over_levels(context, folds, method, |objects| mean_deviation(objects).0);
    let raws: Vec<Vec<(f64, f64)>> = (0..METHODS.len()).map(raw).collect();
    let all = || raws.iter().flatten().map(|point| point.1);
    let (low, high) = (all().fold(1.0, f64::min), all().fold(0.0, f64::max));
    let mut chart = Chart::new(
        "standard deviation of the noise (ms)",
        Axis::linear(0.0, 10.0, 5),
        "accuracy after 10 touches",
        Axis::percent((low * 10.0 - 0.5).floor() / 10.0, ((high * 10.0 + 0.5).ceil() / 10.0).min(1.0)),
    )
    .sized(660, 400);
    let mut data = Results::new(["method", "noise (ms)", "accuracy", "smoothed"]);
    for ((method, name), raw) in METHODS.iter().enumerate().zip(raws) {
        let trials = context.settings.many_groups * folds.len() * context.objects.len();
        let smooth = smoothed(&raw, trials);
        for (point, smooth) in raw.iter().zip(&smooth) {
            let [raw, smooth] = [point.1, smooth.1].map(|share| Value::Percent(share, 1));
            data.push(row![*name, Value::Number(point.0, 2), raw, smooth]);
        }
        chart.marks.push(Mark::Dots { points: raw, color: COLORS[method], shape: SHAPES[method] });
        chart.line(name, COLORS[method], Stroke::Solid, &smooth);
    }
    let title = "Accuracy after ten touches against noise, over all objects (figure 12)";
    let caption = smoothed_by(context.settings.deviations().len());
    Ok(Figure::new("noise", title, caption, data).drawn(vec![chart.svg()?]))
}

fn objects(context: &Context, folds: &[Fold]) -> Result<Figure> {
    let mut data = Results::new(["object", "method", "noise (ms)", "accuracy", "smoothed"]);
    let mut panels = Vec::new();
    for (position, name) in context.names().iter().enumerate() {
        let mut chart = Chart::new("noise (ms)", Axis::linear(0.0, 10.0, 5), "", Axis::share())
            .sized(280, 200)
            .titled(name.as_str());
        for (method, label) in ["paper", "ours", "for noise"].into_iter().enumerate() {
            let raw = over_levels(context, folds, method, |objects| objects[position]);
            let smooth = smoothed(&raw, context.settings.many_groups * folds.len());
            for (point, smooth) in raw.iter().zip(&smooth) {
                let [raw, smooth] = [point.1, smooth.1].map(|share| Value::Percent(share, 1));
                data.push(row![name, METHODS[method], Value::Number(point.0, 2), raw, smooth]);
            }
            chart.line("", COLORS[method], Stroke::Thin, &raw);
            let stroke = if method == 0 { Stroke::Dashed } else { Stroke::Solid };
            chart.line(label, COLORS[method], stroke, &smooth);
        }
        panels.push(chart.svg()?);
    }
    let caption = "Thin lines are measured, thick ones smoothed.";
    Ok(Figure::new("noise-objects", "The same for each object (figure 11)", caption, data).drawn(panels))
}

fn confusions(context: &Context, folds: &[Fold]) -> Result<Figure> {
    let methods = METHODS.into_iter().zip(COLORS).enumerate().map(|(method, (name, color))| {
        let matrices: Vec<&Vec<Vec<usize>>> = folds.iter().map(|fold| &fold.confusion[method]).collect();
        (name, name, color, normalized(&matrices))
    });
    let title = format!("Confusion matrix after ten touches with noise of {} ms (figure 13)", NOISE / 1e3);
    let caption = "Percentage of an object's groups (row) that were recognized as another (column).";
    confusion::figure(["noise-confusion", &title, caption], &context.names(), methods)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_shared::Touch;

    #[test]
    fn a_smoothed_line_does_not_say_85_percent_where_93_were_measured() {
        // A model that collapses under the least noise.
        let measured: Vec<(f64, f64)> =
            (0..41).map(|k| (f64::from(k) / 4.0, if k == 0 { 0.93 } else { 0.55 - f64::from(k) / 500.0 })).collect();
        let smooth = smoothed(&measured, 30_000);
        for (measured, smooth) in measured.iter().zip(&smooth) {
            assert!((measured.1 - smooth.1).abs() < 0.006, "{measured:?} {smooth:?}");
        }
        assert!((smoothed(&measured, 4)[0].1 - 0.93).abs() > 0.05, "the filter itself smooths more than that");
    }

    #[test]
    fn the_caption_of_a_smoothed_line_states_the_filter_of_so_many_levels() {
        for (levels, said) in
            [(41, "a cubic Savitzky–Golay filter over 11"), (6, "a quadratic Savitzky–Golay filter over 5")]
        {
            assert!(smoothed_by(levels).contains(said), "{}", smoothed_by(levels));
        }
        assert_eq!(smoothed_by(2), "Points are measured; lines join them.");
        let line: Vec<(f64, f64)> = [0.2, 0.9].into_iter().enumerate().map(|(k, share)| (k as f64, share)).collect();
        assert_eq!(smoothed(&line, 1_000), line);
    }

    #[test]
    fn the_ratio_falls_by_six_decibels_when_noise_doubles() {
        let touches = vec![Touch::from_micros([0, 30_000, 60_000]); 3];
        let object = ObjectTouches::new("fork", touches, palpate::touches::Source::Object);
        // A signal of 90 ms against a deviation of 3 · √3 ms.
        assert!((signal_to_noise(&object, 3.0) - 20.0 * (90.0 / 27f64.sqrt()).log10()).abs() < 1e-9);
        assert!((signal_to_noise(&object, 3.0) - signal_to_noise(&object, 6.0) - 20.0 * 2f64.log10()).abs() < 1e-9);
    }
}
