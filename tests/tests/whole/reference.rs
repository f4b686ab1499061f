//! Our contact times against those computed in quad precision.

use palpate::probe::scene::Scene;
use palpate_tests::casts::{self, Agreement};
use std::path::{Path, PathBuf};

/// The radius of the reference casts, the nearest f32.
const RADIUS: f32 = 0.15;

/// Largest allowed error of a set. Far casts start up to 100,000 units away, where the start itself has no more digits.
fn tolerance(set: &str) -> f64 {
    if set == "far" { 1e-6 } else { 1e-9 }
}

fn agreement(directory: &Path, name: &str) -> Vec<Agreement> {
    let scene = Scene::as_is(&palpate::mesh::obj::read(&directory.join(format!("{name}.obj"))).unwrap()).unwrap();
    let casts = casts::read(&directory.join(format!("{name}.casts.csv")));
    let time = |cast: &casts::Cast| scene.first_contact(cast.origin, cast.direction, RADIUS.into());
    casts::agreement(&casts, &casts.iter().map(time).collect::<Vec<_>>())
}

fn check(directory: &Path, name: &str) {
    let sets = agreement(directory, name);
    assert_eq!(sets.iter().map(|set| set.casts).sum::<usize>(), 1400);
    for set in sets {
        assert!(set.missed == 0 && set.false_contacts == 0, "{name}: {set:?}");
        assert!(set.largest_error <= tolerance(&set.set), "{name}: {set:?}");
    }
}

#[test]
fn slivers_are_touched_when_and_where_the_reference_says() {
    check(&Path::new(env!("CARGO_MANIFEST_DIR")).join("data"), "slivers");
}

#[test]
fn real_objects_are_touched_when_and_where_the_reference_says() {
    let shared = std::env::var_os("PALPATE_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared"), PathBuf::from);
    let directory = shared.join("reference");
    if !directory.is_dir() {
        eprintln!("SKIPPED: no reference casts in {} (set PALPATE_SHARED)", directory.display());
        return;
    }
    for name in ["paperclip", "scissors", "winebottle"] {
        check(&directory, name);
    }
}
