//! Results that stay: what the program prints, and the files it writes, for settings that cover each kind of evidence, promise
//! and layout. `PALPATE_GOLDENS=write` records them again, for a change that is meant to change them.

use crate::{normal, stdout};
use palpate::ensemble::{Ensemble, Inputs, Node, Output, Provenance, Tree};
use std::fmt::Write as _;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// Commands whose output holds times, which is left out.
const TIMED: [&str; 2] = ["capture", "train"];

/// Centers of the classes' rows.
const CENTERS: [f64; 3] = [0.0, 1.2, 3.0];

/// The recorded results.
fn recorded(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cli/goldens").join(name)
}

/// The steps so far: the commands, their output, and checksums of what they wrote.
struct Script {
    directory: tempfile::TempDir,
    text: String,
}

impl Script {
    fn new() -> Self {
        Self { directory: tempfile::tempdir().unwrap(), text: String::new() }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    /// Runs a command in the directory; adds its output, unless it is one of [`TIMED`], and the checksum of the file that it wrote, if one is named.
    fn step(&mut self, line: &str) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let output = crate::command(&words).current_dir(self.directory.path()).output().unwrap();
        let output = stdout(output);
        writeln!(self.text, "$ palpate {line}").unwrap();
        if !TIMED.contains(&words[0]) {
            writeln!(self.text, "{}", output.trim_end()).unwrap();
        }
        let written = words.iter().position(|word| *word == "-o").map(|at| self.path(words[at + 1]));
        if let Some(bytes) = written.filter(|path| path.is_file()).map(|path| std::fs::read(path).unwrap()) {
            writeln!(self.text, "# {} bytes, {:016x}", bytes.len(), checksum(&bytes)).unwrap();
        }
    }

    /// Compares the results with the recorded ones of this name.
    #[track_caller]
    fn compare(self, name: &str) {
        let path = recorded(name);
        if std::env::var_os("PALPATE_GOLDENS").is_some_and(|value| value == "write") {
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(&path, &self.text).unwrap();
        }
        let expected = std::fs::read_to_string(&path).unwrap_or_default();
        for (number, (found, expected)) in self.text.lines().zip(expected.lines()).enumerate() {
            assert_eq!(found, expected, "{name}, line {}", number + 1);
        }
        assert_eq!(self.text.lines().count(), expected.lines().count(), "{name}: lines");
    }
}

/// FNV-1a, 64 bits.
fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

#[test]
fn calibration_and_evaluation_on_touches_stay() {
    let mut script = Script::new();
    for line in [
        // Full touches.
        "capture bowl fork hammer winebottle -o full --touches 1500 --json",
        "train full -o full.json --trees rounds=12,depth=4 --json",
        "export full.json -o full.palpate --json",
        "capture bowl fork hammer winebottle -o fresh --touches 4000 --seed 2 --json",
        "calibrate full.palpate fresh -o average.palpate --sequences 5000 --error-rate 5% --json",
        "calibrate full.palpate fresh -o name.palpate --sequences 5000 --error-rate 20% --per name --json",
        "calibrate full.palpate fresh -o object.palpate --sequences 5000 --error-rate 20% --per object",
        "evaluate average.palpate fresh --sequences 200 --prior bowl=0.5 --json",
        "evaluate average.palpate fresh --sequences 200 --only bowl,fork --real noise=2ms,missed=2% --json",
        "evaluate name.palpate fresh --sequences 200",
        // Every approach, and approaches that are chosen.
        "capture bowl fork hammer winebottle -o all --approaches 3000 --pose --json",
        "train all -o oriented.json --descriptor oriented --evidence all --trees rounds=12,depth=4",
        "export oriented.json -o oriented.palpate",
        "capture bowl fork hammer winebottle -o fresh-all --approaches 3000 --pose --seed 2",
        "calibrate oriented.palpate fresh-all -o all.palpate --sequences 5000 --error-rate 5% --real noise=1ms --json",
        "plan oriented.palpate fresh-all -o planned.palpate --rolls 1 --json",
        "calibrate planned.palpate fresh-all -o active.palpate --active --sequences 5000 --error-rate 10% --json",
        "evaluate all.palpate fresh-all --sequences 100 --json",
        "evaluate active.palpate fresh-all --sequences 100 --active --json",
        "verify oriented.palpate oriented.json fresh-all --sequences 100 --json",
        // A table.
        "capture bowl fork -o table --approaches 3000 --scene table --pose",
        "train table -o table.json --descriptor gravity --evidence all --trees rounds=12,depth=4",
        "export table.json -o table.palpate",
        "capture bowl fork -o fresh-table --approaches 6000 --scene table --pose --seed 2",
        "calibrate table.palpate fresh-table -o table-5.palpate --sequences 5000 --error-rate 5% --json",
        "evaluate table-5.palpate fresh-table --sequences 50 --json",
    ] {
        script.step(line);
    }
    script.compare("touches.txt");
}

