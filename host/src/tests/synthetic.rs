//! Made-up touches for tests: objects whose surfaces bend differently, without any mesh.

use crate::random::{self, Purpose};
use crate::touches::{Dataset, ObjectTouches, Source};
use palpate_shared::{ContactTime, Touch};
use rand::{Rng, RngExt};

/// Objects of which number `k` has `counts[k]` touches; many touches could be any object's.
pub(crate) fn dataset(counts: &[usize], seed: u64) -> Dataset {
    let object = |(index, &count): (usize, &usize)| {
        let name = format!("object{index}");
        let mut random = random::generator(seed, Purpose::Synthetic, &name, 0);
        let touches = (0..count).map(|_| touch(index, &mut random)).collect();
        ObjectTouches::new(name, touches, Source::Object)
    };
    Dataset::new(counts.iter().enumerate().map(object).collect())
}

/// Objects of which number `k` has the instances `kinds[k]`, touched in turn: each is as object number `kinds[k][i]` above.
#[cfg(feature = "objects")]
pub(crate) fn of_instances(kinds: &[&[usize]], count: usize, seed: u64) -> Dataset {
    let object = |(index, kinds): (usize, &&[usize])| {
        let name = format!("object{index}");
        let mut random = random::generator(seed, Purpose::Synthetic, &name, 1);
        let touches = (0..count).map(|turn| touch(kinds[turn % kinds.len()], &mut random)).collect();
        let names: Vec<String> = kinds.iter().map(|kind| format!("kind {kind}")).collect();
        ObjectTouches::in_turn(name, touches, &names, 0)
    };
    Dataset::new(kinds.iter().enumerate().map(object).collect())
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
