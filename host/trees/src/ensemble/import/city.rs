//! CatBoost's number of a category: the lower half of CityHash64, version 1.0, of its text.

use std::collections::{BTreeMap, BTreeSet};

/// Whole numbers up to this, with either sign, are looked for.
pub(super) const MOST: i32 = 1 << 20;

/// The whole numbers whose text has one of these hashes, by hash.
pub(super) fn numbers(hashes: &BTreeSet<u32>) -> BTreeMap<u32, Vec<i32>> {
    let mut found: BTreeMap<u32, Vec<i32>> = BTreeMap::new();
    if hashes.is_empty() {
        return found;
    }
    // One bit for each remainder: most numbers are excluded without a search.
    let mut sieve = vec![false; 1 << 16];
    hashes.iter().for_each(|hash| sieve[(hash & 0xffff) as usize] = true);
    let mut text = Vec::with_capacity(8);
    for number in -MOST..=MOST {
        text.clear();
        // Digits from the last one on, then the other way round.
        let mut rest = number.unsigned_abs();
        loop {
            text.push(b'0' + (rest % 10) as u8);
            rest /= 10;
            if rest == 0 {
                break;
            }
        }
        if number < 0 {
            text.push(b'-');
        }
        text.reverse();
        let hash = hash(&text);
        if sieve[(hash & 0xffff) as usize] && hashes.contains(&hash) {
            found.entry(hash).or_default().push(number);
        }
    }
    found
}

const K2: u64 = 0x9ae1_6a3b_2f90_404f;
const K3: u64 = 0xc949_d7c7_509e_6557;
const MIX: u64 = 0x9ddf_ea08_eb38_2d69;

/// Hash of 1 to 8 bytes.
fn hash(text: &[u8]) -> u32 {
    let length = text.len() as u64;
    let word = |bytes: &[u8]| bytes.iter().rev().fold(0_u64, |word, byte| word << 8 | u64::from(*byte));
    let whole = if text.len() >= 4 {
        mixed(length.wrapping_add(word(&text[..4]) << 3), word(&text[text.len() - 4..]))
    } else {
        let y = u64::from(text[0]) + (u64::from(text[text.len() / 2]) << 8);
        let z = length + (u64::from(text[text.len() - 1]) << 2);
        let bits = y.wrapping_mul(K2) ^ z.wrapping_mul(K3);
        (bits ^ bits >> 47).wrapping_mul(K2)
    };
    whole as u32
}

fn mixed(low: u64, high: u64) -> u64 {
    let a = (low ^ high).wrapping_mul(MIX);
    let b = (high ^ (a ^ a >> 47)).wrapping_mul(MIX);
    (b ^ b >> 47).wrapping_mul(MIX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_by_the_hashes_that_catboost_writes() {
        // What CatBoost 1.2 writes for categories 0, 4, 11 and 3.
        let hashes = [-1_438_285_038_i32, -78_686_594, -1_558_562_249, 593_172_586].map(i32::cast_unsigned);
        let found = numbers(&BTreeSet::from(hashes));
        for (hash, number) in hashes.iter().zip([0, 4, 11, 3]) {
            assert!(found[hash].contains(&number), "{number}: {:?}", found[hash]);
        }
        assert!(numbers(&BTreeSet::new()).is_empty());
    }
}
