//! The split of a node that gains most.
//!
//! Sums of rows' derivatives are lists: first derivatives by all outputs, then second ones. All arithmetic is XGBoost's, which
//! differs between leaves of one value (version 1.6 already) and leaves of several (version 3).

use super::bins::Side;

/// `lambda`: added to every sum of second derivatives.
const LAMBDA: f64 = 1.0;

/// The scores of a split's sides.
#[derive(Clone, Copy)]
pub(super) struct Score {
    /// The outputs of a leaf.
    pub(super) outputs: usize,
    /// The least second derivative of a side: its mean over the outputs.
    pub(super) least: f64,
    /// No row misses a value.
    pub(super) complete: bool,
}

/// A split.
#[derive(Clone)]
pub(super) struct Split {
    /// Twice the decrease of the loss; 0 for no split.
    pub(super) gain: f32,
    pub(super) side: Side,
    /// Sums of the side without missing values.
    known: Vec<f64>,
}

impl Split {
    pub(super) fn none() -> Self {
        Self { gain: 0.0, side: Side { column: 0, limit: 0, missing_left: false }, known: Vec::new() }
    }

    /// The sums of both sides, left and right, of a node with these.
    pub(super) fn sides(&self, sums: &[f64]) -> [Vec<f64>; 2] {
        let other = sums.iter().zip(&self.known).map(|(sum, known)| sum - known).collect();
        if self.side.missing_left { [other, self.known.clone()] } else { [self.known.clone(), other] }
    }
}

impl Score {
    /// The values of a leaf with these sums.
    pub(super) fn leaf(&self, sums: &[f64]) -> Vec<f32> {
        let (firsts, seconds) = sums.split_at(self.outputs);
        // Only a root can be below the least.
        let least = if self.outputs == 1 { self.least } else { f64::MIN };
        firsts
            .iter()
            .zip(seconds)
            .map(|(&first, &second)| if second < least { 0.0 } else { value(first, second) })
            .collect()
    }

    /// The score of a node with these sums as a leaf, which its split has to exceed.
    pub(super) fn whole(&self, sums: &[f64]) -> f64 {
        let (firsts, seconds) = sums.split_at(self.outputs);
        let of_outputs = firsts.iter().zip(seconds).map(|(&first, &second)| score_of(first, second));
        if self.outputs == 1 { of_outputs.map(|score| f64::from(score as f32)).sum() } else { of_outputs.sum() }
    }

    /// The best split of a node by one column, or `best` if that is as good: its `bins` hold sums, all rows have `sums`, and
    /// their score is `whole`.
    pub(super) fn search(&self, bins: &[f64], sums: &[f64], whole: f64, column: usize, best: &mut Split) {
        if self.outputs == 1 {
            self.search_one(bins, sums, whole as f32, column, best);
        } else {
            self.search_each(bins, sums, whole, column, best);
        }
    }

    /// For leaves of one value.
    fn search_one(&self, bins: &[f64], sums: &[f64], whole: f32, column: usize, best: &mut Split) {
        let (&[first, second], (bins, _)) = (sums, bins.as_chunks::<2>()) else { return };
        if bins.len() < 2 {
            return;
        }
        let passes: &[bool] = if self.complete { &[false] } else { &[false, true] };
        for &missing_left in passes {
            let mut known = [0.0; 2];
            for step in 0..bins.len() {
                let bin = if missing_left { bins.len() - 1 - step } else { step };
                let sum = [known[0] + bins[bin][0], known[1] + bins[bin][1]];
                if sum == known {
                    continue;
                }
                known = sum;
                let other = [first - known[0], second - known[1]];
                let valid = |second: f64| second > 0.0 && second >= self.least;
                if !valid(known[1])
                    || !valid(other[1])
                    || cannot_exceed(known, other, f64::from(best.gain) + f64::from(whole))
                {
                    continue;
                }
                let score = |[first, second]: [f64; 2]| score_of(first, second) as f32;
                let gain = (score(known) + score(other)) - whole;
                if gain > best.gain && gain.is_finite() {
                    let limit = if missing_left { bin } else { bin + 1 };
                    *best = Split { gain, side: Side { column, limit, missing_left }, known: known.to_vec() };
                }
            }
            if known == [first, second] {
                return;
            }
        }
    }

