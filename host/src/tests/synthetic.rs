//! Made-up touches for tests: objects whose surfaces bend differently, without any mesh; and models that were trained on them.

use palpate::compile::{self, CompiledModel, compile};
use palpate::ensemble::Ensemble;
use palpate::ensemble::train::{self, train};
use palpate::random::{self, Purpose};
use palpate::shared::{ContactTime, Touch};
use palpate::touches::{Dataset, ObjectTouches, Source};
use palpate::with;
use rand::{Rng, RngExt};
use std::ops::Range;
use std::sync::LazyLock;

/// An ensemble of three objects.
pub(crate) static ENSEMBLE: LazyLock<Ensemble> = LazyLock::new(|| {
    let settings = with!(train::Settings::compact(), rounds = 20, depth = 4, eta = 0.3);
    train(&dataset(&[2_000; 3], 1), &settings, &()).unwrap()
});

/// The ensemble, compiled.
pub(crate) static MODEL: LazyLock<CompiledModel> = LazyLock::new(|| {
    let bytes = compile(&ENSEMBLE, &compile::Settings::default()).unwrap().bytes;
    CompiledModel::from_bytes(bytes).unwrap()
});

/// Few trees, which are trained in a moment.
pub(crate) fn few_trees() -> train::Settings {
    with!(train::Settings::compact(), rounds = 8, depth = 4, min_child_weight = 5.0)
}

/// Two objects to train on and one that is recorded, with this many touches; all three with other touches, to test on.
pub(crate) fn to_teach(recorded: usize) -> [Dataset; 3] {
    let mut known = dataset(&[3_000, 3_000, recorded], 1);
    let taught = known.objects.split_off(2);
    [known, Dataset::new(taught), dataset(&[3_000, 3_000, 3_000], 2)]
}

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

/// As many touches of each of the objects with these numbers.
pub(crate) fn of(objects: Range<usize>, count: usize, seed: u64) -> Dataset {
    let mut all = dataset(&vec![count; objects.end], seed);
    all.objects.drain(..objects.start);
    all
}

/// A touch of the object of this number.
pub(crate) fn touch(object: usize, random: &mut impl Rng) -> Touch {
    let slope = random.random_range(0..200_000_u32);
    let spread = 40_000 * (u32::try_from(object).unwrap() + 1);
    let bend = random.random_range(0..spread) + random.random_range(0..spread);
    let mut times = [500_000, 500_000 + slope / 2 + bend, 500_000 + slope].map(ContactTime::from_micros);
    if random.random_range(0..20) == 0 {
        times[random.random_range(0..3)] = ContactTime::MISSING;
    }
    Touch::new(times)
}
