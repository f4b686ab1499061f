//! Cost of more objects, and its remedies: models of 20 to 256 objects, trained in different ways on the same
//! approaches.
//!
//! ```text
//! cargo run --release -p palpate --example growth -- 100 4000 30x6 30x6:i8 8x6:eta=0.5:i8 30x6:stages=10
//! ```
//!
//! The arguments are the numbers of objects ([`builtin::many`]; `20,50,100`), the approaches to each, half as many more of
//! which test, and the ways: rounds `x` depth, then any of
//!
//! | part | meaning |
//! |---|---|
//! | `eta=0.5` | the share of each tree that is added; 0.3 |
//! | `weight=5` | the least sum of second derivatives in a leaf; 30 |
//! | `bins=48` | the most bins of a feature |
//! | `i8` | leaves of one byte instead of two |
//! | `size` | the smallest layout instead of the balanced one |
//! | `patterns` | tables instead of trees |
//! | `stages=10` | two stages: ten groups of objects that touches mix up, then a model for each group |

use palpate::capture;
use palpate::compile::{self, Compiled, Goal, Layout, Leaf};
use palpate::ensemble::train::{self, train};
use palpate::ensemble::{Ensemble, OverTouches};
use palpate::evaluate::{Candidate, Margins, SequentialSettings};
use palpate::mesh::builtin;
use palpate::onboard::{Model, Recognizer, Refused, Stopping, Verdict};
use palpate::shared::Touch;
use palpate::touches::{Dataset, ObjectTouches, Origin};
use rayon::prelude::*;
use std::error::Error;
use std::time::Instant;

type Failed = Box<dyn Error + Send + Sync>;

/// The error rate that recognizers stop at.
const ERROR_RATE: f64 = 0.01;
/// Touches after which they give up.
const LIMIT: u32 = 400;
/// Sequences of approaches, of all objects together.
const SEQUENCES: usize = 5_000;

fn main() -> Result<(), Failed> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // Small enough for a test of this program.
    let usual = ["12", "300", "4x3", "4x3:i8", "4x3:stages=3"].map(String::from);
    let arguments = if arguments.is_empty() { usual.to_vec() } else { arguments };
    let [counts, approaches, ways @ ..] = &arguments[..] else {
        return Err("give objects, approaches and ways".into());
    };
    let counts: Vec<usize> = counts.split(',').map(str::parse).collect::<Result<_, _>>()?;
    let approaches: u64 = approaches.parse()?;
    let began = Instant::now();
    let objects = builtin::many(counts.iter().copied().max().unwrap_or(0))?;
    let made = began.elapsed().as_secs_f64();
    let began = Instant::now();
    let origin = Origin { touches: approaches + approaches / 2, approaches: true, ..Origin::default() };
    let (data, _) = capture::in_memory(&objects, &origin.into(), &())?;
    let touched = began.elapsed().as_secs_f64();
    println!(
        "{} objects made in {made:.1} s, approached {approaches} times each, and half as often to test, in {touched:.1} s",
        objects.len()
    );
    for count in counts {
        let names: Vec<&str> = objects[..count].iter().map(|object| object.name.as_str()).collect();
        let part = |from: usize, to: usize| {
            let known = data.objects.iter().filter(|object| names.contains(&object.name.as_str()));
            let part = |object: &ObjectTouches| object.select(from..to.min(object.len()));
            Dataset { origin: data.origin.clone(), ..Dataset::new(known.map(part).collect()) }
        };
        let train = usize::try_from(approaches)?;
        compare(ways, &part(0, train), &part(train, usize::MAX))?;
    }
    Ok(())
}

/// Measures every way on the same approaches.
fn compare(ways: &[String], data: &Dataset, test: &Dataset) -> Result<(), Failed> {
    println!(
        "\n{} objects\n{:34} {:>9} {:>9} {:>8} {:>7} {:>7} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>7}",
        data.objects.len(),
        "way",
        "bytes",
        "M4F",
        "layout",
        "leaves",
        "error",
        "train",
        "at 20",
        "at 60",
        "at 200",
        "stops",
        "wrong",
        "undec."
    );
    let mut before = None;
    for way in ways {
        let Measured { bytes, instructions, leaves, margin_error, layout, seconds, accuracy, stops, wrong, undecided } =
            Way::new(way)?.measure(data, test, &mut before)?;
        let [at_20, at_60, at_200] = accuracy.map(|share| 100.0 * share);
        println!(
            "{way:34} {bytes:>9} {instructions:>9} {layout:>8} {leaves:>7} {margin_error:>7.4} {seconds:>6.1} \
             {at_20:>6.1} {at_60:>6.1} {at_200:>6.1} {stops:>6.1} {:>6.2} {:>7.2}",
            100.0 * wrong,
            100.0 * undecided
        );
    }
    Ok(())
}

