//! Made-up touches for tests: objects whose surfaces bend differently, without any mesh.

use crate::random::{self, Purpose};
use crate::touches::{Dataset, ObjectTouches};
use palpate_shared::{ContactTime, Touch};
use rand::{Rng, RngExt};

/// Objects of which number `k` has `counts[k]` touches; many touches could be any object's.
pub(crate) fn dataset(counts: &[usize], seed: u64) -> Dataset {
    let object = |(index, &count): (usize, &usize)| {
        let name = format!("object{index}");
        let mut random = random::generator(seed, Purpose::Synthetic, &name, 0);
        let touches = (0..count).map(|_| touch(index, &mut random)).collect();
        ObjectTouches { name, touches }
    };
    Dataset::new(counts.iter().enumerate().map(object).collect())
}

fn touch(object: usize, random: &mut impl Rng) -> Touch {
    let slope = random.random_range(0..200_000_u32);
    let spread = 40_000 * (u32::try_from(object).unwrap() + 1);
    let bend = random.random_range(0..spread) + random.random_range(0..spread);
    let mut times = [500_000, 500_000 + slope / 2 + bend, 500_000 + slope].map(ContactTime::from_micros);
    if random.random_range(0..20) == 0 {
        times[random.random_range(0..3)] = ContactTime::MISSING;
    }
    Touch::new(times)
}
