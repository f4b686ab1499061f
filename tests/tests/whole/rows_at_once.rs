//! Rows that go through a model together have the margins that each has by itself, to the bit.

use palpate::compile::{Settings, compile};
use palpate::ensemble::{Ensemble, OverTouches};
use palpate_onboard::{Batch, Model};
use palpate_shared::MISSING_FEATURE;
use palpate_tests::random::{self, Shape};
use proptest::prelude::*;
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};

/// Numbers of rows around those where the work is divided in another way.
const COUNTS: [usize; 12] = [0, 1, 7, 8, 9, 15, 16, 17, 127, 128, 2001, MOST];

/// More than one block.
const MOST: usize = 2100;

/// Rows near what trees compare with, every seventh value missing.
fn rows(ensemble: &Ensemble, model: &Model<'_>, seed: u64) -> Vec<i32> {
    let mut random = SmallRng::seed_from_u64(seed);
    let width = model.feature_count();
    let mut features: Vec<i32> = match ensemble.descriptor() {
        Some(descriptor) => {
            let touches = random::touches(MOST, seed);
            touches.iter().flat_map(|touch| descriptor.features(touch).as_slice().to_vec()).collect()
        }
        None => (0..MOST * width).map(|_| random.random_range(-300_000..300_000)).collect(),
    };
    let special = [i32::MAX, -i32::MAX, 0, -1];
    for value in &mut features {
        match random.random_range(0..28) {
            0..4 => *value = MISSING_FEATURE,
            4 => *value = special[random.random_range(0..special.len())],
            _ => {}
        }
    }
    features
}

/// Compares with one row after the other, for every number of rows.
fn compare(model: &Model<'_>, features: &[i32], batch: &mut Batch) -> Result<(), TestCaseError> {
    let (width, objects) = (model.feature_count(), model.object_count());
    let mut one_by_one = vec![0; MOST * objects];
    let mut exact = vec![0.0_f32; MOST * objects];
    let mut is_float = true;
    for (index, row) in features.chunks_exact(width).enumerate() {
        let place = index * objects..(index + 1) * objects;
        prop_assert!(model.margins_of(row, &mut one_by_one[place.clone()]));
        is_float &= model.f32_margins_of(row, &mut exact[place]);
    }
    for count in COUNTS {
        let rows = &features[..count * width];
        let mut together = vec![-1; count * objects];
        prop_assert!(model.margins_of_rows(rows, &mut together, batch));
        prop_assert!(together == one_by_one[..count * objects], "{count} rows, {:?}", model.layout());
        let mut together = vec![-1.0_f32; count * objects];
        prop_assert_eq!(model.f32_margins_of_rows(rows, &mut together, batch), is_float);
        let bits = |margins: &[f32]| margins.iter().map(|margin| margin.to_bits()).collect::<Vec<_>>();
        prop_assert!(!is_float || bits(&together) == bits(&exact[..count * objects]), "{count} rows in f32");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn rows_at_once_have_the_margins_of_each_row_in_every_layout_and_leaf_type(shape in crate::shapes(20, 60, 9, 900), seed: u64) {
        let ensemble = random::ensemble(shape, seed);
        let mut batch = Box::new(Batch::new());
        let models = random::models(&ensemble, None);
        prop_assert!(models.len() >= 6, "{} models", models.len());
        for bytes in models {
            let model = Model::new(&bytes).unwrap();
            compare(&model, &rows(&ensemble, &model, seed), &mut batch)?;
        }
    }

    #[test]
    fn rows_of_up_to_256_features_at_once_have_the_margins_of_each(shape in crate::shapes(20, 60, 9, 900), features in 1..=256_usize, seed: u64) {
        let ensemble = random::over_rows(random::ensemble(shape, seed), features, 1.0);
        let mut batch = Box::new(Batch::new());
        for bytes in random::models(&ensemble, None) {
            let model = Model::new(&bytes).unwrap();
            compare(&model, &rows(&ensemble, &model, seed), &mut batch)?;
        }
    }
}

#[test]
fn rows_that_are_not_whole_are_refused() {
    let bytes = compile(&random::ensemble(Shape::SMALL, 5), &Settings::default()).unwrap().bytes;
    let model = Model::new(&bytes).unwrap();
    let mut batch = Box::new(Batch::new());
    let mut margins = [7; 12];
    for (features, margin_count) in [(2 * 4, 9), (2 * 4, 11), (2 * 3, 12), (2 * 4 + 1, 12), (0, 3)] {
        let wrong = model.margins_of_rows(&vec![0; features], &mut margins[..margin_count], &mut batch);
        assert!(!wrong && margins == [7; 12], "{features} features, {margin_count} margins");
    }
    assert!(!model.f32_margins_of_rows(&[0; 8], &mut [0.0; 12], &mut batch));
    assert!(model.margins_of_rows(&[0; 8], &mut margins, &mut batch) && margins != [7; 12]);
}
