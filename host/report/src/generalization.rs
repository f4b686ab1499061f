//! Generalization: recognizing a fork that was never touched by the touches of other forks.

use super::context::{Context, compiled, touch};
use super::statistics::mean_deviation;
use crate::page::axis::Axis;
use crate::page::chart::{Chart, Mark, Shape};
use crate::page::color;
use crate::page::document::{Figure, Section};
use crate::page::table::{Cell, Records};
use palpate::compile;
use palpate::error::Result;
use palpate::evaluate::{Candidate, Margins};
use palpate::mesh::Object;
use palpate::probe::scene::Scene;
use palpate::touches::{Dataset, ObjectTouches, Origin};
use palpate::wording::{count, counted};
use serde::{Deserialize, Serialize};

/// Numbers of touches looked at.
const AT: [usize; 2] = [10, 30];

/// Accuracy of training on a number of instances of each kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Instances {
    /// Number of instances of each kind that were trained on.
    pub(super) count: usize,
    /// For each of [`AT`], for each test instance: accuracy over all kinds.
    pub(super) unseen: Vec<Vec<f64>>,
    /// For each of [`AT`]: accuracy on other touches of the instances trained on.
    pub(super) seen: Vec<f64>,
}

/// Trains on more and more instances; tests on instances that no training touched.
pub(super) fn measure(context: &Context) -> Result<Vec<Instances>> {
    let settings = context.settings;
    let most = settings.instances.iter().copied().max().unwrap_or(1);
    let kinds = context.kinds()?;
    let (train, test) = (&kinds[..most], &kinds[kinds.len() - settings.test_instances..]);
    let tested = test.iter().map(|objects| touched(context, objects, settings.instance_touches / 4));
    let tested: Vec<Dataset> = tested.collect::<Result<_>>()?;
    // Instance k's touches, as many as training on it alone takes, and some more to test on.
    let count = settings.instance_touches;
    let felt = train.iter().map(|objects| touched(context, objects, count + count / 4));
    let felt: Vec<Dataset> = felt.collect::<Result<_>>()?;

    let of = |&instances: &usize| -> Result<Instances> {
        // The same number of touches of a kind, however many instances share it.
        let gathered = (0..felt[0].objects.len()).map(|kind| {
            let parts = felt[..instances].iter().map(|data| data.objects[kind].select(0..count / instances));
            ObjectTouches::joined(&felt[0].objects[kind].name, &parts.collect::<Vec<_>>())
        });
        let training = Dataset::new(gathered.collect());
        let ensemble = context.train(&training, &context.ours())?;
        let bytes = compiled(&ensemble)?.bytes;
        let model = compile::open(&bytes)?;
        let accuracies = |data: &Dataset| -> Result<Vec<f64>> {
            let curve =
                Margins::new(Candidate::Compiled(&model), data)?.curve(30, settings.many_groups, settings.seed)?;
            Ok(AT.iter().map(|&at| curve.accuracy(at).value).collect())
        };
        let unseen: Vec<Vec<f64>> = tested.iter().map(&accuracies).collect::<Result<_>>()?;
        // Groups of a seen kind stay within one instance too.
        let seen = (0..instances).map(|k| accuracies(&felt[k].each(|object| object.select(count..object.len()))));
        let seen: Vec<Vec<f64>> = seen.collect::<Result<_>>()?;
        let column = |rows: &[Vec<f64>], index: usize| rows.iter().map(|row| row[index]).collect::<Vec<f64>>();
        Ok(Instances {
            count: instances,
            unseen: (0..AT.len()).map(|index| column(&unseen, index)).collect(),
            seen: (0..AT.len()).map(|index| mean_deviation(&column(&seen, index)).0).collect(),
        })
    };
    settings.instances.iter().map(of).collect()
}

fn touched(context: &Context, objects: &[Object], count: usize) -> Result<Dataset> {
    let origin = Origin { seed: context.settings.seed, ..Origin::default() };
    let one = |object: &Object| {
        let scene = Scene::new(object.mesh(), origin.length)?;
        Ok(touch(&[scene], &object.name, count, &origin, context.progress)?.0)
    };
    let mut objects: Vec<ObjectTouches> = objects.iter().map(one).collect::<Result<_>>()?;
    objects.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(Dataset::new(objects))
}

/// The figure.
pub(super) fn section(context: &Context, results: &[Instances]) -> Result<Section> {
    let settings = context.settings;
    let mut section = Section::new("generalization", "Objects never touched");
    section.text(format!(
        "Our method was trained on some instances of each built-in kind, of varied proportions, and tested on {} of each that \
         it never touched. Each kind has the same number of touches ({}), however many instances share them.",
        counted(settings.test_instances, "other", "others"),
        count(settings.instance_touches)
    ));
    let most = results.iter().map(|result| result.count as f64).fold(2.0, f64::max);
    let ticks = results.iter().map(|result| (result.count as f64, result.count.to_string())).collect();
    let scale = Axis::logarithmic(1.0, most).with_ticks(ticks);
    let mut chart = Chart::new("instances of each kind in training", scale, "accuracy", Axis::share()).sized(620, 400);
    let mut data = Records::new(["instances", "touches", "accuracy, never touched", "accuracy, trained on"]);
    for (index, at) in AT.iter().enumerate() {
        let (color, shape) = [(color::OURS, Shape::Disc), (color::GREEN, Shape::Triangle)][index];
        let (mut unseen, mut spread, mut seen) = (Vec::new(), Vec::new(), Vec::new());
        for result in results {
            let (mean, deviation) = mean_deviation(&result.unseen[index]);
            let x = result.count as f64;
            unseen.push((x, mean));
            spread.push((x, mean - deviation, mean + deviation));
            seen.push((x, result.seen[index]));
            data.push([
                Cell::count(result.count),
                Cell::count(*at),
                Cell::PercentSpread(mean, deviation, 1),
                Cell::Percent(result.seen[index], 1),
            ]);
        }
        chart.marks.push(Mark::Spread { points: spread, color });
        chart.series(&format!("new, {at} touches"), color, shape, &unseen);
        chart.line(&format!("known, {at} touches"), color, crate::page::chart::Stroke::Dashed, &seen);
    }
    section.figure(Figure {
        id: "generalization".into(),
        title: "Accuracy against the number of training instances".into(),
        caption: "Solid: instances never touched. Dashed: other touches of the instances trained on. Bars are one \
                  standard deviation over instances. Each group of touches is of one instance."
            .into(),
        command: settings.command.clone(),
        panels: vec![chart.svg()?],
        data,
    });
    Ok(section)
}
