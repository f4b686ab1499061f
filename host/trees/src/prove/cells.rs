//! Trees with few cells between their thresholds, cell by cell.

use super::boxes::{Rows, See, Values, between, cuts_of};
use super::span::{Span, spans};
use super::{Subject, output_of};
use crate::ensemble::Occurring;
use crate::error::{Error, Result};

/// The sums of the ensemble's leaves that `rows` reach, rounded to f32 at each addition, as libraries do.
fn sums(subject: Subject<'_>, rows: &mut Rows) -> Vec<Span> {
    let Subject { sources, ensemble, .. } = subject;
    let scale = f64::from(ensemble.prediction().scale);
    let mut sums: Vec<Span> = subject.base.iter().map(|&base| Span::of(base, 0.0)).collect();
    let add = |sum: f64, value: f64| f64::from((sum / scale) as f32 + (value / scale) as f32) * scale;
    for tree in sources {
        let values = if tree.object.is_some() { 1 } else { sums.len() };
        for (value, own) in spans(&[tree], values, Span::whole(0.0, 0.0), 0.0, rows).into_iter().enumerate() {
            let sum = &mut sums[output_of(tree.object, value)];
            (sum.low, sum.high) = (add(sum.low, own.low), add(sum.high, own.high));
        }
    }
    sums
}

/// The most trees in all cells together that are added up for the error of margins that the trees' worst only bound.
const MOST: usize = 2_000_000;

/// The largest difference of a margin to the ensemble's f32 sum in any cell between its thresholds; `None` if there are too
/// many of them.
pub(super) fn error_in_cells(subject: Subject<'_>) -> Result<Option<f64>> {
    let choices = choices(subject);
    let cells = choices.iter().map(|own| own.iter().try_fold(1_usize, |cells, own| cells.checked_mul(own.len())));
    let cells = cells.sum::<Option<usize>>().and_then(|cells| cells.checked_mul(subject.sources.len()));
    if cells.is_none_or(|cells| cells > MOST) {
        return Ok(None);
    }
    let mut worst = 0.0_f64;
    each_cell(subject, &choices, &mut |margins, rows| {
        let sums = sums(subject, rows);
        worst =
            margins.iter().zip(sums).fold(worst, |worst, (&model, sum)| worst.max((model - sum.farthest(model)).abs()));
        Ok(())
    })?;
    Ok(Some(worst))
}

/// Values of each feature between thresholds, one list of them for each contact pattern where features depend on it.
fn choices(subject: Subject<'_>) -> Vec<Vec<Vec<Values>>> {
    let Subject { plain, sources, ensemble, .. } = subject;
    let all = plain.keys.all(plain.features);
    // Each feature's intervals between thresholds, without a missing value.
    let intervals = |(feature, values): (usize, &Values)| {
        let trees = plain.trees.iter().map(|(tree, _)| tree).chain(sources);
        let cuts: Vec<i64> = cuts_of(trees, feature).collect();
        let is_split = !cuts.is_empty();
        // Values that stand for a missing one are no interval of their own, nor in one.
        let ends = plain.sentinel.filter(|_| is_split).map(|[low, high]| [low, high + 1]);
        let mut own = between(*values, cuts.into_iter().chain(ends.into_iter().flatten()).collect());
        own.retain(|values| !plain.is_sentinel(values));
        (is_split, own)
    };
    // Whether a missing value may go another way than all others, even where no threshold is between those.
    let (is_split, intervals): (Vec<bool>, Vec<Vec<Values>>) = all.iter().enumerate().map(intervals).unzip();
    let with_missing = |((own, is_split), &all): ((&Vec<Values>, &bool), &Values)| {
        if *is_split { own.iter().copied().chain([Values::MISSING]).collect() } else { vec![all] }
    };
    let whole: Vec<Vec<Values>> = intervals.iter().zip(&is_split).zip(&all).map(with_missing).collect();
    let Some(schema) = ensemble.schema().filter(|schema| schema.has_all_planes) else { return vec![whole] };
    // A plane fixes which values are there.
    let of_feature = |(feature, occurring): (usize, &Occurring)| match *occurring {
        Occurring::Any => whole[feature].clone(),
        Occurring::Known => intervals[feature].clone(),
        Occurring::Only(value) => vec![Values::of(value.into(), value.into(), false)],
        Occurring::Missing => vec![Values::MISSING],
    };
    schema.planes.iter().map(|plane| plane.iter().enumerate().map(of_feature).collect()).collect()
}

/// Calls `see` with the margins of each combination of values, as the chip computes them.
fn each_cell(subject: Subject<'_>, choices: &[Vec<Vec<Values>>], see: &mut See<'_, Error>) -> Result<()> {
    let mut rows = subject.plain.keys.all(subject.plain.features);
    choices.iter().try_for_each(|choices| {
        each(choices, 0, &mut rows, &mut |rows| see(&subject.margins(&subject.row(rows)), rows))
    })
}

/// Calls `see` with every combination of the choices of features from `feature` on.
fn each(
    choices: &[Vec<Values>],
    feature: usize,
    rows: &mut Vec<Values>,
    see: &mut dyn FnMut(&mut Vec<Values>) -> Result<()>,
) -> Result<()> {
    let Some(own) = choices.get(feature) else { return see(rows) };
    own.iter().try_for_each(|&values| {
        rows[feature] = values;
        each(choices, feature + 1, rows, see)
    })
}
