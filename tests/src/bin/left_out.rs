//! Number of strangers that a model detects, each object being left out in turn.
//!
//! ```text
//! palpate capture DIR -o train --touches 21000 --pose
//! palpate capture DIR -o calibrate --touches 60000 --pose --seed 2
//! palpate capture DIR -o test --touches 21000 --pose --seed 3
//! palpate capture background -o shapes --touches 60000 --pose
//! cargo run --release -p palpate-tests --bin left_out -- curvature train calibrate test [shapes]
//! ```

use palpate::ensemble::train::Settings as Training;
use palpate::mesh::builtin::BACKGROUND_SHAPES;
use palpate::shared::Descriptor;
use palpate::shared::format::Held;
use palpate::strangers::{LeftOut, Sets, Settings, captured, leave_one_out};
use palpate::touches::Dataset;

fn main() -> palpate::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [descriptor, train, calibrate, test, background @ ..] = &arguments[..] else {
        eprintln!("left_out DESCRIPTOR TRAIN CALIBRATE TEST [BACKGROUND]");
        std::process::exit(2);
    };
    let read = |directory: &String| Dataset::read(directory.as_ref());
    let (train, calibrate, test) = (read(train)?, read(calibrate)?, read(test)?);
    let background = background.first().map(|directory| Dataset::read_any(directory.as_ref())).transpose()?;
    let shapes = captured(BACKGROUND_SHAPES, &calibrate.origin.clone().unwrap_or_default(), &())?;
    let descriptor = Descriptor::from_name(descriptor).unwrap_or(Descriptor::Curvature);
    let training = Training { descriptor, rounds: 40, depth: 5, ..Training::compact() };
    let sets = Sets { train: &train, calibrate: &calibrate, test: &test };
    let held = [None, Some(Held::Likely), Some(Held::Certain)];
    let settings = Settings::default();
    let found = leave_one_out(sets, background.as_ref(), &[shapes], &training, &settings, &held, &())?;
    for (held, found) in held.iter().zip(&found) {
        println!("\nstrangers {}", held.map_or("off", Held::name));
        println!(
            "object      at 30  at 60 at 120  named  alarms  touches   wrong undecided  least  threshold sequences"
        );
        found.iter().for_each(|left_out| line(&left_out.object, std::slice::from_ref(left_out)));
        line("mean", found);
    }
    Ok(())
}

fn line(name: &str, found: &[LeftOut]) {
    let mean = |of: &dyn Fn(&LeftOut) -> f64| found.iter().map(of).sum::<f64>() / found.len() as f64;
    let at = |touches: usize| mean(&|one: &LeftOut| one.strangers.detected[&touches]);
    let term = |of: fn(&palpate::shared::format::MisfitTerms) -> f64| {
        mean(&|one: &LeftOut| one.calibrated.as_ref().map_or(0.0, |calibrated| of(&calibrated.terms)))
    };
    println!(
        "{name:10} {:6.3} {:6.3} {:6.3} {:6.3} {:7.4} {:8.1} {:7.4} {:9.4} {:6.0} {:10.2} {:9.0}",
        at(30),
        at(60),
        at(120),
        mean(&|one| one.strangers.wrong_name),
        mean(&|one| one.strangers.false_alarms),
        mean(&|one| one.known.mean_touches),
        mean(&|one| one.known.error),
        mean(&|one| one.known.undecided),
        term(|terms| terms.least.into()),
        term(|terms| f64::from(terms.threshold) / 65_536.0),
        term(|terms| terms.sequences.into()),
    );
}
