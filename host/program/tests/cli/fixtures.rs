//! Folders that several tests start from. The first test that needs one makes it by the program's commands; every test gets
//! files of its own.

use crate::compiled::ensemble;
use crate::{Folder, read, shapes, succeeds, touches};
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// A folder that is made once. Where a command fails, each test that needs the folder runs it again and shows its message.
pub(crate) struct Fixture {
    make: fn(&Path),
    /// The files, by their paths in the folder.
    files: OnceLock<Vec<(PathBuf, Vec<u8>)>>,
}

impl Fixture {
    const fn new(make: fn(&Path)) -> Self {
        Self { make, files: OnceLock::new() }
    }

    /// A folder of one test with these files.
    pub(crate) fn folder(&self) -> Folder {
        let directory = Folder::new();
        self.put(&directory);
        directory
    }

    /// Writes the files into a directory.
    pub(crate) fn put(&self, directory: &Path) {
        let files = self.files.get_or_init(|| {
            let made = Folder::new();
            (self.make)(&made);
            let mut files = Vec::new();
            collect(&made, Path::new(""), &mut files);
            files
        });
        for (name, bytes) in files {
            let path = directory.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, bytes).unwrap();
        }
    }
}

fn collect(root: &Path, below: &Path, files: &mut Vec<(PathBuf, Vec<u8>)>) {
    for entry in fs::read_dir(root.join(below)).unwrap() {
        let entry = entry.unwrap();
        let name = below.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            collect(root, &name, files);
        } else {
            files.push((name, fs::read(entry.path()).unwrap()));
        }
    }
}

/// A model of two objects, one flat and one curved: `ensemble.json`, `model.palpate`, and a few touches in `data`.
pub(crate) static ONE_SPLIT: Fixture = Fixture::new(|at| {
    ensemble().save(at.join("ensemble.json")).unwrap();
    fs::create_dir(at.join("data")).unwrap();
    fs::write(at.join("data/bowl.txt"), "0 0 0.01\n0 0.001 0\n").unwrap();
    fs::write(at.join("data/fork.txt"), "0 0 0.08\n0.09 0 0.01\n").unwrap();
    succeeds(at, "export ensemble.json -o model.palpate");
});

/// Approaches with these numbers to objects that bend by at most the stated microseconds. Other numbers give other approaches. A
/// third of them misses the last finger, unless only `full` touches are wanted.
pub(crate) fn spread(directory: &Path, objects: &[(&str, u64)], numbers: Range<u64>, full: bool) {
    fs::create_dir_all(directory).unwrap();
    for (name, bend) in objects {
        let spread = |index: u64, prime: u64, range: u64| (index.wrapping_mul(prime) >> 7) % range;
        let lines = numbers.clone().map(|index| {
            let slope = spread(index, 0x9e37_79b9_7f4a_7c15, 300_007);
            let bend = spread(index, 0xd134_2543_de82_ef95, *bend);
            let [a, b, c] = [0, slope / 2 + bend, slope].map(|micros| format!("{:.6}", micros as f64 * 1e-6));
            if !full && index % 3 == 0 { format!("{a} {b} -\n") } else { format!("{a} {b} {c}\n") }
        });
        fs::write(directory.join(format!("{name}.txt")), lines.collect::<String>()).unwrap();
    }
}

/// Two objects; the second bends twice as much.
const TWO: &[(&str, u64)] = &[("bowl", 100_000), ("fork", 200_000)];

/// 400 touches of each of two objects in `data`, `ensemble.json` and `model.palpate` of them.
pub(crate) static BOWL_AND_FORK: Fixture = Fixture::new(|at| {
    spread(&at.join("data"), TWO, 0..400, true);
    succeeds(at, "train data -o ensemble.json --trees rounds=5");
    succeeds(at, "export ensemble.json -o model.palpate");
});

/// A model of two objects in `train`, other touches of them in `fresh` and `unseen`, and `calibrated.palpate`, which promises
/// 5 %.
pub(crate) static CALIBRATED: Fixture = Fixture::new(|at| {
    spread(&at.join("train"), TWO, 0..2_000, true);
    spread(&at.join("fresh"), TWO, 1_000_000..1_010_000, true);
    spread(&at.join("unseen"), TWO, 2_000_000..2_003_000, true);
    succeeds(at, "train train -o ensemble.json --trees rounds=10");
    succeeds(at, "export ensemble.json -o model.palpate");
    succeeds(at, "calibrate model.palpate fresh -o calibrated.palpate --error-rate 5%");
});

