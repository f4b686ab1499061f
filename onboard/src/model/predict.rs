//! A row to a class or a value, as the library that trained the model predicts it.

use super::Model;
use crate::exponential::exp2_negative;
use palpate_shared::format::{Link, OutputScale, Prediction, f32_key};

impl Model<'_> {
    /// The class of a row: that with the largest margin, and of several the first, or the last where
    /// [`Prediction::last_of_ties`] says so. With f32 leaves their sums are compared as they are. `None`, and nothing
    /// written, if `margins` is shorter than there are classes; it then holds what [`Model::margins_of`] gives.
    ///
    /// A model over touches has verdicts instead, but is answered in the same way.
    ///
    /// Cost: that of the margins, and a few instructions for each class. Cannot fail otherwise.
    pub fn predict_class(&self, features: &[i32], margins: &mut [i32]) -> Option<usize> {
        let margins = margins.get_mut(..self.object_count())?;
        margins.fill(0);
        self.sum(features, margins);
        let best = self.best(margins);
        self.make_fixed(margins);
        Some(best)
    }

    /// The class with the largest sum.
    #[inline(always)]
    pub(super) fn best(&self, sums: &[i32]) -> usize {
        let last_of_ties = self.prediction().last_of_ties;
        let (mut best, mut most) = (0, i32::MIN);
        for (class, &sum) in sums.iter().take(self.known_count()).enumerate() {
            let sum = if self.is_float() { f32_key(f32::from_bits(sum.cast_unsigned())) } else { sum };
            if sum > most || last_of_ties && sum == most {
                (best, most) = (class, sum);
            }
        }
        best
    }

    /// The value of a row before the inverse link: the margin of a model with one output, times the scale and plus the offset
    /// that the model states. `None` for a model with several outputs.
    ///
    /// With f32 leaves it is the sum times the scale, rounded once; otherwise the margin as f32 times the product of
    /// [`Model::unit`] and the scale as f32: three roundings, each of 2^-24 of the value at most. An
    /// [offset](OutputScale::offset) adds one, of 2^-24 of the result.
    ///
    /// Cost: that of the margins, and four operations of floating point. Cannot fail otherwise.
    pub fn predict_raw(&self, features: &[i32]) -> Option<f32> {
        if self.object_count() != 1 {
            return None;
        }
        let mut margin = [0];
        self.sum(features, &mut margin);
        Some(self.raw(0, margin[0]))
    }

    /// The values of a row, one for each output, before the inverse link: of a model with several
    /// [targets](Prediction::targets), or of one output as [`Model::predict_raw`]. `room` has as many numbers as there are
    /// outputs; `false`, and nothing written, if it or `values` is shorter. `values` beyond them are left alone.
    ///
    /// Cost: that of the margins, and four operations of floating point for each output. Cannot fail otherwise.
    pub fn predict_raw_each(&self, features: &[i32], room: &mut [i32], values: &mut [f32]) -> bool {
        let outputs = self.object_count();
        let (Some(sums), Some(values)) = (room.get_mut(..outputs), values.get_mut(..outputs)) else { return false };
        sums.fill(0);
        self.sum(features, sums);
        for (output, (value, sum)) in values.iter_mut().zip(sums).enumerate() {
            *value = self.raw(output, *sum);
        }
        true
    }

    /// The sum of an output as a value before the inverse link.
    fn raw(&self, output: usize, sum: i32) -> f32 {
        let own = self.output_scale(output);
        let scale = own.map_or_else(|| self.prediction().scale, |own| own.scale);
        let value = if self.is_float() {
            f32::from_bits(sum.cast_unsigned()) * scale
        } else {
            sum as f32 * (self.unit() * scale)
        };
        own.map_or(value, |own| value + own.offset)
    }

    /// Predicted values, as the library gives them: [`Model::predict_raw_each`] after the model's inverse link.
    pub fn predict_each(&self, features: &[i32], room: &mut [i32], values: &mut [f32]) -> bool {
        let prediction = self.prediction();
        let is_long = self.predict_raw_each(features, room, values);
        if is_long {
            values.iter_mut().take(self.object_count()).for_each(|value| *value = predicted_value(prediction, *value));
        }
        is_long
    }

    /// The value of a row as the library predicts it: [`Model::predict_raw`] after the model's inverse link, see
    /// [`predicted_value`]. `None` for a model with several outputs.
    pub fn predict_value(&self, features: &[i32]) -> Option<f32> {
        self.predict_raw(features).map(|margin| predicted_value(self.prediction(), margin))
    }

    /// Rule that turns margins into a class or a value: the [default](Prediction::default) unless the model states it.
    ///
    /// Cost: a few instructions for each optional section.
    pub fn prediction(&self) -> Prediction {
        Prediction::from_bytes(self.stated_prediction(), self.object_count()).unwrap_or_default()
    }

    /// The scale and the offset of an output, if the model states them for each: all others have the
    /// [scale](Prediction::scale) of [`Model::prediction`], and no offset.
    ///
    /// Cost: a few instructions for each optional section.
    pub fn output_scale(&self, output: usize) -> Option<OutputScale> {
        OutputScale::of(self.stated_prediction(), output)
    }
}

/// The value that the library predicts where its raw score is `margin`: through the inverse link, divided by
/// [`Prediction::average`] before.
///
/// Cost: that of the link, and a division where margins are averaged. Cannot fail.
pub fn predicted_value(prediction: Prediction, margin: f32) -> f32 {
    let margin = if prediction.average == 1 { margin } else { margin / prediction.average as f32 };
    inverse_link(prediction.link, margin)
}

