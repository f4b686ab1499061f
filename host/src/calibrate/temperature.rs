//! One temperature, so that the posterior that is shown is one to believe (Guo and others, 2017, arXiv 1706.04599).

use super::demand::Demand;
use crate::error::Result;
use crate::evaluate::OfTouches;
use crate::evaluate::together::margins_of_touches;
use crate::touches::{Dataset, ObjectTouches};
use palpate_onboard::Model;
use palpate_shared::Touch;
use rayon::prelude::*;

/// The most touches of each object that the temperature is fitted on.
const MOST: usize = 10_000;
/// Halvings of the range of the logarithm of the temperature, from 1/16 to 16.
const HALVINGS: usize = 24;

/// Divisor of the margins with which the posteriors of single touches explain their objects best: the least mean
/// negative log-likelihood, each object weighted equally. `known` are the indices of the data set's objects in the
/// model; of one that has several outputs, and touches that state no placement, the posterior is that of all of them. 1 if no
/// touch is evidence.
pub fn temperature(model: &Model<'_>, dataset: &Dataset, known: &[usize]) -> f64 {
    let evidence = |touched: &ObjectTouches| -> Vec<Touch> {
        touched.in_turns().filter(|touch| model.accepts(touch).is_ok()).take(MOST).copied().collect()
    };
    let outputs = |(touched, &known): (&ObjectTouches, &usize)| {
        let outputs = model.outputs_of(&touched.name);
        if outputs.len() > 1 { outputs } else { vec![known] }
    };
    let outputs: Vec<Vec<usize>> = dataset.objects.iter().zip(known).map(outputs).collect();
    temperature_of(model, &dataset.objects.iter().map(evidence).collect::<Vec<_>>(), &outputs)
}

/// Like [`temperature`], on touches that are captured for it.
pub(super) fn temperature_on_demand(model: &Model<'_>, demands: &[Demand<'_>], known: &[usize]) -> Result<f64> {
    let evidence = |demand: &Demand<'_>| -> Result<Vec<Touch>> {
        let mut evidence = Vec::new();
        let positions: Vec<u32> = (0..demand.len() as u32).collect();
        for positions in positions.chunks(MOST) {
            evidence.extend(demand.touches(positions)?.into_iter().filter(|touch| model.accepts(touch).is_ok()));
            if evidence.len() >= MOST {
                break;
            }
        }
        evidence.truncate(MOST);
        Ok(evidence)
    };
    let outputs: Vec<Vec<usize>> = known.iter().map(|&object| vec![object]).collect();
    Ok(temperature_of(model, &demands.iter().map(evidence).collect::<Result<Vec<_>>>()?, &outputs))
}

/// Temperature on touches of each object, which are all evidence, and its outputs.
fn temperature_of(model: &Model<'_>, evidence: &[Vec<Touch>], outputs: &[Vec<usize>]) -> f64 {
    let rows = |(evidence, outputs): (&Vec<Touch>, &Vec<usize>)| {
        let row = |margins: &[i32]| {
            let own = outputs.first().and_then(|&output| margins.get(output)).copied().unwrap_or(0);
            // Ahead of the right object, in nats.
            margins.iter().map(|margin| f64::from(margin - own) * f64::from(model.unit())).collect::<Vec<_>>()
        };
        margins_of_touches(model, evidence).chunks_exact(model.object_count()).map(row).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<Vec<f64>>> = evidence.par_iter().zip(outputs).map(rows).collect();
    if rows.iter().all(Vec::is_empty) {
        return 1.0;
    }
    // The likelihood is concave in one over the temperature; its slope is the right object's margin less the mean one.
    let slope = |sharpness: f64| -> f64 {
        let of_object = |(rows, outputs): (&Vec<Vec<f64>>, &Vec<usize>)| {
            // 0 for an object with one output.
            let own = |row: &[f64]| match &outputs[..] {
                [_] => 0.0,
                outputs => {
                    let own: Vec<f64> = outputs.iter().filter_map(|&output| row.get(output).copied()).collect();
                    mean_ahead(&own, sharpness)
                }
            };
            let sum: f64 = rows.iter().map(|row| own(row) - mean_ahead(row, sharpness)).sum();
            sum / rows.len().max(1) as f64
        };
        rows.par_iter().zip(outputs).map(of_object).collect::<Vec<_>>().iter().sum()
    };
    let (mut low, mut high) = (-16_f64.ln(), 16_f64.ln());
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if slope(middle.exp()) > 0.0 { low = middle } else { high = middle }
    }
    (-0.5 * (low + high)).exp()
}

/// The mean of the margins ahead of the right object under the posterior.
fn mean_ahead(ahead: &[f64], sharpness: f64) -> f64 {
    let most = ahead.iter().copied().fold(0.0, f64::max);
    let (weights, sum) = ahead.iter().fold((0.0, 0.0), |(weights, sum), &ahead| {
        let weight = (sharpness * (ahead - most)).exp();
        (weights + weight, sum + weight * ahead)
    });
    sum / weights
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_margin_is_that_of_a_softmax() {
        // Posteriors 1/2, 1/4, 1/4 at a sharpness of 1.
        let ahead = [0.0, -(2_f64.ln()), -(2_f64.ln())];
        assert!((mean_ahead(&ahead, 1.0) + 0.5 * 2_f64.ln()).abs() < 1e-12);
        assert!(mean_ahead(&[0.0, 700.0, 800.0], 16.0).is_finite());
    }
}
