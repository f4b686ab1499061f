//! Objects to which several outputs belong: their weights are sums over their outputs.

use super::evidence::{ONE, Posterior, Rivals, Unit, best, ratio};
use core::num::NonZeroU64;
use palpate_shared::format::Outputs;

/// The leading object and the weights of all objects, in units in which the output with the most evidence weighs 2^56.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leading {
    /// The object's output with the most evidence.
    pub(super) output: usize,
    /// Weight of the object: the sum over its outputs.
    weight: u64,
    /// Weight of all other objects and the background.
    others: u64,
    /// Weight of the background.
    background: u64,
}

impl Leading {
    /// Finds the object with the largest weight among those with an output below `known`, the first of several.
    ///
    /// Cost: an exponential for each output.
    pub(super) fn of(evidence: &[i64], known: usize, outputs: Outputs<'_>, unit: Unit) -> Self {
        let (_, strongest) = best(evidence);
        let weight = |evidence: i64| unit.weight(strongest.abs_diff(evidence));
        let background = evidence.get(known).copied().map_or(0, weight);
        let mut leading = Self { output: 0, weight: 0, others: background, background };
        let mut object = Object::default();
        let mut last = 0;
        let known = evidence.get(..known).unwrap_or(evidence);
        for ((output, &evidence), number) in known.iter().enumerate().zip(outputs.objects()) {
            if number != last {
                leading.meet(object);
                object = Object::default();
                last = number;
            }
            if object.sum == 0 || evidence > object.evidence {
                (object.output, object.evidence) = (output, evidence);
            }
            object.sum = object.sum.saturating_add(weight(evidence));
        }
        leading.meet(object);
        leading
    }

    /// Compares the leader so far with the next object.
    fn meet(&mut self, object: Object) {
        if object.sum > self.weight {
            self.others = self.others.saturating_add(self.weight);
            (self.output, self.weight) = (object.output, object.sum);
        } else {
            self.others = self.others.saturating_add(object.sum);
        }
    }

    /// The weight of all other objects relative to the leader's, rounded up; `None` if the background weighs more than the
    /// leader.
    ///
    /// Cost: a long division.
    pub(super) fn rivals(self) -> Option<Rivals> {
        let weight = NonZeroU64::new(self.weight).filter(|weight| self.background <= weight.get())?;
        Some(Rivals::from_q56(quotient(self.others, weight)))
    }
}

/// An object's weight, and its output with the most evidence.
#[derive(Clone, Copy, Default)]
struct Object {
    output: usize,
    evidence: i64,
    sum: u64,
}

/// `part` / `whole` in Q56, rounded down, and one more unless it is whole; at most 2^64 − 1. A decision errs toward undecided.
fn quotient(mut part: u64, whole: NonZeroU64) -> u64 {
    let whole = whole.get();
    let mut times = 0_u64;
    // The leader is not below any other object: at most 255 times.
    while part >= whole && times < 255 {
        part -= whole;
        times += 1;
    }
    let down = ratio(part, whole);
    (times << 56).saturating_add(down).saturating_add(u64::from(part != 0))
}

/// True if one exponential shows that no object can be recognized: the strongest output of any object but the strongest
/// output's weighs more than `odds`, the loosest threshold, times the largest number of outputs of an object.
pub(super) fn is_undecided(evidence: &[i64], known: usize, outputs: Outputs<'_>, odds: u64, unit: Unit) -> bool {
    let (leader, strongest) = best(evidence);
    let object = |output: usize| if output < known { outputs.object(output) } else { None };
    let leading_object = object(leader);
    let mut second = None;
    for (output, &evidence) in evidence.iter().enumerate() {
        let is_other = object(output) != leading_object || (leading_object.is_none() && output != leader);
        if is_other && second.is_none_or(|second| evidence > second) {
            second = Some(evidence);
        }
    }
    let Some(second) = second else { return false };
    // Any leader's rivals weigh at least what the second output does, and its own outputs at most one each.
    unit.weight(strongest.abs_diff(second)) > odds.saturating_mul(outputs.most().into())
}