/// The value that a margin stands for.
///
/// Error, relative to the result, where it is no less than 2^-126: [`Link::Exponential`] 1e-7, [`Link::Logistic`] 3e-7,
/// [`Link::Softplus`] 5e-7, [`Link::Square`] 6e-8. Of a NaN it is NaN. Cost: a power in integers, and a few operations in f32, which
/// take most of the time on chips without a float unit. Cannot fail.
fn inverse_link(link: Link, margin: f32) -> f32 {
    match link {
        Link::Identity => margin,
        Link::Exponential => exp(margin),
        Link::Square => {
            let square = margin * margin;
            if margin < 0.0 { -square } else { square }
        }
        Link::Logistic if margin >= 0.0 => 1.0 / (1.0 + exp(-margin)),
        Link::Logistic => {
            let power = exp(margin);
            power / (1.0 + power)
        }
        Link::Softplus if margin > 0.0 => margin + ln_1p(exp(-margin)),
        Link::Softplus => ln_1p(exp(margin)),
    }
}

/// log2 e in Q39.
const LOG2_E: u64 = 793_129_986_396;

/// e^x from a power of two in fixed point.
fn exp(x: f32) -> f32 {
    if x.is_nan() {
        return x;
    }
    if x > 89.0 {
        return f32::INFINITY;
    }
    if x < -104.0 {
        return 0.0;
    }
    let bits = x.to_bits();
    let exponent = (bits >> 23) & 0xff;
    let mantissa = u64::from(bits & 0x7f_ffff | 0x80_0000);
    // |x| · log2 e in Q32; that of a subnormal number is 0 either way.
    let magnitude = (mantissa * LOG2_E).checked_shr(157_u32.saturating_sub(exponent)).unwrap_or(0);
    let (whole, fraction) = (magnitude >> 32, magnitude & 0xffff_ffff);
    // Below 151, since |x| is at most 104.
    let whole = i32::try_from(whole).unwrap_or(0);
    // 2^-fraction · 2^whole, the fraction not below 0.
    let (whole, fraction) = match (x > 0.0, fraction) {
        (true, 0) => (whole, 0),
        (true, fraction) => (whole + 1, (1 << 32) - fraction),
        (false, fraction) => (-whole, fraction),
    };
    // From 2^23 to 2^24, which f32 holds exactly.
    let power = (exp2_negative(fraction) + (1 << 31)) >> 32;
    let power = u32::try_from(power).unwrap_or(0) as f32;
    // In two steps; the first is exact.
    let half = (whole - 24) / 2;
    power * power_of_two(half) * power_of_two(whole - 24 - half)
}

/// 2^exponent, for exponents of a normal number.
const fn power_of_two(exponent: i32) -> f32 {
    f32::from_bits(((127 + exponent) << 23).cast_unsigned())
}

/// ln(1 + e) for e from 0 to 1: twice the area tangent of e / (2 + e), which is at most a third.
fn ln_1p(e: f32) -> f32 {
    let s = e / (2.0 + e);
    let t = s * s;
    let mut sum = 1.0 / 13.0;
    for term in [1.0 / 11.0, 1.0 / 9.0, 1.0 / 7.0, 1.0 / 5.0, 1.0 / 3.0, 1.0] {
        sum = sum * t + term;
    }
    2.0 * s * sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_links_are_within_the_stated_error() {
        let mut worst = [0.0_f64; 5];
        let spread = (0..200_000).map(|step| (f64::from(step) / 1000.0 - 100.0) as f32);
        let small = (1..200).flat_map(|step| [1e-30_f32, 1e-6, 1e-3].map(|unit| unit * step as f32));
        for x in spread.chain(small.clone()).chain(small.map(|x| -x)).chain([0.0, -0.0]) {
            let exact = f64::from(x);
            for &link in Link::ALL {
                let expected = match link {
                    Link::Identity => exact,
                    Link::Exponential => exact.exp(),
                    Link::Square => exact * exact.abs(),
                    Link::Logistic => 1.0 / (1.0 + (-exact).exp()),
                    Link::Softplus => exact.max(0.0) + (-exact.abs()).exp().ln_1p(),
                };
                if expected.abs() < f64::from(f32::MIN_POSITIVE) || expected.abs() > f64::from(f32::MAX) {
                    continue;
                }
                let error = (f64::from(inverse_link(link, x)) - expected).abs() / expected.abs();
                let slot = &mut worst[usize::from(link.code())];
                *slot = slot.max(error);
            }
        }
        let stated = [0.0, 3e-7, 1e-7, 6e-8, 5e-7];
        assert!(worst.iter().zip(stated).all(|(worst, stated)| *worst <= stated), "{worst:?}");
    }

    #[test]
    fn an_averaged_margin_is_divided_before_its_link() {
        let of = |link, average| predicted_value(Prediction { link, average, ..Prediction::default() }, 10.0);
        assert_eq!([of(Link::Identity, 1), of(Link::Identity, 4), of(Link::Square, 4)], [10.0, 2.5, 6.25]);
        assert_eq!(of(Link::Exponential, 5), inverse_link(Link::Exponential, 2.0));
    }

    #[test]
    fn inverse_links_of_the_ends_are_their_limits() {
        let at = |x: f32| Link::ALL.iter().map(move |&link| inverse_link(link, x)).collect::<std::vec::Vec<_>>();
        let infinity = f32::INFINITY;
        assert_eq!(at(infinity), [infinity, 1.0, infinity, infinity, infinity]);
        assert_eq!(at(-infinity), [-infinity, 0.0, 0.0, -infinity, 0.0]);
        assert_eq!(at(0.0)[..4], [0.0, 0.5, 1.0, 0.0]);
        assert!(at(f32::NAN).into_iter().all(f32::is_nan));
        assert_eq!(inverse_link(Link::Exponential, 88.73), infinity);
        assert_eq!(inverse_link(Link::Exponential, -103.0), f32::from_bits(1));
    }
}
