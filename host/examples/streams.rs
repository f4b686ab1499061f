//! Verdicts on sequences of rows: trees that learn rows, thresholds that keep a promise, and what a fixed number of rows
//! would take. On made-up streams, or on a file of sequences.
//!
//! ```text
//! cargo run --release -p palpate --example streams                          # three made-up streams
//! cargo run --release -p palpate --example streams -- rows.csv label id 5%  # a file: columns of label and sequence, promise
//! ```

use palpate::compile::{self, Settings, compile};
use palpate::ensemble::{Ensemble, Inputs, Output, Provenance};
use palpate::rows::{RowSequence, SequenceColumns, Sequences};
use palpate::stream::{self, Wanted};
use palpate::trees::train::{Parameters, Rows, train};
use palpate::with;
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};
use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::path::Path;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    if let [path, label, sequence, rest @ ..] = &words[..] {
        let percent = rest.first().map_or("5%", String::as_str).trim_end_matches('%').parse::<f64>()?;
        let (sequences, names) = read(Path::new(path), label, sequence)?;
        return report(path, &sequences, &names, percent / 100.0);
    }
    for (name, dependence) in [("independent rows", 0.0), ("rows that resemble each other (AR, 0.9)", 0.9)] {
        let (made, names) = made_up(dependence);
        report(name, &made, &names, 0.01)?;
    }
    Ok(())
}

/// A file's sequences, and the names of their classes.
fn read(path: &Path, label: &str, sequence: &str) -> Result<(Sequences, Vec<String>), Failure> {
    let text = std::fs::read_to_string(path)?;
    let mut lines = text.lines().map(|line| line.split(',').map(str::trim).collect::<Vec<_>>());
    let header = lines.next().ok_or("no header")?;
    let column = header.iter().position(|name| *name == label).ok_or("no such column")?;
    let names: BTreeSet<String> = lines.filter_map(|line| line.get(column).map(ToString::to_string)).collect();
    let names: Vec<String> = names.into_iter().collect();
    let features: Vec<&str> = header.iter().copied().filter(|name| *name != label && *name != sequence).collect();
    let columns = SequenceColumns { label: Some(label), sequence, group: None };
    Ok((Sequences::read(path, &features, &columns, &names)?, names))
}

/// Four classes that differ in two of three features, by less than a row's noise.
fn made_up(dependence: f64) -> (Sequences, Vec<String>) {
    let mut random = SmallRng::seed_from_u64(1);
    let mut normal = move || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
    let mut made = Sequences { features: 3, ..Sequences::default() };
    let length = if dependence > 0.0 { 200 } else { 40 };
    for number in 0..9_000 {
        let class = number % 4;
        let start = made.len();
        let mut state = [normal(), normal(), normal()];
        for _ in 0..length {
            for (feature, state) in state.iter_mut().enumerate() {
                *state = dependence * *state + (1.0 - dependence * dependence).sqrt() * normal();
                let place = [class & 1, class >> 1, 0][feature] as f64;
                made.values.push(place + *state);
            }
        }
        made.sequences.push(RowSequence { rows: start..start + length, class, group: None });
    }
    (made, ["a", "b", "c", "d"].map(String::from).to_vec())
}

/// Every third sequence, from this one on.
fn third(all: &Sequences, first: usize) -> Sequences {
    let sequences = all.sequences.iter().skip(first).step_by(3).cloned().collect();
    Sequences { sequences, ..all.clone() }
}

/// Trains on a third, calibrates on a third, and evaluates on the last.
fn report(name: &str, all: &Sequences, names: &[String], rate: f64) -> Result<(), Failure> {
    let [learned, calibrated, unseen] = [0, 1, 2].map(|first| third(all, first));
    let rows = || learned.sequences.iter().flat_map(|sequence| sequence.rows.clone().map(|row| (row, sequence.class)));
    let width = all.features;
    let features: Vec<f32> =
        rows().flat_map(|(row, _)| &all.values[row * width..(row + 1) * width]).map(|&value| value as f32).collect();
    let labels: Vec<u32> = rows().map(|(_, class)| class as u32).collect();
    let parameters = Parameters {
        multi_output: true,
        rounds: 40,
        depth: 4,
        eta: 0.15,
        min_child_weight: 5.0,
        bins: 64,
        base_margin: 0.0,
    };
    let rows = Rows { features: &features, columns: width, labels: &labels, weights: None };
    let (base_margins, trees) = train(rows, names.len(), &parameters, None, &|| ControlFlow::Continue(()))?;
    debug_assert!(trees.iter().all(|tree| tree.output == Output::Each));
    let objects = names.to_vec();
    let ensemble =
        Ensemble { inputs: Inputs::unnamed(width), objects, base_margins, trees, origin: Provenance::default() };
    let bytes = compile(&ensemble, &Settings::default())?.bytes;
    let settings = with!(stream::Settings::default(), rate);
    let found = stream::calibrate(&compile::open(&bytes)?, &calibrated, &settings, &())?;
    let sure = compile::open(&found.model)?;
    let evaluated = stream::evaluate(&sure, &unseen, &Wanted::default())?;
    println!("{name}: {} sequences of {} classes, {} rows", all.sequences.len(), names.len(), all.len());
    if let Some(shape) = &found.rows {
        println!("  table {:?}\n  weights {:?}", shape.row_evidence, shape.weights);
    }
    println!(
        "  promised {:.0} %; of {} unseen sequences {:.2} % of the names wrong, {:.1} % without one, {:.1} rows",
        100.0 * rate,
        unseen.sequences.len(),
        100.0 * evaluated.error,
        100.0 * evaluated.undecided,
        evaluated.mean_rows
    );
    let fewer = |rows: Option<f64>| match rows {
        Some(rows) => {
            format!("{rows:.1} rows, early stopping {:.0} % fewer", 100.0 * (1.0 - evaluated.mean_rows / rows))
        }
        None => "all rows are not enough".into(),
    };
    println!("  as few wrong with a fixed number: {}", fewer(evaluated.comparison.fixed_rows));
    println!("  as few wrong by a majority: {}", fewer(evaluated.comparison.vote_rows));
    Ok(())
}
