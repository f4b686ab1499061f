//! The limit: the best that any classifier could do with the curvature descriptor, and how far each model is from it.

use super::context::{Context, compiled, compiled_f32};
use super::density::{CELLS, density_model};
use super::settings::Settings;
use super::statistics::z95;
use crate::page::axis::Axis;
use crate::page::chart::{Chart, Shape, Stroke};
use crate::page::color;
use crate::page::document::{Figure, Section};
use palpate::compile;
use palpate::ensemble::Ensemble;
use palpate::error::Result;
use palpate::evaluate::Margins;
use palpate::onboard::Model;
use palpate::results::{Results, Value};
use palpate::touches::Dataset;
use palpate::wording::{count, decimal};
use palpate::{row, with};
use palpate_shared::Descriptor;

/// The longest groups.
const MOST: usize = 60;
/// Numbers of touches in the table.
const AT: [usize; 5] = [5, 10, 20, 30, 60];
/// Percent of the capture that are trained on, and that the kernel's width is chosen on; the others test.
const PARTS: [usize; 2] = [85, 5];
/// Depth of the large ensemble's trees.
const DEPTH: usize = 7;

/// Results of the large capture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Limit {
    /// Full touches captured of each object.
    pub(super) captured: usize,
    /// Groups per object.
    pub(super) groups: usize,
    /// Kernel width of the density estimate, in cells.
    pub(super) width: f64,
    /// All candidates on the same groups.
    pub(super) candidates: Vec<Measured>,
    /// Index of the limit among them: the best of those trained on the whole capture, or ours if it is better.
    pub(super) best: usize,
}

/// One candidate's accuracies on the groups of the large capture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Measured {
    /// Its name.
    pub(super) name: String,
    /// Accuracy after 1, 2, … touches.
    pub(super) curve: Vec<f64>,
    /// Groups right after ten touches, in one order for all candidates.
    pub(super) right_at_10: Vec<bool>,
}

/// Indices of [`Limit::candidates`].
pub(super) const PAPER: usize = 0;
/// Our model, compiled.
pub(super) const OURS: usize = 1;
const ENSEMBLE: usize = 2;
const DENSITY: usize = 3;
const ENSEMBLE_HALF: usize = 4;
const DENSITY_HALF: usize = 5;

/// The large capture, divided.
pub(super) struct Large {
    pub(super) train: Dataset,
    pub(super) held: Dataset,
    pub(super) test: Dataset,
}

/// Captures again, with another seed than that of the folds' touches.
pub(super) fn large(context: &Context) -> Result<Large> {
    let all = context.settings.limit_touches;
    let touched = context.touch(all, context.settings.seed.wrapping_add(0x11_1117))?;
    let part = |range: std::ops::Range<usize>| {
        Dataset::new(touched.iter().map(|(object, _)| object.part(range.clone(), 100)).collect())
    };
    let [train, held] = PARTS;
    Ok(Large { train: part(0..train), held: part(train..train + held), test: part(train + held..100) })
}

/// Touches of each object of the large capture that are tested on.
pub(super) fn tested(settings: &Settings) -> usize {
    settings.limit_touches - settings.limit_touches * (PARTS[0] + PARTS[1]) / 100
}

/// The first half of each object's touches.
fn half(data: &Dataset) -> Dataset {
    data.each(|object| object.part(0..1, 2))
}

/// Estimates the limit and tests the first fold's models on the same groups.
pub(super) fn measure(context: &Context, large: &Large) -> Result<Limit> {
    let settings = context.settings;
    let large_ensemble =
        with!(context.ours(), rounds = settings.limit_rounds, depth = DEPTH, eta = 0.1, min_child_weight = 100.0);
    let halved = half(&large.train);
    let (density, width) = density_model(Descriptor::Curvature, &large.train, &large.held)?;
    let (density_half, _) = density_model(Descriptor::Curvature, &halved, &large.held)?;
    let ensemble = context.train(&large.train, &large_ensemble)?;
    let ensemble_half = context.train(&halved, &large_ensemble)?;
    let models = context.models()?;
    let bytes = [compiled_f32(&models.paper)?.bytes, compiled(&models.ours)?.bytes];
    let [paper, ours] = [compile::open(&bytes[0])?, compile::open(&bytes[1])?];

    let groups = settings.limit_groups;
    let measured = |name: &str, model: &Model<'_>| -> Result<Measured> {
        let margins = Margins::new(model, &large.test)?;
        let curve = margins.curve(MOST, groups, settings.seed)?;
        let right = margins.confidences(10, groups, settings.seed)?;
        Ok(Measured {
            name: name.into(),
            curve: (1..=MOST).map(|n| curve.accuracy(n).value).collect(),
            right_at_10: right.into_iter().map(|confidence| confidence.correct).collect(),
        })
    };
    let exact = |name: &str, ensemble: &Ensemble| measured(name, &compile::exact(ensemble)?.model());
    let candidates = vec![
        measured("paper's method", &paper)?,
        measured("ours", &ours)?,
        exact("large ensemble", &ensemble)?,
        exact("density estimate", &density)?,
        exact("large ensemble, half the capture", &ensemble_half)?,
        exact("density estimate, half the capture", &density_half)?,
    ];
    let at_10 = |index: usize| candidates[index].curve[9];
    let better = |a: usize, b: usize| if at_10(b) > at_10(a) { b } else { a };
    let best = better(better(ENSEMBLE, DENSITY), OURS);
    Ok(Limit { captured: settings.limit_touches, groups, width, candidates, best })
}

