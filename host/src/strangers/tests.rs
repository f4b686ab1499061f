use super::*;
use crate::compile::{Settings as Compilation, compile};
use crate::ensemble::train::{self, train, train_with_background};
use crate::probe::noise::Noise;
use crate::tests::synthetic;
use crate::with;

/// Object k bends up to 80 ms · (k + 1). Three are known.
const KNOWN: usize = 3;

fn of(objects: std::ops::Range<usize>, count: usize, seed: u64) -> Dataset {
    let mut all = synthetic::dataset(&vec![count; objects.end], seed);
    all.objects.drain(..objects.start);
    all
}

fn training() -> train::Settings {
    train::Settings { rounds: 20, depth: 4, ..train::Settings::compact() }
}

#[test]
fn the_chip_computes_the_misfit_that_was_learned() {
    let (touches, shapes) = (of(0..KNOWN, 4_000, 1), of(4..9, 400, 7));
    for ensemble in [train(&touches, &training(), &()), train_with_background(&touches, &shapes, &training(), &())] {
        let bytes = compile(&ensemble.unwrap(), &Compilation::default()).unwrap().bytes;
        let model = compile::open(&bytes).unwrap();
        let (objects, unit) = (model.object_count(), f64::from(model.unit()));
        let supplies = supplies(&model, &of(0..KNOWN, 4_000, 2), 1).unwrap();
        let others = of_shapes(&model, &shapes.objects);
        let moments = Moments::new(&supplies, None, &others, model.known_count(), objects, unit);
        let misfits = misfit::misfits(&moments, None).unwrap();
        let settings = Settings::default();
        let tested = stated(&model, &terms(&settings, &misfits, 0.0, FIRST), &misfits).unwrap();
        let tested = compile::open(&tested).unwrap();
        for rows in supplies.iter().map(|supply| &supply.pools[0]) {
            let mut sums = vec![0_i64; objects];
            for (touches, row) in (1_u32..=200).zip(rows.chunks_exact(objects)) {
                sums.iter_mut().zip(row).for_each(|(sum, &margin)| *sum += i64::from(margin));
                let nats: Vec<f64> = sums.iter().map(|&sum| sum as f64 * unit).collect();
                let leader = (0..model.known_count()).fold(0, |a, b| if sums[b] > sums[a] { b } else { a });
                let exact = misfits[leader].of(&nats, leader, touches);
                let chip = tested.misfit(&sums, touches).unwrap() as f64 / NAT;
                assert!((chip - exact).abs() < 0.05 + 0.02 * exact.abs(), "{touches}: {chip} for {exact}");
            }
        }
    }
}

/// Touches of the known objects by a robot that the simulation does not model.
fn of_robot(count: usize, seed: u64) -> Dataset {
    let mut dataset = of(0..KNOWN, count, seed);
    dataset.add_noise(&with!(Noise::gaussian(10_000.0), speed = 1.25), seed, 1);
    dataset
}

#[test]
fn a_test_that_is_calibrated_on_recordings_keeps_its_false_alarms_on_them_and_warns_where_simulated_ones_do_not() {
    let bytes = compile(&train(&of(0..KNOWN, 4_000, 1), &training(), &()).unwrap(), &Compilation::default());
    let bytes = bytes.unwrap().bytes;
    let (model, shapes) = (compile::open(&bytes).unwrap(), of(4..9, 400, 7).objects);
    let (simulated, robot) = (of(0..KNOWN, 30_000, 2), of_robot(2_000, 5));
    let settings = Settings { held: Held::Certain, ..Settings::default() };
    let alarms = |calibrated: &Tested, seed| {
        let model = compile::open(&calibrated.bytes).unwrap();
        let alarms = recorded::alarms(&model, &of_robot(20_000, seed), &settings).unwrap();
        alarms.all() as f64 / alarms.sequences as f64
    };
    let alone = calibrate(&model, &simulated, &shapes, &settings).unwrap();
    assert!(alarms(&alone, 6) > 0.04, "{}", alarms(&alone, 6));
    let both = calibrate_recorded(&model, &simulated, &robot, &shapes, &settings).unwrap();
    let found = both.recorded.clone().unwrap();
    assert!(found.before.differs && found.before.objects.len() == KNOWN, "{found:?}");
    assert!(found.alarms as f64 <= found.supported * found.sequences as f64, "{found:?}");
    assert!(alarms(&both, 6) < found.supported + 0.005, "{} {found:?}", alarms(&both, 6));
    assert_eq!(
        (both.terms.sequences as usize, f64::from(both.terms.alarms) * 1e-6),
        (found.sequences, found.supported)
    );
    // Recordings that are like the simulation raise no warning.
    let same = calibrate_recorded(&model, &simulated, &of(0..KNOWN, 2_000, 5), &shapes, &settings).unwrap();
    assert!(!same.recorded.unwrap().before.differs);
}
