use crate::fixtures::*;
use glam::DVec3;
use palpate::capture;
use palpate::compile::{self, compile};
use palpate::ensemble::{self, inputs};
use palpate::play::Game;
use palpate::probe::approach::{Approach, CLEARANCE};
use palpate::probe::hand::Unreached;

/// A nat or less for the disc where the surface is flat, for the globe where it is bent; of full touches.
fn model() -> Vec<u8> {
    let nodes = vec![
        Node::Split { feature: 0, threshold: 9_000.0, missing_left: true, left: 1, right: 2 },
        Node::Leaf(vec![0.25, -0.25]),
        Node::Leaf(vec![-0.75, 0.75]),
    ];
    let ensemble = Ensemble {
        inputs: inputs(Descriptor::Curvature),
        objects: vec!["disc".into(), "globe".into()],
        base_margins: vec![0.0; 2],
        trees: vec![Tree { nodes, output: Output::Each }],
        origin: ensemble::Provenance::default(),
    };
    compile(&ensemble, &compile::Settings::default()).unwrap().bytes
}

/// The disc and the globe.
fn game(model: &[u8]) -> Game<'_> {
    let mut game = Game::new(&Origin::default());
    for (name, height) in [("disc", 0.1), ("globe", 1.0)] {
        game.add_object(name, &Mesh::globe(12).stretched([1.0, 1.0, height]), 10.0).unwrap();
    }
    game.add_model(compile::open(model).unwrap()).unwrap();
    game
}

#[test]
fn the_approaches_of_a_round_are_the_samples_of_a_capture_with_its_seed_and_noise() {
    let bytes = model();
    let mut game = game(&bytes);
    let noise = with!(Noise::switch(), bent = [0.0, 2_000.0, 0.0]);
    game.set_noise(noise).unwrap();
    let origin = Origin { approaches: true, pose: true, seed: 7, ..Origin::default() };
    let scene = std::slice::from_ref(game.scene(0).unwrap());
    let captured = capture::touches(scene, "disc", &origin, 0..200).unwrap();
    let mut round = game.round(0, 7).unwrap();
    for (index, captured) in (0..).zip(captured.touches().iter().copied()) {
        let approached = game.touch_at_random(&mut round);
        assert_eq!(approached.exact, captured);
        assert_eq!(noise.add("disc", &[captured], (7 << 32) + index), [approached.touch]);
    }
}