impl Limit {
    /// Difference between the limit's accuracy after ten touches and a candidate's, and the 95 % interval of the paired
    /// difference over groups.
    pub(super) fn gap_at_10(&self, candidate: usize) -> (f64, f64, f64) {
        let (limit, other) = (&self.candidates[self.best].right_at_10, &self.candidates[candidate].right_at_10);
        let differences: Vec<f64> =
            limit.iter().zip(other).map(|(&a, &b)| f64::from(u8::from(a)) - f64::from(u8::from(b))).collect();
        let (mean, deviation) = super::statistics::mean_deviation(&differences);
        let half = z95() * deviation / (differences.len().max(1) as f64).sqrt();
        (mean, mean - half, mean + half)
    }

    /// Change of the limit's accuracy after ten touches from doubling the capture.
    pub(super) fn doubling(&self) -> f64 {
        let (whole, half) = if self.best == DENSITY { (DENSITY, DENSITY_HALF) } else { (ENSEMBLE, ENSEMBLE_HALF) };
        self.candidates[whole].curve[9] - self.candidates[half].curve[9]
    }
}

/// The figure and the table.
pub(super) fn section(context: &Context, limit: &Limit) -> Result<Section> {
    let mut section = Section::new("limit", "The limit");
    let [trained, held] = PARTS;
    section.text(format!(
        "This section estimates the best accuracy that any classifier could reach. {} full touches of each object were \
         captured separately. On {trained} % of them a large ensemble was trained ({} multi-output trees of depth {DEPTH}), \
         and the density of each object's touches over the two features of the curvature descriptor was estimated (a grid of \
         {CELLS} × {CELLS} ranks, smoothed by a Gaussian kernel {} cells wide, mirrored at the borders, the width chosen on \
         {held} % held out). The limit is the better of the two (or our own model, if it is better than both), here: {}, on \
         groups from the remaining {} %. Doubling the capture changed the estimate by {} points after ten touches.",
        count(limit.captured),
        context.settings.limit_rounds,
        decimal(limit.width, 1),
        limit.candidates[limit.best].name,
        100 - trained - held,
        decimal(limit.doubling() * 100.0, 2)
    ));
    section.text(
        "The limit holds for the paper's descriptor too: the row of fingers is rolled at random, so a touch and its mirror \
         image are equally likely for every object, and the curvature descriptor keeps all but the mirror image.",
    );
    section.figure(figure(limit)?);
    section.figure(table(context, limit));
    Ok(section)
}

fn figure(limit: &Limit) -> Result<Figure> {
    let mut chart =
        Chart::new("touches", Axis::logarithmic(1.0, MOST as f64), "accuracy", Axis::share()).sized(620, 400);
    let mut data = Results::new(["model", "touches", "accuracy"]);
    for candidate in &limit.candidates {
        for (index, &accuracy) in candidate.curve.iter().enumerate() {
            data.push(row![&candidate.name, index + 1, Value::Percent(accuracy, 2)]);
        }
    }
    let points = |index: usize| -> Vec<(f64, f64)> {
        (1..).map(f64::from).zip(limit.candidates[index].curve.iter().copied()).collect()
    };
    chart.line("limit", color::INK, Stroke::Dashed, &points(limit.best));
    let marked = [1, 2, 3, 5, 7, 10, 14, 20, 30, 42, 60];
    let few = |index| -> Vec<(f64, f64)> { marked.iter().map(|&n| points(index)[n - 1]).collect() };
    chart.series("ours", color::OURS, Shape::Disc, &few(OURS));
    chart.series("paper", color::PAPER, Shape::Ring, &few(PAPER));
    let caption = format!("{} groups per object, the same for all.", count(limit.groups));
    let title = "Accuracy against touches, and the best possible";
    Ok(Figure::new("limit-curves", title, caption, data).drawn(vec![chart.svg()?]))
}

fn table(context: &Context, limit: &Limit) -> Figure {
    let columns = AT.iter().map(|n| format!("at {n}"));
    let mut data = Results::new(
        std::iter::once("model".to_string())
            .chain(columns)
            .chain(["behind the limit at 10 (points)".into(), "95 % interval".into()]),
    );
    for (index, candidate) in limit.candidates.iter().enumerate() {
        let (gap, low, high) = limit.gap_at_10(index);
        let name = if index == limit.best { format!("{} (the limit)", candidate.name) } else { candidate.name.clone() };
        let accuracies = AT.iter().map(|&n| Value::Percent(candidate.curve[n - 1], 1));
        let [low, high] = [low, high].map(|value| decimal(value * 100.0, 1));
        let interval = (index != limit.best).then(|| format!("{low} to {high}"));
        data.push(row![name].into_iter().chain(accuracies).chain(row![Value::Number(gap * 100.0, 1), interval]));
    }
    let caption = format!(
        "Accuracies on the same {} groups per object; gaps are paired over groups. One standard error of an accuracy is at most {} \
         points.",
        count(limit.groups),
        decimal(50.0 / ((limit.groups * context.objects.len()) as f64).sqrt(), 1)
    );
    Figure::new("limit", "Gaps to the limit", caption, data)
}