/// The ensemble that was trained last, how, and the seconds that it took: the next way may be the same training.
type Before = Option<(train::Settings, Ensemble, f64)>;

/// One way of making a model.
struct Way {
    settings: train::Settings,
    compile: compile::Settings,
    stages: Option<usize>,
}

/// Cost and accuracy of a model.
struct Measured {
    bytes: usize,
    instructions: u64,
    leaves: usize,
    margin_error: f32,
    layout: &'static str,
    seconds: f64,
    accuracy: [f64; 3],
    /// Approaches to a verdict.
    stops: f64,
    wrong: f64,
    undecided: f64,
}

impl Way {
    fn new(words: &str) -> Result<Self, Failed> {
        let mut parts = words.split(':');
        let (rounds, depth) = parts.next().and_then(|part| part.split_once('x')).ok_or("ROUNDSxDEPTH first")?;
        let (rounds, depth) = (rounds.parse()?, depth.parse()?);
        let mut settings = train::Settings { rounds, depth, ..train::Settings::compact() };
        let mut compile = compile::Settings { max_touches: LIMIT, error_rate: ERROR_RATE, ..Default::default() };
        let mut stages = None;
        for part in parts {
            match part.split_once('=').unwrap_or((part, "")) {
                ("eta", value) => settings.eta = value.parse()?,
                ("weight", value) => settings.min_child_weight = value.parse()?,
                ("bins", value) => settings.bins = value.parse()?,
                ("i8", "") => compile.leaf = Leaf::I8,
                ("size", "") => compile.goal = Goal::Size,
                ("patterns", "") => compile.layout = Some(Layout::Patterns),
                ("stages", value) => stages = Some(value.parse()?),
                _ => return Err(format!("{part}: not a part of a way").into()),
            }
        }
        Ok(Self { settings, compile, stages })
    }

    fn measure(&self, data: &Dataset, test: &Dataset, before: &mut Before) -> Result<Measured, Failed> {
        match self.stages {
            Some(groups) => self.in_stages(groups, data, test),
            None => self.flat(data, test, before),
        }
    }

    fn flat(&self, data: &Dataset, test: &Dataset, before: &mut Before) -> Result<Measured, Failed> {
        let (_, ensemble, seconds) = match before.take() {
            Some(same) if same.0 == self.settings => before.insert(same),
            _ => {
                let began = Instant::now();
                let ensemble = train(data, &self.settings, &())?;
                before.insert((self.settings.clone(), ensemble, began.elapsed().as_secs_f64()))
            }
        };
        let compiled = compile::compile(ensemble, &self.compile)?;
        let model = Model::new(&compiled.bytes)?;
        let margins = Margins::new(Candidate::Compiled(&model), test)?;
        let sequences = SEQUENCES / test.objects.len() + 1;
        let settings = SequentialSettings { error_rate: None, max_touches: None, sequences, seed: 1 };
        let at = [20, 60, 200].map(|at| at.min(margins.fewest_approaches()));
        let measured = margins.approaches(&at, &settings)?;
        let sequential = &measured.sequential;
        Ok(Measured {
            bytes: compiled.bytes.len(),
            instructions: compiled.instructions.m4f,
            margin_error: compiled.margin_error,
            layout: compiled.layout.name(),
            leaves: compiled.leaves,
            seconds: *seconds,
            accuracy: at.map(|at| measured.accuracy[&at]),
            stops: sequential.mean().value,
            wrong: sequential.error,
            undecided: sequential.undecided,
        })
    }