    /// For leaves of several values.
    fn search_each(&self, bins: &[f64], sums: &[f64], whole: f64, column: usize, best: &mut Split) {
        let (outputs, width) = (self.outputs, 2 * self.outputs);
        let count = bins.len() / width;
        let (mut known, mut scores) = (vec![0.0; width], vec![[0.0; 2]; outputs]);
        for missing_left in [false, true] {
            known.fill(0.0);
            for step in 0..count {
                let bin = if missing_left { count - 1 - step } else { step };
                let mut same = true;
                for (known, bin) in known.iter_mut().zip(&bins[bin * width..][..width]) {
                    let sum = *known + bin;
                    same &= sum == *known;
                    *known = sum;
                }
                // An empty bin: the rows on both sides are those of the step before.
                if same || !self.valid(&known[outputs..], &sums[outputs..]) {
                    continue;
                }
                let (firsts, seconds) = known.split_at(outputs);
                let (first_sums, second_sums) = sums.split_at(outputs);
                for output in 0..outputs {
                    let (first, second) = (firsts[output], seconds[output]);
                    let (first_other, second_other) = (first_sums[output] - first, second_sums[output] - second);
                    scores[output] = [best_score(first, second), best_score(first_other, second_other)];
                }
                let add = |sum: f64, &[known, other]: &[f64; 2]| {
                    if missing_left { sum + other + known } else { sum + known + other }
                };
                let gain = (scores.iter().fold(0.0, add) - whole) as f32;
                if gain > best.gain && gain.is_finite() {
                    let limit = if missing_left { bin } else { bin + 1 };
                    (best.gain, best.side) = (gain, Side { column, limit, missing_left });
                    best.known.clear();
                    best.known.extend_from_slice(&known);
                }
            }
            if known == sums {
                return;
            }
        }
    }

    /// True if both sides weigh enough, given second derivatives of one and of both.
    fn valid(&self, known: &[f64], sums: &[f64]) -> bool {
        let (mut own, mut other) = (0.0, 0.0);
        for (known, sum) in known.iter().zip(sums) {
            own += known;
            other += sum - known;
        }
        let valid = |second: f64| second > 0.0 && second >= self.least;
        valid(own / known.len() as f64) && valid(other / known.len() as f64)
    }
}

/// The value of a leaf for an output.
fn value(first: f64, second: f64) -> f32 {
    // Adding 0 makes a negative one positive.
    if second <= 0.0 { 0.0 } else { (-(first + 0.0) / (second + LAMBDA)) as f32 }
}

/// The score of rows with these sums whose leaf has its value in f32.
fn score_of(first: f64, second: f64) -> f64 {
    let value = value(first, second);
    -(2.0 * first * f64::from(value) + (second + LAMBDA) * f64::from(value * value))
}

/// The score of rows with these sums whose leaf has the best value.
fn best_score(first: f64, second: f64) -> f64 {
    let score = first * first / (second + LAMBDA);
    if second > 0.0 { score } else { 0.0 }
}

/// True only if the scores of two sides do not add up to more than `least`, decided without a division. Scores in f32 are
/// within 2⁻²⁰ of the best ones.
fn cannot_exceed(one: [f64; 2], other: [f64; 2], least: f64) -> bool {
    let (a, b) = (one[1] + LAMBDA, other[1] + LAMBDA);
    let scores = one[0] * one[0] * b + other[0] * other[0] * a;
    scores * (1.0 + 1.0 / 65_536.0) < (least - f64::from(f32::MIN_POSITIVE)) * (a * b)
}
