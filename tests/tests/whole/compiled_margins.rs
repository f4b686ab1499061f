//! A compiled model's margins are those of its ensemble: exactly with f32 leaves, within the stated error otherwise.

use palpate::compile::{Compiled, Layout, Leaf, Settings, compile};
use palpate::ensemble::{Ensemble, Node, OverTouches};
use palpate::with;
use palpate_onboard::Model;
use palpate_shared::Touch;
use palpate_shared::format::f32_key;
use palpate_tests::random;
use palpate_tests::wide::widened;
use proptest::prelude::*;

/// The largest difference of a margin, checked against the stated error.
fn hold(ensemble: &Ensemble, compiled: &Compiled, touches: &[Touch]) {
    let model = Model::new(&compiled.bytes).unwrap();
    let mut margins = vec![0; ensemble.objects.len()];
    for touch in touches {
        assert!(model.margins(touch, &mut margins));
        for (full, &margin) in ensemble.margins(touch).iter().zip(&margins) {
            let error = (f64::from(*full) - f64::from(margin) * f64::from(model.unit())).abs();
            assert!(error <= f64::from(model.margin_error()), "{error} > {} for {touch:?}", model.margin_error());
        }
    }
}

/// The ensemble's model, with splits of three bytes and of six.
fn models(ensemble: &Ensemble, settings: &Settings) -> Vec<Compiled> {
    let compiled = compile(ensemble, settings).unwrap();
    let wide = (compiled.layout == Layout::Compact).then(|| Compiled {
        bytes: widened(&compiled.bytes),
        layout: Layout::Wide,
        ..compiled.clone()
    });
    std::iter::once(compiled).chain(wide).collect()
}

/// A row next to some of the thresholds, and with all that is special about f32.
fn row(ensemble: &Ensemble, features: usize, seed: usize) -> Vec<f32> {
    let special = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0, 1e-42, -1e-42, f32::MAX, f32::MIN];
    let nodes = ensemble.trees.iter().flat_map(|tree| &tree.nodes);
    let thresholds: Vec<f32> = nodes
        .filter_map(|node| if let Node::Split { threshold, .. } = node { Some(*threshold) } else { None })
        .collect();
    let value = |index: usize| {
        let pick = (index + 1).wrapping_mul(seed.wrapping_mul(2_654_435_761) | 1) >> 7;
        match thresholds.get(pick % (thresholds.len() + 3)) {
            Some(&near) => [near, near.next_up(), near.next_down()][pick % 3],
            None => special[pick % special.len()],
        }
    };
    (0..features).map(value).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(10))]

    #[test]
    fn integer_margins_stay_within_the_stated_error_in_every_layout(shape in crate::shapes(12, 300, 10, 900), seed: u64, wide: bool) {
        let ensemble = random::ensemble(shape, seed);
        let touches = random::touches(200, seed);
        let leaf = if wide { Leaf::I16 } else { Leaf::I8 };
        for compiled in models(&ensemble, &with!(Settings::default(), leaf)) {
            hold(&ensemble, &compiled, &touches);
        }
    }

    #[test]
    fn integer_margins_are_the_same_with_splits_of_three_bytes_and_of_six(shape in crate::shapes(12, 300, 10, 900), seed: u64) {
        let ensemble = random::ensemble(shape, seed);
        let all = models(&ensemble, &Settings::default());
        let [mut first, mut other] = [vec![0; shape.objects], vec![0; shape.objects]];
        for touch in random::touches(100, seed) {
            Model::new(&all[0].bytes).unwrap().margins(&touch, &mut first);
            for compiled in &all {
                Model::new(&compiled.bytes).unwrap().margins(&touch, &mut other);
                prop_assert_eq!(&first, &other);
            }
        }
    }

    #[test]
    fn f32_margins_are_the_ensembles_bit_for_bit_in_every_layout(shape in crate::shapes(12, 300, 10, 900), seed: u64) {
        let ensemble = random::ensemble(shape, seed);
        let mut margins = vec![0.0; shape.objects];
        for compiled in models(&ensemble, &with!(Settings::default(), leaf = Leaf::F32)) {
            let model = Model::new(&compiled.bytes).unwrap();
            for touch in random::touches(100, seed) {
                let features = shape.descriptor.features(&touch);
                prop_assert!(model.f32_margins_of(features.as_slice(), &mut margins));
                let bits = |margins: &[f32]| margins.iter().map(|m| m.to_bits()).collect::<Vec<_>>();
                prop_assert_eq!(bits(&ensemble.margins(&touch)), bits(&margins));
            }
            hold(&ensemble, &compiled, &random::touches(100, !seed));
        }
    }

    #[test]
    fn real_features_split_as_f32_does_in_every_layout(shape in crate::shapes(12, 300, 10, 900), features in 1..=256_usize, seed: u64) {
        let ensemble = random::over_rows(random::ensemble(shape, seed), features, 1.000_001e-3);
        let mut margins = vec![0.0; shape.objects];
        for compiled in models(&ensemble, &with!(Settings::default(), leaf = Leaf::F32)) {
            let model = Model::new(&compiled.bytes).unwrap();
            for index in 0..40 {
                let row = row(&ensemble, features, index);
                let keys: Vec<i32> = row.iter().map(|&value| f32_key(value)).collect();
                prop_assert!(model.f32_margins_of(&keys, &mut margins));
                let bits = |margins: &[f32]| margins.iter().map(|m| m.to_bits()).collect::<Vec<_>>();
                prop_assert_eq!(bits(&ensemble.margins_of_features(&row)), bits(&margins));
            }
        }
    }
}