    /// First the group, then the object: a model of the groups, and one for each. The touches that told the group are kept
    /// and tell the object as well.
    fn in_stages(&self, groups: usize, data: &Dataset, test: &Dataset) -> Result<Measured, Failed> {
        let group_of = grouped(data, groups)?;
        let used = (0..groups).filter(|group| group_of.contains(group));
        let members: Vec<Vec<usize>> =
            used.map(|group| (0..group_of.len()).filter(|&object| group_of[object] == group).collect()).collect();
        let began = Instant::now();
        let trained = |data: &Dataset| -> Result<Compiled, Failed> {
            Ok(compile::compile(&train(data, &self.settings, &())?, &self.compile)?)
        };
        let pooled = members.iter().enumerate().map(|(group, members)| {
            let objects: Vec<ObjectTouches> = members.iter().map(|&object| data.objects[object].clone()).collect();
            ObjectTouches::joined(format!("group-{group:03}"), &objects)
        });
        let coarse = trained(&Dataset { origin: data.origin.clone(), ..Dataset::new(pooled.collect()) })?;
        let fine = members.iter().map(|members| -> Result<Option<Compiled>, Failed> {
            let objects = members.iter().map(|&object| data.objects[object].clone()).collect();
            let data = Dataset { origin: data.origin.clone(), ..Dataset::new(objects) };
            if members.len() > 1 { Ok(Some(trained(&data)?)) } else { Ok(None) }
        });
        let fine: Vec<Option<Compiled>> = fine.collect::<Result<_, _>>()?;
        let seconds = began.elapsed().as_secs_f64();
        let coarse_model = Model::new(&coarse.bytes)?;
        let fine_models = fine.iter().map(|fine| fine.as_ref().map(|fine| Model::new(&fine.bytes)).transpose());
        let fine_models: Vec<Option<Model<'_>>> = fine_models.collect::<Result<_, _>>()?;

        // Half of the error rate for each stage.
        let stopping = Stopping::new(ERROR_RATE / 2.0, LIMIT).ok_or("an error rate")?;
        let sequences = SEQUENCES / test.objects.len() + 1;
        let at = [20, 60, 200];
        let cases: Vec<(usize, usize)> =
            (0..test.objects.len()).flat_map(|object| (0..sequences).map(move |sequence| (object, sequence))).collect();
        let outcomes = cases.into_par_iter().map(|(object, sequence)| -> Result<_, Failed> {
            let touches = shuffled(test.objects[object].touches(), sequence as u64);
            let mut first = Recognizer::<256>::new(&coarse_model, stopping)?;
            let mut all = Recognizer::<256>::new(&coarse_model, Stopping::new(1e-12, u32::MAX).ok_or("a rate")?)?;
            let mut kept: Vec<Touch> = Vec::new();
            let (mut group, mut second, mut ended) = (None, None, None);
            let mut right_at = [0.0; 3];
            for (index, touch) in touches.iter().enumerate() {
                let approach = index + 1;
                if Refused::check(&coarse_model.trained_touches(), touch).is_ok() {
                    kept.push(*touch);
                    all.push(touch).map_err(|_| "refused")?;
                    if ended.is_none() && group.is_none() {
                        match first.push(touch).map_err(|_| "refused")? {
                            Verdict::Recognized { object: found, .. } => {
                                let found = usize::from(found);
                                group = Some(found);
                                match &fine_models[found] {
                                    None => ended = Some((approach, Some(members[found][0]))),
                                    Some(model) => {
                                        let mut recognizer = Recognizer::<256>::new(model, stopping)?;
                                        for touch in &kept {
                                            push(&mut recognizer, touch, &members[found], approach, &mut ended);
                                        }
                                        second = Some(recognizer);
                                    }
                                }
                            }
                            Verdict::GaveUp | Verdict::Unknown => ended = Some((approach, None)),
                            Verdict::Undecided => {}
                        }
                    } else if let (None, Some(recognizer), Some(group)) = (ended, &mut second, group) {
                        push(recognizer, touch, &members[group], approach, &mut ended);
                    }
                }
                if let Some(place) = at.iter().position(|&at| at == approach) {
                    // What would be named if it had to be now: the best of the best group.
                    let best = all.best();
                    let named = match &fine_models[best] {
                        None => members[best][0],
                        Some(model) => {
                            let never = Stopping::new(1e-12, u32::MAX).ok_or("a rate")?;
                            let mut recognizer = Recognizer::<256>::new(model, never)?;
                            kept.iter().for_each(|touch| _ = recognizer.push(touch));
                            members[best][recognizer.best()]
                        }
                    };
                    right_at[place] = f64::from(u8::from(named == object));
                }
                if ended.is_some() && approach >= at[2] {
                    break;
                }
            }
            let (approaches, named) = ended.unwrap_or((touches.len(), None));
            let wrong = named.is_some_and(|named| named != object);
            Ok((right_at, approaches as f64, f64::from(u8::from(wrong)), f64::from(u8::from(named.is_none()))))
        });
        let outcomes: Vec<Outcome> = outcomes.collect::<Result<_, _>>()?;
        let mean = |value: &dyn Fn(&Outcome) -> f64| outcomes.iter().map(value).sum::<f64>() / outcomes.len() as f64;
        let all = || fine.iter().flatten();
        Ok(Measured {
            bytes: coarse.bytes.len() + all().map(|fine| fine.bytes.len()).sum::<usize>(),
            // Both stages see every touch.
            instructions: coarse.instructions.m4f
                + all().map(|fine| fine.instructions.m4f).sum::<u64>() / all().count().max(1) as u64,
            margin_error: coarse.margin_error,
            layout: coarse.layout.name(),
            leaves: coarse.leaves + all().map(|fine| fine.leaves).sum::<usize>(),
            seconds,
            accuracy: [0, 1, 2].map(|place| mean(&|outcome| outcome.0[place])),
            stops: mean(&|outcome| outcome.1),
            wrong: mean(&|outcome| outcome.2),
            undecided: mean(&|outcome| outcome.3),
        })
    }
}

