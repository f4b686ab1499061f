//! Cross-validation: accuracy against the number of touches, and confusion (the paper's figures 8 and 9).

use super::confusion::{self, mean, normalized, recall_precision};
use super::context::{Context, compiled, compiled_f32};
use super::run_page::method_style;
use super::statistics::{LEAST_GROUPS, largest_group, mean_deviation};
use crate::page::axis::Axis;
use crate::page::chart::{Chart, Mark, Stroke};
use crate::page::color;
use crate::page::document::{Figure, Section};
use palpate::compile;
use palpate::ensemble::train;
use palpate::error::Result;
use palpate::evaluate::Margins;
use palpate::results::{Results, Value};
use palpate::row;
use palpate::wording::{count, counted};
use std::time::Instant;

/// The methods compared, in the order of [`Fold::methods`].
pub(super) const METHODS: [&str; 2] = ["paper", "ours"];

/// The longest groups.
pub(super) const MOST: usize = 120;

/// Groups per object in the paper.
pub(super) const PAPERS_GROUPS: usize = 10;

/// Touches after which confusion is shown.
const CONFUSED_AT: usize = 10;

/// Results of one fold.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Fold {
    /// One of each of [`METHODS`].
    pub(super) methods: Vec<MethodFold>,
}

/// Results of one fold for one method. Accuracies are after 1, 2, … touches, up to [`MOST`] or to as many as still make
/// [enough distinct groups](super::statistics::LEAST_GROUPS).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MethodFold {
    /// Accuracy over the paper's few groups per object.
    pub(super) few: Vec<f64>,
    /// Accuracies for each object.
    pub(super) few_of_object: Vec<Vec<f64>>,
    /// Accuracy over many groups.
    pub(super) many: Vec<f64>,
    /// Confusion matrix of the same groups: number of groups of each object (rows) recognized as each (columns) after
    /// [`CONFUSED_AT`] touches.
    pub(super) confusion: Vec<Vec<usize>>,
    /// Seconds of training.
    pub(super) seconds: f64,
}

/// Trains and tests both methods on every fold that is used.
pub(super) fn measure(context: &Context) -> Result<Vec<Fold>> {
    (0..context.settings.folds_used).map(|fold| one_fold(context, fold)).collect()
}

fn one_fold(context: &Context, fold: usize) -> Result<Fold> {
    let split = context.fold(fold)?;
    let timed = |settings: &train::Settings| -> Result<_> {
        let began = Instant::now();
        Ok((context.train(&split.train, settings)?, began.elapsed().as_secs_f64()))
    };
    let (paper, paper_seconds) =
        if fold == 0 { (context.models()?.paper.clone(), 0.0) } else { timed(&context.paper())? };
    let (ours, ours_seconds) = if fold == 0 { (context.models()?.ours.clone(), 0.0) } else { timed(&context.ours())? };
    let bytes = [compiled_f32(&paper)?.bytes, compiled(&ours)?.bytes];
    let [paper, ours] = [compile::open(&bytes[0])?, compile::open(&bytes[1])?];
    let settings = context.settings;
    let fewest = split.test.fewest_in_sequence();
    let most = MOST.min(largest_group(fewest));
    let tested = |model, seconds| -> Result<MethodFold> {
        let margins = Margins::new(model, &split.test)?;
        // Other folds draw other groups.
        let seed = settings.seed.wrapping_add(fold as u64);
        let few = margins.curve(most, settings.groups, seed)?;
        let many = margins.curve(most, settings.many_groups, seed)?;
        let of_object = |position| (1..=most).map(|n| few.object_accuracy(position, n).value).collect();
        Ok(MethodFold {
            few: (1..=most).map(|n| few.accuracy(n).value).collect(),
            few_of_object: (0..split.test.objects.len()).map(of_object).collect(),
            many: (1..=most).map(|n| many.accuracy(n).value).collect(),
            confusion: margins.confusion_of_first(CONFUSED_AT, most, settings.many_groups, seed)?,
            seconds,
        })
    };
    let paper = tested(&paper, paper_seconds)?;
    let ours = tested(&ours, ours_seconds)?;
    Ok(Fold { methods: vec![paper, ours] })
}

/// Accuracies of method `method` after `touches` touches over many groups, one for each fold.
pub(super) fn accuracies(folds: &[Fold], method: usize, touches: usize) -> Vec<f64> {
    folds.iter().filter_map(|fold| fold.methods[method].many.get(touches - 1).copied()).collect()
}

/// The confusion matrix of all folds together, as shares of each row.
pub(super) fn shares(folds: &[Fold], method: usize) -> Vec<Vec<f64>> {
    let matrices: Vec<&Vec<Vec<usize>>> = folds.iter().map(|fold| &fold.methods[method].confusion).collect();
    normalized(&matrices)
}

/// The figures and tables.
pub(super) fn section(context: &Context, folds: &[Fold]) -> Result<Section> {
    let mut section = Section::new("cross-validation", "Accuracy against touches");
    let settings = context.settings;
    section.text(format!(
        "Of {}, {} trained and tested; a fold's models never saw its test touches. {}{} of each number of touches were drawn \
         from each object's test touches; beside them, {} of each object for narrower intervals. Our method is the compiled \
         model, evaluated by the code that runs on the chip; the paper's is its ensemble with leaves in f32.",
        counted(settings.folds, "fold", "folds"),
        counted(settings.folds_used, "was", "were"),
        if settings.groups == PAPERS_GROUPS { "As in the paper, " } else { "" },
        counted(settings.groups, "group", "groups"),
        count(settings.many_groups)
    ));
    section.figure(overall(context, folds)?);
    section.figure(objects(context, folds)?);
    section.figure(confusions(context, folds)?);
    section.figure(recall(context, folds));
    Ok(section)
}

