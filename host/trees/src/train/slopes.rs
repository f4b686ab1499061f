//! Derivatives of the softmax loss, in f32 as XGBoost computes them.

/// The least second derivative.
const LEAST: f32 = 1e-16;
/// The largest distance by which margins of a row may differ for [`short_exp`].
const FAR: f32 = 80.0;

/// The derivatives of rows' losses by their margins.
pub(super) struct Softmax {
    classes: usize,
    /// The first rows, whose shares [`Softmax::shares_of_few`] computes.
    few: usize,
}

impl Softmax {
    /// For this many rows altogether.
    pub(super) fn new(classes: usize, rows: usize) -> Self {
        // As hessboost 0.4 does on processors with AVX2, whose models these were; the rest of a vector is computed as others.
        let few = if matches!(classes, 2 | 4) && rows * classes >= 16 { rows - rows % (8 / classes) } else { 0 };
        Self { classes, few }
    }

    /// The share of each class in rows that begin with row `first`, a multiple of four.
    pub(super) fn shares(&self, first: usize, margins: &[f32], shares: &mut [f32]) {
        let few = self.few.saturating_sub(first).saturating_mul(self.classes).min(margins.len());
        let (few_margins, margins) = margins.split_at(few);
        let (few_shares, shares) = shares.split_at_mut(few);
        for (margins, shares) in few_margins.chunks(8).zip(few_shares.chunks_mut(8)) {
            self.shares_of_few(margins, shares);
        }
        self.shares_of_many(margins, shares);
    }

    fn shares_of_many(&self, margins: &[f32], shares: &mut [f32]) {
        for (margins, shares) in margins.chunks(self.classes).zip(shares.chunks_mut(self.classes)) {
            let most = most(margins);
            let mut sum = 0.0;
            for (share, margin) in shares.iter_mut().zip(margins) {
                *share = (margin - most).exp();
                sum += f64::from(*share);
            }
            let sum = sum as f32;
            shares.iter_mut().for_each(|share| *share /= sum);
        }
    }

    /// Shares of two or four classes in eight margins, by a polynomial.
    fn shares_of_few(&self, margins: &[f32], shares: &mut [f32]) {
        let near = |row: &[f32]| most(row) - row.iter().copied().fold(f32::INFINITY, f32::min) <= FAR;
        if !margins.chunks(self.classes).all(near) {
            return self.shares_of_many(margins, shares);
        }
        for (margins, shares) in margins.chunks(self.classes).zip(shares.chunks_mut(self.classes)) {
            let most = most(margins);
            shares.iter_mut().zip(margins).for_each(|(share, margin)| *share = short_exp(margin - most));
            let sum: f32 = shares.chunks(2).map(|pair| pair[0] + pair[1]).sum();
            shares.iter_mut().for_each(|share| *share *= 1.0 / sum);
        }
    }
}

/// The first and second derivative of a row by the margin of a class that has this share, whether the row is of it, and the
/// row's weight.
pub(super) fn slope(share: f32, own: bool, weight: f32) -> [f32; 2] {
    let first = if own { share - 1.0 } else { share };
    [first * weight, (2.0 * share * (1.0 - share) * weight).max(LEAST)]
}

/// The largest margin; the least positive number if all are below it.
fn most(margins: &[f32]) -> f32 {
    margins.iter().copied().fold(f32::MIN_POSITIVE, f32::max)
}

/// e to the power of a number from −80 to 0, to about the last digit.
fn short_exp(power: f32) -> f32 {
    let exponent = (power * std::f32::consts::LOG2_E).round_ties_even();
    // The logarithm of 2 in two parts, so that the rest keeps its digits.
    let rest = fused(-exponent, 0.693_359_4, power);
    let rest = fused(exponent, 2.121_944_4e-4, rest);
    let square = rest * rest;
    let low = fused(fused(1.0 / 6.0, rest, 0.5), square, 1.0 + rest);
    let high = fused(fused(1.0 / 5_040.0, rest, 1.0 / 720.0), square, fused(1.0 / 120.0, rest, 1.0 / 24.0));
    let scale = f32::from_bits(((exponent as i32 + 127) as u32) << 23);
    fused(high, square * square, low) * scale
}

/// a × b + c, rounded once, without a call where the processor has no instruction for it: the product is exact in f64, and
/// rounding the sum a second time matters only half way between two numbers.
fn fused(a: f32, b: f32, c: f32) -> f32 {
    let sum = f64::from(a) * f64::from(b) + f64::from(c);
    if sum.to_bits() & 0x1FFF_FFFF == 0x1000_0000 { a.mul_add(b, c) } else { sum as f32 }
}
