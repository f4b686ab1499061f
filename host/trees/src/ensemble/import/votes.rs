//! Forests whose trees vote: shares of votes as whole numbers, which f32 adds without rounding, so that classes that the
//! library finds to have equally many votes have equally many here.

/// Sums of all trees stay at most this: far enough below 2^24 that sums that differ still differ as shares in f32.
const LIMIT: f64 = 4_194_304.0;
/// Largest distance of a share from the fraction that it stands for: files hold shares in f32, divided by the number of
/// trees.
const SLACK: f64 = 2e-7;
/// The largest denominator of a fraction that a share in f32 identifies.
const LARGEST: u64 = 1000;

/// Turns shares into whole numbers of votes times a power of two if every leaf of every tree holds shares of the classes
/// whose sum over all trees is 1. Returns the factor that turns their sums into shares again.
///
/// The number of votes of a tree is the least common denominator of all shares, where the sums still fit; otherwise shares
/// are rounded to a power of two of them.
pub(super) fn count(classes: usize, trees: usize, leaves: &mut [&mut Vec<f64>]) -> Option<f32> {
    let trees = trees as f64;
    let is_vote = |values: &[f64]| {
        let sum: f64 = values.iter().sum();
        values.iter().all(|&value| value >= 0.0) && (sum * trees - 1.0).abs() <= SLACK * classes as f64
    };
    if classes < 2 || leaves.is_empty() || !leaves.iter().all(|values| is_vote(values)) {
        return None;
    }
    let most = (LIMIT / trees).floor();
    let shares = leaves.iter().flat_map(|values| values.iter()).map(|share| share * trees);
    let votes = denominator(shares, most).unwrap_or_else(|| most.log2().floor().max(0.0).exp2());
    // Sums are at most 1, and every leaf is a whole multiple of the power of two.
    let unit = (votes * trees).log2().ceil().exp2().recip();
    for value in leaves.iter_mut().flat_map(|values| values.iter_mut()) {
        *value = (*value * trees * votes).round() * unit;
    }
    Some((1.0 / (votes * trees * unit)) as f32)
}

/// The least common denominator of numbers from 0 to 1, if it is at most `most`.
fn denominator(shares: impl Iterator<Item = f64>, most: f64) -> Option<f64> {
    let mut common = 1_u64;
    for share in shares {
        if (share * common as f64 - (share * common as f64).round()).abs() <= SLACK * common as f64 {
            continue;
        }
        let own = fraction(share)?;
        common = common / gcd(common, own) * own;
        if common as f64 > most {
            return None;
        }
    }
    Some(common as f64)
}

/// The denominator of the simplest fraction next to a number, by its continued fraction.
fn fraction(number: f64) -> Option<u64> {
    let (mut before, mut denominator, mut rest) = (0_u64, 1_u64, number);
    for _ in 0..20 {
        let scaled = number * denominator as f64;
        if (scaled - scaled.round()).abs() <= SLACK * denominator as f64 {
            return Some(denominator);
        }
        rest = 1.0 / (rest - rest.floor());
        if !rest.is_finite() || rest > 1e9 {
            return None;
        }
        (before, denominator) = (denominator, rest.floor() as u64 * denominator + before);
        if denominator > LARGEST {
            return None;
        }
    }
    None
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_have_their_least_common_denominator() {
        let of = |shares: &[f64]| denominator(shares.iter().map(|&share| f64::from(share as f32)), 1e6);
        assert_eq!(of(&[0.0, 1.0]), Some(1.0));
        assert_eq!(of(&[1.0 / 3.0, 2.0 / 3.0, 0.75]), Some(12.0));
        assert_eq!(of(&[1.0 / 7.0, 3.0 / 11.0, 5.0 / 13.0, 0.5]), Some(2002.0));
        assert_eq!(of(&[1.0 / 997.0, 1.0 / 991.0]), Some(988_027.0));
        assert_eq!(of(&[1.0 / 997.0, 1.0 / 991.0, 0.5]), None, "too large");
        assert_eq!(of(&[std::f64::consts::FRAC_1_SQRT_2]), None);
    }
}
