//! Statements of a model about its training are read back, and those that a reader does not know are refused or skipped
//! by name.

use palpate::compile::Leaf;
use palpate_onboard::{Model, ModelError};
use palpate_shared::Descriptor;
use palpate_shared::format::{
    MUST_UNDERSTAND, PatternShares, Tag, Trained, TrainedNoise, TrainedTouches, checksum, write_section,
};
use palpate_tests::abuse;
use palpate_tests::random::{self, Shape};
use palpate_tests::sections::{trained, with_sections};

const TRAINED: Trained = Trained {
    noise: Some(TrainedNoise { least: 0, largest: 10_000, timer: 1_000, pose: 0 }),
    shares: Some(PatternShares([1, 2, 3, 4, 5, 65_520])),
    ..abuse::TRAINED
};

fn model(descriptor: Descriptor) -> Vec<u8> {
    random::model(Shape { descriptor, thresholds: 20, leaf: 0.5, ..Shape::SMALL }, 1, Leaf::I16)
}

/// A model with one section of any tag and content.
fn with_section(tag: u16, content: &[u8]) -> Vec<u8> {
    let mut section = Vec::new();
    write_section(Tag::FeatureNames, false, content, &mut |bytes| section.extend_from_slice(bytes));
    section[..2].copy_from_slice(&tag.to_le_bytes());
    with_sections(&model(Descriptor::Curvature), &section)
}

#[test]
fn what_a_model_states_is_read_back_and_changes_no_margin() {
    let plain = model(Descriptor::ContactsCurvature);
    let stated = trained(&plain, &TRAINED);
    let (plain, stated) = (Model::new(&plain).unwrap(), Model::new(&stated).unwrap());
    let read = Trained {
        probe: stated.probe(),
        touches: Some(stated.trained_touches()),
        noise: stated.noise(),
        shares: stated.pattern_shares(),
    };
    assert_eq!(read, TRAINED);
    assert_eq!(stated.optional_sections().map(|section| section.tag).collect::<Vec<_>>(), [1, 2, 3, 9]);
    assert_eq!((stated.header().version(), plain.header().version()), (2, 1));
    assert_eq!((stated.object_name(2), stated.prior(1)), (plain.object_name(2), plain.prior(1)));
    let (mut a, mut b) = ([0; 3], [0; 3]);
    for touch in random::touches(500, 1) {
        plain.margins(&touch, &mut a);
        stated.margins(&touch, &mut b);
        assert_eq!(a, b);
    }
}

#[test]
fn a_model_without_sections_was_trained_on_full_touches_with_a_pose_if_its_descriptor_needs_one() {
    for descriptor in Descriptor::ALL {
        let bytes = model(descriptor);
        let model = Model::new(&bytes).unwrap();
        assert_eq!(model.header().version(), 1);
        assert_eq!(model.trained_touches(), TrainedTouches::full(descriptor.needs_pose()));
        assert_eq!((model.probe(), model.noise(), model.optional_sections().count()), (None, None, 0));
    }
}

#[test]
fn a_version_1_model_with_anything_in_the_reserved_bytes_is_read_as_before() {
    let mut bytes = model(Descriptor::Curvature);
    bytes[92..96].copy_from_slice(&[8, 0, 0, 0]);
    let body = bytes.len() - 4;
    let sum = checksum(&bytes[..body]);
    bytes[body..].copy_from_slice(&sum.to_le_bytes());
    assert_eq!(Model::new(&bytes).unwrap().optional_sections().count(), 0);
}

#[test]
fn an_unknown_section_is_skipped_unless_it_must_be_understood() {
    let bytes = with_section(77, &[1, 2, 3]);
    let model = Model::new(&bytes).unwrap();
    let sections: Vec<_> = model.optional_sections().map(|section| (section.tag, section.content.to_vec())).collect();
    assert_eq!(sections, [(77, vec![1, 2, 3])]);
    let error = Model::new(&with_section(77 | MUST_UNDERSTAND, &[1, 2, 3])).unwrap_err();
    assert!(matches!(error, ModelError::NotUnderstood { tag: 77, .. }), "{error:?}");
    assert!(error.to_string().contains("section 77"), "{error}");
}

#[test]
fn sections_that_are_out_of_order_doubled_cut_or_make_no_sense_are_refused() {
    let plain = model(Descriptor::Curvature);
    let section = |tag: Tag, content: &[u8]| {
        let mut bytes = Vec::new();
        write_section(tag, false, content, &mut |part| bytes.extend_from_slice(part));
        bytes
    };
    let noise = section(Tag::Noise, &TRAINED.noise.unwrap().to_bytes());
    let touches = section(Tag::Touches, &TRAINED.touches.unwrap().to_bytes());
    Model::new(&with_sections(&plain, &[&touches[..], &noise].concat())).unwrap();
    let invalid = [
        [&noise[..], &touches].concat(),
        [&noise[..], &noise].concat(),
        section(Tag::Touches, &[0; 8]),
        section(Tag::Noise, &[1; 4]),
    ];
    for sections in invalid {
        let error = Model::new(&with_sections(&plain, &sections)).unwrap_err();
        assert!(matches!(error, ModelError::Field { .. }), "{error:?}");
    }
    for length in 1..noise.len() {
        let error = Model::new(&with_sections(&plain, &noise[..length])).unwrap_err();
        assert!(matches!(error, ModelError::Section { .. }), "{length} bytes: {error:?}");
    }
}
