//! Cost of more objects, and its remedies: models of 20 to 256 objects, trained in different ways on the same
//! approaches.
//!
//! ```text
//! cargo run --release -p palpate --example growth -- 100 4000 30x6 30x6:i8 8x6:eta=0.5:i8
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

use palpate::capture;
use palpate::compile::{self, Leaf};
use palpate::ensemble::Ensemble;
use palpate::ensemble::train::{self, train};
use palpate::evaluate::{Margins, SequentialSettings};
use palpate::mesh::builtin;
use palpate::onboard::Model;
use palpate::touches::{Dataset, ObjectTouches, Origin};
use palpate::with;
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
    let usual = ["12", "300", "4x3", "4x3:i8"].map(String::from);
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
            let part = |object: &ObjectTouches| object.part(from..to, object.len());
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
        Way::new(way)?.measure(way, data, test, &mut before)?;
    }
    Ok(())
}

/// The ensemble that was trained last, how, and the seconds that it took: the next way may be the same training.
type Before = Option<(train::Settings, Ensemble, f64)>;

/// One way of making a model.
struct Way {
    settings: train::Settings,
    compile: compile::Settings,
}

impl Way {
    fn new(words: &str) -> Result<Self, Failed> {
        let mut parts = words.split(':');
        let (rounds, depth) = parts.next().and_then(|part| part.split_once('x')).ok_or("ROUNDSxDEPTH first")?;
        let (rounds, depth) = (rounds.parse()?, depth.parse()?);
        let mut settings = with!(train::Settings::compact(), rounds, depth);
        let mut compile = with!(compile::Settings::default(), max_touches = LIMIT, error_rate = ERROR_RATE);
        for part in parts {
            match part.split_once('=').unwrap_or((part, "")) {
                ("eta", value) => settings.eta = value.parse()?,
                ("weight", value) => settings.min_child_weight = value.parse()?,
                ("bins", value) => settings.bins = value.parse()?,
                ("i8", "") => compile.leaf = Leaf::I8,
                _ => return Err(format!("{part}: not a part of a way").into()),
            }
        }
        Ok(Self { settings, compile })
    }

    /// Prints the cost and the accuracy of the model.
    fn measure(&self, way: &str, data: &Dataset, test: &Dataset, before: &mut Before) -> Result<(), Failed> {
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
        let margins = Margins::new(&model, test)?;
        let sequences = SEQUENCES / test.objects.len() + 1;
        let settings = SequentialSettings { error_rate: None, max_touches: None, sequences, seed: 1 };
        let at = [20, 60, 200].map(|at| at.min(margins.fewest_approaches()));
        let measured = margins.approaches(&at, &settings)?;
        let sequential = &measured.sequential;
        let [at_20, at_60, at_200] = at.map(|at| 100.0 * measured.accuracy[&at]);
        println!(
            "{way:34} {:>9} {:>9} {:>8} {:>7} {:>7.4} {seconds:>6.1} \
             {at_20:>6.1} {at_60:>6.1} {at_200:>6.1} {:>6.1} {:>6.2} {:>7.2}",
            compiled.bytes.len(),
            compiled.instructions.m4f,
            compiled.layout.name(),
            compiled.leaves,
            compiled.margin_error,
            sequential.mean().value,
            100.0 * sequential.error,
            100.0 * sequential.undecided
        );
        Ok(())
    }
}