#[test]
fn a_player_does_what_its_recognizer_does_and_stops_with_the_verdict() {
    let bytes = model();
    let game = game(&bytes);
    let mut round = game.round(1, 1).unwrap();
    let model = compile::open(&bytes).unwrap();
    let mut alone = Recognizer::<2>::new(&model, Stopping::from_model(&model)).unwrap();
    let (mut approaches, mut refused) = (0, 0);
    while alone.verdict() == Verdict::Undecided {
        let approached = game.touch_at_random(&mut round);
        let said = alone.push(&approached.touch).err();
        approaches += 1;
        refused += u32::from(said.is_some());
        let player = &round.players[0];
        assert_eq!((player.refused, player.approaches), (said, approaches));
        assert_eq!(player.recognizer.evidence(), alone.evidence());
    }
    assert!(refused > 0 && refused < approaches);
    let Verdict::Recognized { object: 1, .. } = alone.verdict() else { panic!("{:?}", alone.verdict()) };
    let player = &round.players[0];
    let (posteriors, thresholds) = (player.posteriors(), player.thresholds());
    assert!((posteriors.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    assert!((posteriors[1] - alone.posterior(1).to_f64()).abs() < 1e-6);
    assert!(posteriors[1] >= thresholds[1] && thresholds[1] > 0.9);
    game.touch_at_random(&mut round);
    assert_eq!(round.players[0].approaches, approaches);
}

#[test]
fn an_aimed_approach_moves_along_its_line_and_is_none_beside_the_object() {
    let bytes = model();
    let game = game(&bytes);
    let mut round = game.round(1, 1).unwrap();
    let (eye, direction) = (DVec3::new(30.0, 1.0, 0.5), DVec3::new(-2.0, 0.0, 0.0));
    let approached = game.touch_along(&mut round, eye, direction, 0.3).unwrap();
    let Approach { start, direction, alignment } = approached.approach;
    assert_eq!((start.y, start.z, direction), (1.0, 0.5, DVec3::NEG_X));
    assert!(alignment.dot(direction).abs() < 1e-12 && (alignment.length() - 1.0).abs() < 1e-12);
    let [low, high] = game.scene(1).unwrap().bounds();
    assert!((start.length() - (high - low).length() / 2.0 - CLEARANCE).abs() < 1e-9);
    assert!(approached.distances[1].is_some());
    // Beside it, beyond where approaches start, and nowhere.
    for (point, direction) in [
        (DVec3::new(30.0, 6.0, 0.0), DVec3::NEG_X),
        (DVec3::new(30.0, 60.0, 0.0), DVec3::NEG_X),
        (eye, DVec3::ZERO),
        (DVec3::NAN, DVec3::NEG_X),
    ] {
        assert_eq!(game.touch_along(&mut round, point, direction, 0.0), None);
    }
    assert_eq!(round.players[0].approaches, 1);
}

#[test]
fn what_cannot_be_played_with_is_refused() {
    let bytes = model();
    let mut game = game(&bytes);
    assert!(game.add_object("nothing", &Mesh::default(), 10.0).is_err());
    assert!(game.add_object("small", &Mesh::globe(4), 0.0).is_err());
    assert!(game.set_noise(with!(Noise::default(), timer = -1.0)).is_err());
    assert!(game.round(2, 1).is_none());
    let mut round = game.round(0, 1).unwrap();
    assert_eq!(game.touch_as_planned(&mut round, 0), None);
    assert_eq!(game.touch_as_planned(&mut round, 1), None);
    let rows = Ensemble {
        inputs: ensemble::Inputs::unnamed(1),
        objects: vec!["a".into(), "b".into()],
        base_margins: vec![0.0; 2],
        trees: vec![Tree { nodes: vec![Node::Leaf(vec![0.0, 0.5])], output: Output::Each }],
        origin: ensemble::Provenance::default(),
    };
    let rows = compile(&rows, &compile::Settings::default()).unwrap().bytes;
    let error = Game::new(&Origin::default()).add_model(compile::open(&rows).unwrap()).unwrap_err();
    assert!(error.to_string().contains("the model works on rows of features"), "{error}");
}

#[test]
fn a_finger_that_the_hand_does_not_reach_is_missing_with_the_reason() {
    let probe = with!(Probe::default(), stroke = Some(1.0), travel = Some(9.0));
    let mut game = Game::new(&Origin { probe, ..Origin::default() });
    game.add_object("disc", &Mesh::globe(12).stretched([1.0, 1.0, 0.1]), 10.0).unwrap();
    let origin = Origin { approaches: true, pose: true, seed: 7, probe, ..Origin::default() };
    let captured = capture::touches(std::slice::from_ref(game.scene(0).unwrap()), "disc", &origin, 0..300).unwrap();
    let mut round = game.round(0, 7).unwrap();
    let mut reasons = [0, 0];
    for captured in captured.touches() {
        let approached = game.touch_at_random(&mut round);
        assert_eq!(approached.touch, *captured);
        let way = approached.approach.distances(game.scene(0).unwrap(), &probe);
        let fingers = captured.times().into_iter().zip(way).zip(approached.unreached).zip(approached.distances);
        for (((time, way), unreached), distance) in fingers {
            assert_eq!(unreached.is_some(), way.is_some() && time.is_missing());
            assert_eq!(distance, way.filter(|_| !time.is_missing()));
            match unreached {
                Some(Unreached::Stroke) => reasons[0] += 1,
                Some(Unreached::Travel) => reasons[1] += 1,
                None => {}
            }
        }
    }
    assert!(reasons.iter().all(|count| *count > 10), "{reasons:?}");
}
