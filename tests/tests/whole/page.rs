use palpate::compile::CompiledModel;
use palpate::mesh::{Mesh, Object};
use palpate::play::Game;
use palpate::probe::noise::Noise;
use palpate::touches::Origin;
use palpate_report::play::surfaces;
use palpate_tests::HOUSEHOLD;
use palpate_tests::page::{line, trace};

#[test]
fn a_trace_is_what_the_game_computes() {
    let objects = [("disc", 0.1), ("globe", 1.0)]
        .map(|(name, height)| Object::new(name, Mesh::globe(12).stretched([1.0, 1.0, height])));
    let surfaces = surfaces(&objects, &Origin::default()).unwrap();
    let model = CompiledModel::from_bytes(HOUSEHOLD.to_vec()).unwrap();
    let trace = trace(&surfaces, std::slice::from_ref(&model), &Noise::switch(), 2).unwrap();
    assert_eq!(trace.lines().count(), 400);
    let mut game = Game::new(&Origin::default());
    game.set_noise(Noise::switch()).unwrap();
    for surface in &surfaces {
        game.add_object(&surface.name, &surface.mesh(), surface.length).unwrap();
    }
    game.add_model(model.model()).unwrap();
    let mut lines = trace.lines();
    for (object, seed) in [(0, 1), (0, 2), (1, 1), (1, 2)] {
        let mut round = game.round(object, seed).unwrap();
        for index in 0..100 {
            let touch = game.touch_at_random(&mut round).touch;
            let times = touch.times().map(|time| time.micros().map_or("-".into(), |micros| micros.to_string()));
            let own = format!("{object} {seed} {index} {}{}", times.join(" "), line(&round.players[0].recognizer));
            assert_eq!(lines.next(), Some(own.as_str()));
        }
    }
    assert!(trace.lines().any(|line| line.contains(" 1 ")));
}
