//! Prints all that a page of the built-in objects and these models must compute in ten rounds with each object:
//! `.ci/pages/play.js` compares each of the 10,000 approaches with the page's own.
//!
//! ```text
//! palpate play --model MODEL -o game.html
//! cargo run --release -p palpate-tests --bin page -- MODEL >trace.txt
//! ```

use palpate::compile::CompiledModel;
use palpate::error::Result;
use palpate::mesh::builtin;
use palpate::probe::noise::Noise;
use palpate::touches::Origin;
use palpate_report::play;
use palpate_tests::page::trace;

fn main() -> Result<()> {
    let models = std::env::args().skip(1).map(CompiledModel::read).collect::<Result<Vec<_>>>()?;
    let mut objects = builtin::all()?;
    // The page has them in the order of their names.
    objects.sort_by(|one, other| one.name.cmp(&other.name));
    let surfaces = play::surfaces(&objects, &Origin::default())?;
    print!("{}", trace(&surfaces, &models, &Noise::switch(), 10)?);
    Ok(())
}
