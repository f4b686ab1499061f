//! `palpate data check` of two data sets.

use crate::commands::progress::Bar;
use crate::commands::{Global, checked, dataset, remark};
use palpate::Result;
use palpate::compare::{Comparison, Cost, Settings, Share, compare};
use palpate::touches::{Captured, Dataset};
use std::fmt::Write as _;
use std::path::Path;

/// Says how far recorded touches are from simulated ones, and what that costs.
pub(super) fn run(directory: &Path, simulated: &Path, settings: &Settings, global: &Global) -> Result<()> {
    let recorded = checked(Dataset::read_any(directory)?);
    let simulated = dataset(simulated)?;
    if let Some((recorded, simulated)) = Captured::of(&recorded).zip(Captured::of(&simulated)) {
        let objects = recorded.shared(&simulated).join(", ");
        if !objects.is_empty() {
            remark(&format!(
                "palpate: warning: both data sets hold the same simulated touches of {objects}: nothing is compared with \
                 them. Give RECORDED touches, or capture with another seed."
            ));
        }
    }
    let compared = compare(&recorded, &simulated, settings, &Bar::new())
        .map_err(|error| if error.exit_code() == 1 { error.in_file(directory) } else { error })?;
    global.print(&compared, || text(&compared))
}

/// A share in percent with its interval.
fn percent(share: &Share) -> String {
    format!("{:.0} % ({:.0} to {:.0})", 100.0 * share.value, 100.0 * share.low, 100.0 * share.high)
}

/// The verdict, what it rests on, and below it the classifier that tells the two apart.
fn text(compared: &Comparison) -> String {
    let told = &compared.told_apart;
    let mut text = compared.verdict() + "\n";
    if !compared.unstated.is_empty() {
        // Writing to a string cannot fail.
        _ = writeln!(
            text,
            "note: the recordings of {} state no placement, and were compared with all placements by their weights, which the robot's \
             need not have. `palpate data record --object OBJECT/PLACEMENT` states it.",
            compared.unstated.join(", ")
        );
    }
    if let Some(cost) = &compared.cost {
        text += &cost_text(cost);
    }
    let width = compared.objects.iter().map(|own| own.name.len()).max().unwrap_or(0).max(6);
    // Writing to a string cannot fail.
    _ = writeln!(
        text,
        "\nA classifier distinguishes recorded from simulated touches with an accuracy of {:.1} % ({:.1} to {:.1} %). 50 % is \
         guessing.\n\n{:width$}  {:>8}  {:>9}  {:16}  by itself, each feature is",
        100.0 * told.value,
        100.0 * told.low,
        100.0 * told.high,
        "object",
        "recorded",
        "simulated",
        "accuracy"
    );
    for own in &compared.objects {
        let [recorded, simulated] = own.touches;
        let features = own.features.iter().map(|own| format!("{} {}", own.feature, own.words()));
        _ = writeln!(
            text,
            "{:width$}  {recorded:>8}  {simulated:>9}  {:16}  {}",
            own.name,
            percent(&own.told_apart),
            features.collect::<Vec<_>>().join("; ")
        );
    }
    text
}

fn cost_text(cost: &Cost) -> String {
    let mut text = format!(
        "\nA model of {} objects, trained on the simulated touches, is right after approaches\n{:14}",
        cost.known, ""
    );
    for at in cost.simulated.keys() {
        _ = write!(text, "{at:>8}");
    }
    for (name, accuracy) in [("on simulated", &cost.simulated), ("on recorded", &cost.recorded)] {
        _ = write!(text, "\n  {name:12}");
        for at in cost.simulated.keys() {
            let shown = accuracy.get(at).map_or_else(|| "–".into(), |share| format!("{:.1} %", 100.0 * share.value));
            _ = write!(text, "{shown:>8}");
        }
    }
    text += &format!("\n{}\n", cost.sentence());
    let promise = match &cost.promise {
        Some(promise) => promise.sentence(),
        None => "No promise was tested: capture more simulated approaches, or record more.".into(),
    };
    for sentence in [cost.confusions(), promise] {
        if !sentence.is_empty() {
            text += &(sentence + "\n");
        }
    }
    text
}