/// The posterior of the object that an output belongs to, and the output's part of it.
///
/// Cost: an exponential for each output, and two long divisions.
pub(super) fn posterior(
    evidence: &[i64],
    known: usize,
    output: usize,
    outputs: Outputs<'_>,
    unit: Unit,
) -> (Posterior, Posterior) {
    let (_, strongest) = best(evidence);
    let (mut output_weight, mut object, mut all) = (0_u64, 0_u64, 0_u64);
    let number = |output: usize| if output < known { outputs.object(output) } else { None };
    for (other, &evidence) in evidence.iter().enumerate() {
        let weight = unit.weight(strongest.abs_diff(evidence));
        if other == output {
            output_weight = weight;
        }
        if other == output || (number(other).is_some() && number(other) == number(output)) {
            object = object.saturating_add(weight);
        }
        all = all.saturating_add(weight);
    }
    let part = |part: u64, whole: u64| if whole == 0 { 0 } else { ratio(part, whole) };
    // The smaller part is divided, so that 1 − 1e-16 is not 1.
    let rest = all - object;
    let posterior = if rest < object { ONE - part(rest, all) } else { part(object, all) };
    (Posterior(posterior), Posterior(part(output_weight, object)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decide::evidence::tests::unit;
    use std::vec::Vec;

    fn section(objects: &[u8]) -> Vec<u8> {
        let mut content = Vec::new();
        let outputs = objects.iter().map(|&object| (object, 0.5));
        Outputs::write(outputs, &mut |bytes| content.extend_from_slice(bytes));
        content
    }

    /// The weights of objects, the background last, by a softmax.
    fn weights(evidence: &[i64], objects: &[u8], known: usize) -> Vec<f64> {
        let most = evidence.iter().max().unwrap();
        let weight = |evidence: i64| ((evidence - most) as f64 / 1000.0).exp();
        let mut sums = std::vec![0.0; usize::from(objects[known - 1]) + 1];
        objects[..known].iter().zip(evidence).for_each(|(&object, &own)| sums[usize::from(object)] += weight(own));
        sums.extend(evidence[known..].iter().map(|&own| weight(own)));
        sums
    }

    /// Every evidence of four outputs, of few values, with every way of belonging together.
    fn cases() -> impl Iterator<Item = ([i64; 4], [u8; 4], usize)> {
        let values = [0, 600, 700, 4_000, -90_000];
        let objects = [[0, 0, 1, 1], [0, 0, 0, 1], [0, 1, 1, 2], [0, 1, 2, 3], [0, 0, 0, 0]];
        (0..625_usize).flat_map(move |case| {
            let evidence = [1, 5, 25, 125].map(|place| values[case / place % 5]);
            objects.into_iter().flat_map(move |objects| [(evidence, objects, 4), (evidence, objects, 3)])
        })
    }

    #[test]
    fn an_object_counts_as_the_sum_of_its_outputs_as_leader_as_rival_and_in_posteriors() {
        for (evidence, objects, known) in cases() {
            let content = section(&objects);
            let outputs = Outputs::from_bytes(&content, 4).unwrap();
            let weights = weights(&evidence, &objects, known);
            let (all, best): (f64, _) = (weights.iter().sum(), evidence.iter().max().unwrap());
            for output in 0..known {
                let own = weights[usize::from(objects[output])];
                let (posterior, share) = posterior(&evidence, known, output, outputs, unit());
                assert!((posterior.to_f64() - own / all).abs() < 1e-7, "{evidence:?} {objects:?}");
                let part = ((evidence[output] - best) as f64 / 1000.0).exp();
                assert!(own < 1e-9 || (share.to_f64() - part / own).abs() < 1e-6, "{evidence:?} {objects:?}");
            }
            let leading = Leading::of(&evidence, known, outputs, unit());
            let named = weights.len() - (4 - known);
            let own = weights[usize::from(objects[leading.output])];
            let most = weights[..named].iter().copied().fold(0.0, f64::max);
            if most < 1e-16 {
                assert_eq!(leading.rivals(), None, "only the background has a weight");
                continue;
            }
            assert!(own >= most * (1.0 - 1e-7), "{evidence:?} {objects:?} {known}");
            let strongest = (0..known).filter(|&output| objects[output] == objects[leading.output]);
            assert_eq!(Some(evidence[leading.output]), strongest.map(|output| evidence[output]).max());
            let exact = (all - own) / own;
            match leading.rivals() {
                Some(rivals) => {
                    let found = rivals.q56() as f64 / ONE as f64;
                    assert!((found - exact).abs() <= 1e-7 * exact + 1e-16, "{found} for {exact}: {evidence:?}");
                }
                None => assert!(known == 3 && weights[named] > own * (1.0 - 1e-7), "{evidence:?} {objects:?}"),
            }
        }
    }

    #[test]
    fn what_one_exponential_leaves_undecided_is_never_recognized() {
        let mut found = 0;
        for (evidence, objects, known) in cases() {
            let content = section(&objects);
            let outputs = Outputs::from_bytes(&content, 4).unwrap();
            for odds in [0, 1 << 40, ONE / 100, ONE / 3, ONE - 1, u64::MAX] {
                if is_undecided(&evidence, known, outputs, odds, unit()) {
                    found += 1;
                    let rivals = Leading::of(&evidence, known, outputs, unit()).rivals();
                    assert!(rivals.is_none_or(|rivals| rivals.q56() > odds), "{evidence:?} {objects:?} {odds}");
                }
            }
        }
        assert!(found > 1_000, "{found}");
    }

    #[test]
    fn two_hundred_and_fifty_six_level_outputs_overflow_nothing() {
        let evidence = [-5; 256];
        let objects: Vec<u8> = (0..=255).collect();
        for objects in [std::vec![0; 256], objects] {
            let content = section(&objects);
            let outputs = Outputs::from_bytes(&content, 256).unwrap();
            let leading = Leading::of(&evidence, 256, outputs, unit());
            let rivals = leading.rivals().unwrap().q56();
            assert_eq!((leading.output, rivals >> 48), (0, if objects[255] == 0 { 0 } else { 255 << 8 }));
        }
    }
}