/// Trees that are exact for rows that are normal about the classes' centers: steps of the log density, at quarters.
pub(crate) fn densities(
    inputs: Inputs,
    objects: [&str; 3],
    centers: [f64; 3],
    quarters: RangeInclusive<i32>,
) -> Ensemble {
    let leaf = |x: f64| Node::Leaf(centers.map(|center| (-0.5 * (x - center).powi(2)) as f32).to_vec());
    let mut nodes = Vec::new();
    let mut last = 0.0;
    for cut in quarters.map(|quarter| f64::from(quarter) * 0.25) {
        let (threshold, here) = (cut as f32, nodes.len());
        nodes.push(Node::Split { feature: 0, threshold, missing_left: true, left: here + 1, right: here + 2 });
        nodes.push(leaf(cut - 0.125));
        last = cut;
    }
    nodes.push(leaf(last + 0.125));
    Ensemble {
        inputs,
        objects: objects.map(String::from).to_vec(),
        base_margins: vec![0.0; 3],
        trees: vec![Tree { nodes, output: Output::Each }],
        origin: Provenance::default(),
    }
}

/// Sequences of twelve rows as CSV, three of each group, with an offset for each sequence.
fn sequences(count: usize, mut state: u64) -> String {
    let mut text = String::from("f0,kind,id,person\n");
    for id in 0..count {
        let (class, offset) = (id % CENTERS.len(), 0.4 * normal(&mut state));
        for _ in 0..12 {
            let x = CENTERS[class] + offset + normal(&mut state);
            writeln!(text, "{x:.4},{},{id},{}", ["a", "b", "c"][class], id / 3).unwrap();
        }
    }
    text
}

#[test]
fn calibration_and_evaluation_on_rows_stay() {
    let mut script = Script::new();
    let ensemble = densities(Inputs::unnamed(1), ["a", "b", "c"], CENTERS, -20..=28);
    ensemble.save(script.path("rows.json")).unwrap();
    std::fs::write(script.path("calibration.csv"), sequences(900, 1)).unwrap();
    std::fs::write(script.path("unseen.csv"), sequences(300, 2)).unwrap();
    let columns = "--label kind --sequence-column id";
    script.step("export rows.json -o rows.palpate --json");
    for line in [
        format!("rows calibrate rows.palpate calibration.csv {columns} -o average.palpate --error-rate 10% --json"),
        format!(
            "rows calibrate rows.palpate calibration.csv {columns} -o name.palpate --error-rate 20% --per name --json"
        ),
        format!(
            "rows calibrate rows.palpate calibration.csv {columns} -o object.palpate --error-rate 20% --per object"
        ),
        format!(
            "rows calibrate rows.palpate calibration.csv {columns} --group-column person -o groups.palpate --error-rate 10% --json"
        ),
        format!("rows evaluate average.palpate unseen.csv {columns} --json"),
        format!("rows evaluate name.palpate unseen.csv {columns}"),
        format!("rows evaluate groups.palpate unseen.csv {columns} --group-column person --json"),
        "rows evaluate rows.palpate unseen.csv --label kind --json".to_owned(),
    ] {
        script.step(&line);
    }
    script.compare("rows.txt");
}