/// Share of groups whose best object was right after each number of approaches; mean approaches; share of wrong
/// verdicts; share undecided.
type Outcome = ([f64; 3], f64, f64, f64);

/// Tells the second stage a touch, unless it has ended.
fn push(
    recognizer: &mut Recognizer<'_, 256>,
    touch: &Touch,
    members: &[usize],
    approach: usize,
    ended: &mut Option<(usize, Option<usize>)>,
) {
    if ended.is_some() {
        return;
    }
    match recognizer.push(touch) {
        Ok(Verdict::Recognized { object, .. }) => *ended = Some((approach, Some(members[usize::from(object)]))),
        Ok(Verdict::GaveUp | Verdict::Unknown) => *ended = Some((approach, None)),
        Ok(Verdict::Undecided) | Err(_) => {}
    }
}

/// Touches in another order for each sequence.
fn shuffled(touches: &[Touch], sequence: u64) -> Vec<Touch> {
    let mut touches = touches.to_vec();
    let mut state = sequence.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x2545_f491_4f6c_dd1d;
    for index in (1..touches.len()).rev() {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        touches.swap(index, (state >> 33) as usize % (index + 1));
    }
    touches
}

/// The group of each object: objects whose touches get similar margins, by k-means with a start far apart.
fn grouped(data: &Dataset, groups: usize) -> Result<Vec<usize>, Failed> {
    let quick = train(data, &train::Settings { rounds: 3, depth: 5, ..train::Settings::compact() }, &())?;
    let trained = quick.trained_touches();
    let means: Vec<Vec<f64>> = (data.objects.par_iter())
        .map(|object| {
            let used = object.touches().iter().filter(|touch| Refused::check(&trained, touch).is_ok()).take(500);
            let mut sum = vec![0.0; data.objects.len()];
            for touch in used {
                let margins = quick.margins(touch);
                let mean = margins.iter().sum::<f32>() / margins.len() as f32;
                sum.iter_mut().zip(&margins).for_each(|(sum, margin)| *sum += f64::from(margin - mean) / 500.0);
            }
            sum
        })
        .collect();
    let distance = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
    let mut centers = vec![means[0].clone()];
    while centers.len() < groups {
        let nearest =
            |mean: &Vec<f64>| centers.iter().map(|center| distance(center, mean)).fold(f64::INFINITY, f64::min);
        let farthest = means.iter().max_by(|a, b| nearest(a).total_cmp(&nearest(b))).ok_or("no object")?;
        centers.push(farthest.clone());
    }
    let mut group_of = Vec::new();
    for _ in 0..30 {
        let nearest = |mean: &Vec<f64>| {
            (0..groups)
                .min_by(|&a, &b| distance(&centers[a], mean).total_cmp(&distance(&centers[b], mean)))
                .unwrap_or(0)
        };
        group_of = means.iter().map(nearest).collect();
        for (group, center) in centers.iter_mut().enumerate() {
            let own: Vec<&Vec<f64>> =
                means.iter().zip(&group_of).filter(|(_, of)| **of == group).map(|(mean, _)| mean).collect();
            if !own.is_empty() {
                *center = (0..means.len())
                    .map(|at| own.iter().map(|mean| mean[at]).sum::<f64>() / own.len() as f64)
                    .collect();
            }
        }
    }
    Ok(group_of)
}