/// Touches of a bowl and a fork in `data`, `fresh` and `unseen`, of three shapes, of a kettle in `others`, and a model.
pub(crate) static STRANGERS: Fixture = Fixture::new(|at| {
    let shapes = [("shape-a", 50_000), ("shape-b", 400_000), ("shape-c", 700_000)];
    for (folder, objects, count, seed) in [
        ("data", TWO, 1_000, 1),
        ("shapes", &shapes, 1_000, 1),
        ("fresh", TWO, 20_000, 2),
        ("unseen", TWO, 2_000, 3),
        ("others", &[("kettle", 550_000)], 2_000, 3),
    ] {
        fs::create_dir(at.join(folder)).unwrap();
        for (name, most) in objects {
            touches(&at.join(folder).join(format!("{name}.txt")), [*most, count, seed], false, "");
        }
    }
    succeeds(at, "train data -o ensemble.json --trees rounds=5");
    succeeds(at, "export ensemble.json -o model.palpate");
});

/// Two simulated objects in `data` and an ensemble of them, other touches of them and of a pot in `unseen`, and 300 recorded
/// touches in `pot.txt`. Some touches miss a finger.
pub(crate) static TAUGHT: Fixture = Fixture::new(|at| {
    for (file, most, count, seed) in [
        ("data/bowl", 100_000, 1_500, 1),
        ("data/fork", 200_000, 1_500, 1),
        ("unseen/bowl", 100_000, 1_500, 2),
        ("unseen/fork", 200_000, 1_500, 2),
        ("unseen/pot", 500_000, 1_500, 2),
        ("pot", 500_000, 300, 5),
    ] {
        let path = at.join(format!("{file}.txt"));
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        touches(&path, [most, count, seed], true, "");
    }
    succeeds(at, "train data -o ensemble.json --trees rounds=6,depth=4");
});

/// Three shapes in `meshes`, touched as `train`, `fresh` and `unseen`; a model that knows the pose, and the same with a plan.
pub(crate) static PLANNED: Fixture = Fixture::new(|at| {
    shapes(at);
    for (data, seed) in [("train", 1), ("fresh", 2), ("unseen", 3)] {
        succeeds(at, &format!("capture meshes -o {data} --approaches 1500 --pose --seed {seed}"));
    }
    succeeds(at, "train train -o ensemble.json --descriptor oriented --evidence all --trees rounds=8");
    succeeds(at, "export ensemble.json -o model.palpate");
    succeeds(at, "plan model.palpate fresh -o planned.palpate --rolls 1");
});

/// A box with these sides in millimeters, as an OBJ file.
pub(crate) fn brick(path: &Path, sides: [f64; 3]) {
    let corner = |corner: usize| {
        let [x, y, z] = [0, 1, 2].map(|axis| if corner >> axis & 1 == 0 { 0.0 } else { sides[axis] });
        format!("v {x} {y} {z}\n")
    };
    let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    fs::write(path, (0..8).map(corner).collect::<String>() + faces).unwrap();
}

/// Two boxes in `meshes`.
pub(crate) fn boxes(directory: &Path) {
    fs::create_dir(directory.join("meshes")).unwrap();
    brick(&directory.join("meshes/brick.obj"), [60.0, 40.0, 30.0]);
    brick(&directory.join("meshes/slab.obj"), [70.0, 50.0, 10.0]);
}

/// Two boxes on a table in `data` and `fresh`, a model of them, and recordings of them in each placement in `stated`, made of
/// files beside it.
pub(crate) static TABLE: Fixture = Fixture::new(|at| {
    boxes(at);
    for (name, seed, count) in [("data", 1, 2_000), ("robot", 2, 600), ("fresh", 3, 4_000)] {
        let scene = "--scene table --pose";
        succeeds(at, &format!("capture meshes -o {name} {scene} --approaches {count} --seed {seed}"));
    }
    succeeds(at, "train data -o e.json --descriptor gravity --evidence all --trees rounds=8,leaf_bits=16");
    succeeds(at, "export e.json -o model.palpate");
    for object in read(&at.join("robot/dataset.json"))["objects"].as_array().unwrap() {
        let name = object["name"].as_str().unwrap();
        for pool in object["pools"].as_array().unwrap() {
            let [placement, file] = [&pool["placement"]["name"], &pool["file"]].map(|text| text.as_str().unwrap());
            fs::copy(at.join(format!("robot/{name}/{file}.txt")), at.join(format!("{name}{placement}.txt"))).unwrap();
            let record = format!("data record {name}{placement}.txt -o stated --object {name}/{placement} --pose");
            succeeds(at, &record);
        }
    }
});