/// Mean and deviation over folds at a number of touches.
fn over_folds(folds: &[Fold], value: impl Fn(&Fold) -> Option<f64>) -> (f64, f64) {
    mean_deviation(&folds.iter().filter_map(value).collect::<Vec<_>>())
}

fn overall(context: &Context, folds: &[Fold]) -> Result<Figure> {
    let levels = context.settings.levels();
    let mut chart =
        Chart::new("touches", Axis::logarithmic(10.0, 120.0), "accuracy", Axis::percent(0.4, 1.0)).sized(620, 400);
    let mut data = Results::new(["method", "touches", "accuracy", "accuracy, many groups"]);
    for (index, name) in METHODS.iter().enumerate() {
        let (color, shape) = method_style(index);
        let mut points = Vec::new();
        let mut spread = Vec::new();
        for &n in &levels {
            let (mean, deviation) = over_folds(folds, |fold| fold.methods[index].few.get(n - 1).copied());
            let (many, many_deviation) = over_folds(folds, |fold| fold.methods[index].many.get(n - 1).copied());
            points.push((n as f64, mean));
            spread.push((n as f64, mean - deviation, (mean + deviation).min(1.0)));
            let many = Value::PercentSpread(many, many_deviation, 1);
            data.push(row![*name, n, Value::PercentSpread(mean, deviation, 1), many]);
        }
        chart.marks.push(Mark::Spread { points: spread, color });
        chart.series(name, color, shape, &points);
    }
    let caption = format!(
        "Bars are one standard deviation over folds, of {} groups per object. The CSV also has the same over {} groups per object. A \
         dash (–) means that an object's test touches make fewer than {LEAST_GROUPS} distinct groups.",
        context.settings.groups, context.settings.many_groups
    );
    let title = "Groups recognized, mean over folds (the paper's figure 8a)";
    Ok(Figure::new("accuracy", title, caption, data).drawn(vec![chart.svg()?]))
}

fn objects(context: &Context, folds: &[Fold]) -> Result<Figure> {
    let levels = context.settings.levels();
    let mut panels = Vec::new();
    let mut data = Results::new(["object", "method", "touches", "accuracy"]);
    for (position, name) in context.names().iter().enumerate() {
        let mut chart = Chart::new("touches", Axis::logarithmic(10.0, 120.0), "", Axis::share())
            .sized(270, 200)
            .titled(name.as_str());
        for (index, method) in METHODS.iter().enumerate() {
            let (color, _) = method_style(index);
            let mut points = Vec::new();
            for &n in &levels {
                let of = |fold: &Fold| fold.methods[index].few_of_object[position].get(n - 1).copied();
                let (mean, deviation) = over_folds(folds, of);
                points.push((n as f64, mean));
                data.push(row![name, *method, n, Value::PercentSpread(mean, deviation, 1)]);
            }
            let stroke = if index == 0 { Stroke::Dashed } else { Stroke::Solid };
            chart.line(method, color, stroke, &points);
        }
        panels.push(chart.svg()?);
    }
    let caption = "Mean over folds; the CSV has the standard deviations.";
    Ok(Figure::new("accuracy-objects", "The same for each object (figure 8b)", caption, data).drawn(panels))
}

fn confusions(context: &Context, folds: &[Fold]) -> Result<Figure> {
    let caption = format!(
        "Percentage of the groups of an object (row) that were recognized as another (column), all folds together, {} groups per \
         object and fold, the same as those of the accuracy over many groups. Shares below half a percent are blank.",
        count(context.settings.many_groups)
    );
    let drawn = [("the paper's method", color::PAPER), ("ours", color::OURS)];
    let methods = METHODS.into_iter().zip(drawn).enumerate();
    let methods = methods.map(|(index, (method, (title, color)))| (method, title, color, shares(folds, index)));
    let title = "Confusion matrix after ten touches (figure 9)";
    confusion::figure(["confusion", title, &caption], &context.names(), methods)
}

fn recall(context: &Context, folds: &[Fold]) -> Figure {
    let mut data = Results::new([
        "object",
        "recall, paper's method",
        "precision, paper's method",
        "recall, ours",
        "precision, ours",
    ]);
    let [paper, ours] = [0, 1].map(|method| recall_precision(&shares(folds, method)));
    let mut push = |name: &str, (paper, ours): ((f64, f64), (f64, f64))| {
        let [a, b, c, d] = [paper.0, paper.1, ours.0, ours.1].map(|share| Value::Percent(share, 1));
        data.push(row![name, a, b, c, d]);
    };
    for (name, both) in context.names().iter().zip(paper.iter().copied().zip(ours.iter().copied())) {
        push(name, both);
    }
    push("mean", (mean(&paper), mean(&ours)));
    let caption = "From the matrices above. With equally many groups of each object, mean recall is the accuracy. Click a heading to \
                   sort.";
    Figure::new("recall", "Recall and precision after ten touches", caption, data)
}
