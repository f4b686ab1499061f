//! Honest recordings of two robots in a physics engine, whose fingers bend and whose objects may give way. They are not part
//! of this repository: the directory that `PALPATE_SHARED` names has them.

use super::*;
use crate::mesh::source;
use crate::tests::repetitions::repetitions;
use crate::touches::{ObjectTouches, Source, read_touches};
use std::path::{Path, PathBuf};

/// Recorded approaches to each object in a set, and presses on the plate.
const SET: usize = 75;
const PRESSES: usize = 20;

/// The recorded approaches in a directory, those in this range of each file.
fn read(directory: &Path, range: std::ops::Range<usize>) -> Dataset {
    let mut files: Vec<PathBuf> = std::fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let one = |path: &PathBuf| {
        let touches = read_touches(path).unwrap()[range.clone()].to_vec();
        ObjectTouches::new(path.file_stem().unwrap().to_str().unwrap(), touches, Source::Object)
    };
    Dataset::new(files.iter().map(one).collect())
}

/// Everything that does not differ from set to set.
struct Bench {
    objects: Vec<Object>,
    densities: Vec<Densities>,
}

impl Bench {
    fn object_of(&self, dataset: &Dataset) -> Vec<usize> {
        dataset
            .objects
            .iter()
            .map(|recording| place(&recording.name, self.objects.iter().map(|object| object.name.as_str())).unwrap())
            .collect()
    }

    /// The fit, and the log-densities of other touches under it.
    fn fitted(&self, recorded: &Dataset, plate: Option<&[Touch]>, held: &Dataset) -> (Best, Vec<f64>) {
        let (object_of, kept) = (self.object_of(recorded), kept(recorded));
        let recordings: Vec<Recording<'_>> = recorded
            .objects
            .iter()
            .map(|object| Recording::without_poses(&object.name, object.touches(), kept))
            .collect();
        let evidence = Evidence {
            recordings: &recordings,
            objects: &self.densities,
            object_of,
            plate: plate.map(|touches| Plate::new(touches.iter().map(Observed::of))),
            stroke: Stroke::default(),
        };
        let best = search::best(&|candidate: &Hypothesis| evidence.log_likelihood(candidate), None);
        let densities = |(held, object): (&ObjectTouches, usize)| {
            let explained = Explained::new(&best.candidate, &self.densities[object], kept);
            held.touches().iter().map(|touch| explained.log_density(&Observed::of(touch))).collect::<Vec<f64>>()
        };
        let held = held.objects.iter().zip(self.object_of(held)).flat_map(densities).collect();
        (best, held)
    }
}

/// By default one set of each robot, and fewer simulated approaches; `PALPATE_REPETITIONS=4 cargo test --release -p palpate --lib
/// compliant_robots -- --nocapture` has all four.
#[test]
fn a_plate_makes_no_fit_to_compliant_robots_worse() {
    let shared = std::env::var_os("PALPATE_SHARED").map_or_else(|| "../../shared".into(), PathBuf::from);
    if !shared.join("recorded/robot-c").exists() {
        println!("SKIPPED: no recordings of robots (set PALPATE_SHARED)");
        return;
    }
    let sets = repetitions(1).min(4) as usize;
    let settings = match sets {
        1 => FitSettings { approaches: 60_000, ..FitSettings::default() },
        _ => FitSettings::default(),
    };
    let objects = source::objects(&[shared.join("objects").to_str().unwrap().into()]).unwrap();
    let scenes = scenes(&objects, &settings, &()).unwrap();
    let touched = touched::touched(&objects, scenes, &Dataset::default());
    let simulated = Simulated::new(touched, Layer::default(), &settings, &()).unwrap();
    let densities = simulated.densities(Stroke::default());
    drop(simulated);
    let bench = Bench { objects, densities };
    for robot in ["c", "d"] {
        let directory = shared.join(format!("recorded/robot-{robot}"));
        let presses = read_touches(&directory.join("plate.txt")).unwrap();
        let held = read(&directory.join("more"), 300..600);
        for set in 0..sets {
            let recorded = read(&directory.join("known"), SET * set..SET * (set + 1));
            let plate = &presses[PRESSES * set..PRESSES * (set + 1)];
            let [without, with] = [None, Some(plate)].map(|plate| bench.fitted(&recorded, plate, &held));
            let gains: Vec<f64> = with.1.iter().zip(&without.1).map(|(with, without)| with - without).collect();
            let (count, gain) = (gains.len() as f64, gains.iter().sum::<f64>());
            let error = (gains.iter().map(|own| (own - gain / count).powi(2)).sum::<f64>()).sqrt();
            for (name, (best, held)) in [("without", &without), ("with", &with)] {
                let Hypothesis { factor, late, noise, .. } = best.candidate;
                let held = held.iter().sum::<f64>();
                println!(
                    "robot-{robot}, set {set}, {name} a plate: held-out {held:.1}, speed {:.3}, late {late:.2?}, noise {noise:.2}",
                    1.0 / factor
                );
            }
            println!("    the plate gains {gain:.1} ± {error:.1} nats");
            // Two standard errors are lost by chance in every sixth run of eight such comparisons, three in every ninetieth.
            assert!(gain > -3.0 * error, "robot-{robot}, set {set}: {gain} ± {error}");
        }
    }
}
