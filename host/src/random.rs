//! Random numbers that depend on a seed and on what they are for, and on nothing else.

use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

/// A generator for sample `index` of `name`: other seeds, names or indices give other numbers, whatever was drawn before
/// and on whichever thread.
pub(crate) fn generator(seed: u64, name: &str, index: u64) -> ChaCha8Rng {
    // FNV-1a spreads the name and the index over 64 bits, which choose one of ChaCha's independent streams.
    let bytes = name.bytes().chain(index.to_le_bytes());
    let stream = bytes
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(stream);
    random
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;

    #[test]
    fn seed_name_and_index_each_change_the_numbers() {
        let draw = |seed, name, index| generator(seed, name, index).random::<u64>();
        assert_eq!(draw(1, "fork", 0), draw(1, "fork", 0));
        for other in [draw(2, "fork", 0), draw(1, "spoon", 0), draw(1, "fork", 1)] {
            assert_ne!(other, draw(1, "fork", 0));
        }
    }
}