/// Meshes of a bowl and a mouse in `meshes`, and touches of them that an imperfect probe of `true.toml` recorded: without a
/// listing, as a robot's are.
pub(crate) static CROOKED: Fixture = Fixture::new(|at| {
    let real = "speed_factor = 0.9\noffsets = [0.0, -0.04, 0.0]\nnoise = \"2ms\"\ntimer = \"1ms\"\n";
    let missed = "missed = [\"0%\", \"4%\", \"0%\"]\n";
    let probe = format!("radius = 0.15\nspacing = 1.5\nspeed = 10.0\n[real]\n{real}{missed}");
    fs::write(at.join("true.toml"), probe).unwrap();
    succeeds(at, "data objects bowl mouse -o meshes");
    succeeds(at, "capture meshes -o recorded --probe true.toml --seed 5 --approaches 400");
    let stated = read(&at.join("recorded/dataset.json"))["settings"]["real"].take();
    assert_eq!((&stated["speed"], &stated["missed"]), (&0.9.into(), &serde_json::json!([0.0, 0.04, 0.0])));
    fs::remove_file(at.join("recorded/dataset.json")).unwrap();
});

/// The command that makes maps of the two boxes.
pub(crate) const MAPS: &str = "maps train meshes --true-size mm --probe hand.toml --maps cell=2mm,range=20mm";

/// A hand over a table.
pub(crate) const HAND: &str = "unit = \"mm\"\nradius = 1.5\nspacing = 15\nspeed = 100\ntilt = 0\nstroke = 20\n";

/// Lines of a hand that presses a surface, which lies at a place and is turned: within `half` of its `middle`, with the row along x.
pub(crate) fn pressed(
    surface: impl Fn([f64; 2]) -> f64,
    [middle, half]: [[f64; 2]; 2],
    place: [f64; 2],
    yaw: f64,
    count: usize,
) -> Vec<String> {
    let (sin, cos) = yaw.sin_cos();
    let line = |number: usize| {
        let share = |step: f64| (number as f64 * step).fract() * 2.0 - 1.0;
        let [u, v] = [middle[0] + half[0] * share(0.754_877_666), middle[1] + half[1] * share(0.569_840_291)];
        let [x, y] = [place[0] + cos * u - sin * v, place[1] + sin * u + cos * v];
        let heights = [-15.0, 0.0, 15.0].map(|finger| {
            let [dx, dy] = [x + finger - place[0], y - place[1]];
            surface([cos * dx + sin * dy, cos * dy - sin * dx])
        });
        let first = heights.into_iter().fold(0.0, f64::max);
        // Later than the stroke there is no contact.
        let time =
            |height: f64| if first - height > 20.0 { "-".into() } else { format!("{:.6}", (first - height) / 100.0) };
        let [one, two, three] = heights.map(time);
        format!("{one} {two} {three} 0 0 -1 1 0 0 {x:.3} {y:.3} {first:.3}\n")
    };
    (0..count).map(line).collect()
}

/// Lines of a hand that presses a box of this height, which lies on its largest side in the middle of the table.
pub(crate) fn pressed_box([x, y, height]: [f64; 3], count: usize) -> Vec<String> {
    let half = [x / 2.0, y / 2.0];
    let surface = |[u, v]: [f64; 2]| if u.abs() <= half[0] && v.abs() <= half[1] { height } else { 0.0 };
    pressed(surface, [[0.0; 2], half.map(|half| half + 5.0)], [0.0; 2], 0.0, count)
}

/// Two boxes in `meshes`, `maps.palpate` of them, and touches of them with positions in `data`.
pub(crate) static LOCATED: Fixture = Fixture::new(|at| {
    boxes(at);
    fs::write(at.join("hand.toml"), HAND).unwrap();
    succeeds(at, &format!("{MAPS} -o maps.palpate"));
    for (name, sides) in [("brick", [60.0, 40.0, 30.0]), ("slab", [70.0, 50.0, 10.0])] {
        fs::write(at.join("lines.txt"), pressed_box(sides, 60).concat()).unwrap();
        succeeds(at, &format!("data record lines.txt -o data --object {name} --position --probe hand.toml"));
    }
});
