use super::*;
use crate::compile::{Settings as Compilation, compile};
use crate::ensemble::train::{self, train, train_with_background};
use crate::tests::synthetic::of;

/// Object k bends up to 80 ms · (k + 1). Three are known.
const KNOWN: usize = 3;

fn training() -> train::Settings {
    train::Settings { rounds: 20, depth: 4, ..train::Settings::compact() }
}

/// The misfit of the evidence of `touches` touches, in nats.
fn exact(misfit: &misfit::Misfit, evidence: &[f64], leader: usize, touches: u32) -> f64 {
    let count = f64::from(touches);
    let rivals = misfit.rivals.iter().zip(misfit.mean.iter());
    let against = rivals.map(|(&rival, mean)| evidence[rival] - evidence[leader] - count * mean);
    let against = nalgebra::DVector::from_iterator(misfit.rivals.len(), against);
    (&misfit.weights * &against).norm_squared() / count + misfit.slope.dot(&against) - count * misfit.constant
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
        let moments = Moments::new(&supplies, &others, model.known_count(), objects, unit);
        let misfits = misfit::misfits(&moments).unwrap();
        let settings = Settings::default();
        let tested = stated(&model, &terms(&settings, &misfits, 0.0), &misfits).unwrap();
        let tested = compile::open(&tested).unwrap();
        for rows in supplies.iter().map(|supply| &supply.pools[0]) {
            let mut sums = vec![0_i64; objects];
            for (touches, row) in (1_u32..=200).zip(rows.chunks_exact(objects)) {
                sums.iter_mut().zip(row).for_each(|(sum, &margin)| *sum += i64::from(margin));
                let nats: Vec<f64> = sums.iter().map(|&sum| sum as f64 * unit).collect();
                let leader = (0..model.known_count()).fold(0, |a, b| if sums[b] > sums[a] { b } else { a });
                let exact = exact(&misfits[leader], &nats, leader, touches);
                let chip = tested.misfit(&sums, touches).unwrap() as f64 / NAT;
                assert!((chip - exact).abs() < 0.05 + 0.02 * exact.abs(), "{touches}: {chip} for {exact}");
            }
        }
    }
}
