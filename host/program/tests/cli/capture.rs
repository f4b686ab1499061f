use crate::fixtures::brick;
use crate::{
    Folder, command, complains, fails, figures, globe, listing, palpate, read, says, stderr, stdout, succeeds,
};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// A capture of the meshes in `directory` into its folder `output`.
fn capture(directory: &Path, output: &str, more: &[&str]) -> Command {
    let mut command = command(["capture"]);
    command.arg(directory.join("meshes")).arg("-o").arg(directory.join(output)).args(more);
    command
}

/// Two meshes to capture.
fn meshes() -> Folder {
    let at = Folder::new();
    std::fs::create_dir(at.join("meshes")).unwrap();
    globe(&at.join("meshes"), "globe", 12);
    globe(&at.join("meshes"), "apple", 6);
    at
}

/// The files of a data set by their paths in it, without the lock.
fn files(directory: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for name in listing(directory).into_iter().filter(|name| name != ".lock") {
        let path = directory.join(&name);
        match path.is_dir() {
            true => {
                files.extend(self::files(&path).into_iter().map(|(inner, bytes)| (format!("{name}/{inner}"), bytes)))
            }
            false => _ = files.insert(name, std::fs::read(path).unwrap()),
        }
    }
    files
}

/// A child that does not outlive its test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn touches_are_lines_of_three_times_and_the_manifest_says_how_they_were_made() {
    let at = &meshes();
    let table = says(at, "capture meshes -o out --touches 300 --seed 7", &["\nall "]);
    assert!(table.starts_with("object "), "{table}");
    let out = at.join("out");
    assert_eq!(files(&out).keys().collect::<Vec<_>>(), ["apple.txt", "dataset.json", "globe.txt"]);
    let text = std::fs::read_to_string(out.join("globe.txt")).unwrap();
    assert_eq!(text.lines().count(), 300);
    for line in text.lines() {
        let times: Vec<&str> = line.split(' ').collect();
        assert!(times.len() == 3 && times.contains(&"0.000000"), "{line}");
        assert!(
            times.iter().all(|time| time.split_once('.').is_some_and(|(_, decimals)| decimals.len() == 6)),
            "{line}"
        );
    }
    let manifest = read(&out.join("dataset.json"));
    assert_eq!(manifest["settings"]["seed"], 7);
    assert_eq!(manifest["settings"]["probe"]["spacing"], 1.5);
    assert_eq!(manifest["objects"][1]["name"], "globe");
    assert_eq!(manifest["palpate"], env!("CARGO_PKG_VERSION"));
    let approaches = manifest["objects"][1]["approaches"].as_u64().unwrap();
    assert!((300..3000).contains(&approaches), "{approaches}");
}

#[test]
fn every_approach_is_kept_when_asked_and_one_that_touches_nothing_is_three_dashes() {
    let at = &meshes();
    let summary = figures(at, "capture meshes -o out --approaches 400 --pose --threads 1");
    assert_eq!((&summary["objects"][0]["name"], &summary["objects"][0]["touches"]), (&"apple".into(), &400.into()));
    assert!(summary["seconds"].as_f64().unwrap() > 0.0);
    let text = std::fs::read_to_string(at.join("out/globe.txt")).unwrap();
    let times: Vec<Vec<&str>> = text.lines().map(|line| line.split(' ').collect()).collect();
    assert!(times.len() == 400 && times.iter().all(|line| line.len() == 9));
    let missing = times.iter().map(|line| line[..3].iter().filter(|time| **time == "-").count());
    let missing: std::collections::BTreeSet<usize> = missing.collect();
    assert_eq!(missing.into_iter().collect::<Vec<_>>(), [0, 1, 2, 3]);
}

#[test]
fn wrong_arguments_are_refused_by_name_and_nothing_is_left_behind() {
    let at = &meshes();
    let capture = "capture meshes -o out";
    for (command, more, code, expected) in [
        ("capture nowhere.obj -o out", "", 1, "nowhere.obj: cannot read the mesh"),
        ("capture meshes -o -", "", 2, "Use a directory"),
        (capture, "--length -1", 2, "-1"),
        (capture, "--threads 0", 2, "--threads"),
        (capture, "--touches 0", 2, "--touches"),
        (capture, "--approaches 0", 2, "--approaches is 0. Use 1 or more."),
        (capture, "--touches 1e6", 2, "write the number out: 1000000"),
        (capture, "--sed 1", 2, "--sed"),
        (capture, "--format parquet", 2, "`--format` was removed: data sets are text; DataSet.to_pandas() in Python"),
        (capture, "--samples 3..2", 2, "Give A..B with A below B: 0..5000 are the first 5000."),
        (
            capture,
            "--touches 30 --samples 20..31",
            2,
            "--samples is 20..31. Use samples up to 30, as many as each object has",
        ),
        (capture, "--shard 1/2", 2, "`--shard` was removed: capture parts on several machines with --samples A..B"),
        (capture, "--cone 30", 2, "--scene table"),
        (capture, "--placements globe/+z=1", 2, "--scene table"),
        (capture, "--scene table --cone 91", 2, "at most 90 degrees"),
        (capture, "--scene moon", 2, "use one of floating, table"),
        (capture, "--scene table --placements globe/+q=1", 1, "globe has no placement +q: it has "),
        (capture, "--scene table --placements globe", 2, "such as mug/+z=3"),
        (capture, "--position", 2, "`capture --position` was removed: make maps of meshes with palpate maps train"),
    ] {
        fails(at, &format!("{command} {more}"), code, expected);
        assert!(!at.join("out/globe.txt").exists(), "{more}");
    }
    assert_eq!(listing(&at.join("meshes")), ["apple.obj", "globe.obj"]);
}

#[test]
fn objects_on_a_table_are_captured_in_their_placements_which_the_output_and_the_data_set_name() {
    let at = &meshes();
    let said = succeeds(at, "capture meshes -o out --scene table --approaches 300 --pose --cone 45");
    assert!(said.contains("globe: ") && said.contains(" placement") && said.contains("of its volume"), "{said}");
    let out = at.join("out");
    let listing = read(&out.join("dataset.json"));
    assert_eq!(listing["settings"]["scene"], serde_json::json!({"table": {"cone": 45.0}}));
    let first = &listing["objects"][1]["pools"][0]["placement"];
    let name = first["name"].as_str().unwrap();
    assert!(first["weight"].as_f64().unwrap() > 0.0 && said.contains(&format!(": {name} ")), "{said}");
}

/// Runs a shell script, which gets the program as $1 and the directory as $2; none where it cannot be run.
#[cfg(unix)]
fn shell(script: &str, directory: &Path) -> std::process::Output {
    Command::new("sh").args(["-c", script, "sh", env!("CARGO_BIN_EXE_palpate")]).arg(directory).output().unwrap()
}

#[cfg(unix)]
#[test]
fn a_file_that_may_not_grow_stops_the_capture_and_nothing_is_left() {
    // The shell's limit is in blocks of 512 or 1024 bytes; the signal is ignored so that writing fails instead.
    let at = &meshes();
    let script = "trap '' XFSZ; ulimit -f 400; exec \"$1\" capture \"$2/meshes\" -o \"$2/out\" --touches 50000";
    let error = stderr(shell(script, at), 1);
    assert!(
        error.contains("apple.txt: cannot write the touches") && error.contains("Check the file and the disk"),
        "{error}"
    );
    assert_eq!(listing(at), ["meshes"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_stops_the_capture_and_nothing_is_left() {
    // A disk of one megabyte, in a mount namespace of its own; what it holds is listed before it goes.
    let at = &meshes();
    std::fs::create_dir(at.join("disk")).unwrap();
    let script = "exec unshare -rm sh -c '
        mount -t tmpfs -o size=1m none \"$2/disk\" || exit 99
        \"$1\" capture \"$2/meshes\" -o \"$2/disk/out\" --touches 50000; code=$?
        ls -A \"$2/disk\" >\"$2/left\"; exit $code' sh \"$1\" \"$2\"";
    let output = shell(script, at);
    let Ok(left) = std::fs::read_to_string(at.join("left")) else {
        eprintln!("SKIPPED: no disk of our own ({})", String::from_utf8_lossy(&output.stderr).trim());
        return;
    };
    let error = stderr(output, 1);
    assert!(error.contains("No space left on device") && error.contains("Free some space"), "{error}");
    assert_eq!(left, "");
}

#[cfg(target_os = "linux")]
#[test]
fn memory_does_not_grow_with_the_number_of_touches() {
    let at = &meshes();
    let peak = |touches: &str| -> u64 {
        let mut child = capture(at, "out", &["--touches", touches, "--force"]);
        let mut child = Running(child.stdout(Stdio::null()).spawn().unwrap());
        let status = PathBuf::from(format!("/proc/{}/status", child.0.id()));
        let mut peak = 0;
        while child.0.try_wait().unwrap().is_none() {
            let text = std::fs::read_to_string(&status).unwrap_or_default();
            let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
            let kilobytes =
                line.and_then(|line| line.trim().strip_suffix(" kB")).and_then(|number| number.parse().ok());
            peak = peak.max(kilobytes.unwrap_or(0));
            std::thread::sleep(Duration::from_millis(2));
        }
        peak
    };
    let (few, many) = (peak("5000"), peak("200000"));
    // Up to a megabyte either way is the allocator's.
    assert!(many <= few + few / 5 + 1024, "{few} kB for 5,000 touches, {many} kB for 200,000");
}

#[cfg(target_os = "linux")]
#[test]
fn threads_that_the_system_refuses_are_an_error_and_no_panic() {
    // Six gigabytes of addresses hold few stacks of one each. The builder of scenes gets one thread.
    let at = &meshes();
    let script = "ulimit -v 6000000; export RUST_MIN_STACK=1073741824 RAYON_NUM_THREADS=1
        exec \"$1\" capture \"$2/meshes\" -o \"$2/out\" --touches 1000000 --threads 100000";
    let error = stderr(shell(script, at), 1);
    assert!(error.contains("of 256 threads (") && error.contains("Use fewer threads."), "{error}");
}

#[test]
fn an_edited_line_is_a_warning_and_a_cut_file_an_error() {
    let at = &meshes();
    succeeds(at, "capture meshes -o out --touches 400");
    let path = at.join("out/apple.txt");
    let text = std::fs::read_to_string(&path).unwrap();
    let train = || palpate(at, "train out -o ensemble.json --trees rounds=2");
    let untouched = train();
    assert!(untouched.stderr.is_empty(), "{}", String::from_utf8_lossy(&untouched.stderr));
    std::fs::write(&path, text.replacen("0.0", "0.1", 1)).unwrap();
    let warned = train();
    assert!(String::from_utf8_lossy(&warned.stderr).contains("apple.txt: changed since its capture"));
    stdout(warned);
    std::fs::write(&path, text.split_inclusive('\n').take(399).collect::<String>()).unwrap();
    complains(train(), "train out", 1, "apple.txt: 399 touches where dataset.json states 400");
}

#[cfg(unix)]
#[test]
fn results_go_through_links_and_to_standard_output_and_never_onto_what_is_read() {
    let at = &meshes();
    succeeds(at, "capture meshes -o out --touches 400");
    let train = |output: &str| format!("train out --trees rounds=2 -o {output}");
    succeeds(at, &train("ensemble.json"));
    let ensemble = std::fs::read(at.join("ensemble.json")).unwrap();
    // Through a link, and to standard output, where nothing else may stand.
    std::os::unix::fs::symlink("real.json", at.join("link.json")).unwrap();
    succeeds(at, &train("link.json"));
    assert!(at.join("link.json").is_symlink());
    assert_eq!(std::fs::read(at.join("real.json")).unwrap(), ensemble);
    for name in ["-", "/dev/stdout"] {
        let output = palpate(at, &train(name));
        assert!(output.status.success() && output.stdout == ensemble, "{name}");
        assert!(String::from_utf8_lossy(&output.stderr).contains("trees"), "the summary goes to stderr");
    }
    // Onto what is read.
    for (output, words) in [
        ("out/apple.txt", train("out/apple.txt")),
        ("out/dataset.json", train("out/dataset.json")),
        ("ensemble.json", "export ensemble.json -o ensemble.json".to_owned()),
    ] {
        let before = std::fs::read(at.join(output)).unwrap();
        fails(at, &words, 2, "Use another file than what is read");
        assert_eq!(std::fs::read(at.join(output)).unwrap(), before);
    }
}

/// Two boxes in `meshes`, several of each in `set`, and probes.
fn bricks() -> Folder {
    let at = Folder::new();
    ["meshes", "set/brick", "set/slab"].into_iter().for_each(|made| std::fs::create_dir_all(at.join(made)).unwrap());
    for (name, sides) in [
        ("meshes/brick", [60.0, 40.0, 30.0]),
        ("meshes/slab", [70.0, 50.0, 10.0]),
        ("set/brick/a", [60.0, 40.0, 30.0]),
        ("set/brick/b", [60.0, 30.0, 20.0]),
        ("set/brick/c", [50.0, 50.0, 20.0]),
        ("set/slab/a", [70.0, 50.0, 10.0]),
        ("set/slab/b", [90.0, 40.0, 12.0]),
    ] {
        brick(&at.join(format!("{name}.obj")), sides);
    }
    let real = "speed_factor = 0.9\noffsets = [0.0, -0.04, 0.0]\nnoise = \"2ms\"\ntimer = \"1ms\"\nmissed = [\"0%\", \"4%\", \"0%\"]\n";
    let probe = format!("radius = 0.15\nspacing = 1.5\nspeed = 10.0\n[real]\n{real}");
    std::fs::write(at.join("real.toml"), probe).unwrap();
    at
}

/// The checksum of an object's lines as one file had them: those of its files in turn.
fn in_turn(directory: &Path, entry: &serde_json::Value) -> u32 {
    let name = entry["name"].as_str().unwrap();
    let path = |pool: &serde_json::Value| match pool["file"].as_str() {
        Some(file) => directory.join(name).join(format!("{file}.txt")),
        None => directory.join(format!("{name}.txt")),
    };
    let text = |pool| std::fs::read_to_string(path(pool)).unwrap();
    let texts: Vec<String> = entry["pools"].as_array().unwrap().iter().map(text).collect();
    let mut files: Vec<_> = texts.iter().map(|text| text.split_inclusive('\n')).collect();
    let digest = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut lines = String::new();
    for turn in (0..files.len()).cycle() {
        let Some(line) = files[turn].next() else { break };
        lines += line;
    }
    digest.checksum(lines.as_bytes())
}

#[test]
fn touches_are_those_of_version_0_3_0_in_one_thread_in_four_and_in_parts() {
    let at = &bricks();
    // The checksums of the files of both objects as that version wrote them: whole in one thread and in four, and in three shards.
    for (words, count, expected) in [
        ("meshes --seed 1 --touches", 301, [577_710_658, 1_912_490_814]),
        ("meshes --seed 2 --pose --touches", 300, [3_269_272_418, 2_120_952_123]),
        ("meshes --seed 3 --approaches", 500, [470_500_592, 2_922_138_810]),
        ("meshes --seed 4 --pose --aim mass --approaches", 700, [2_178_824_318, 2_169_447_840]),
        ("meshes --seed 5 --probe real.toml --touches", 200, [2_268_446_266, 4_118_118_332]),
        ("meshes --seed 6 --scene table --pose --approaches", 400, [2_592_788_561, 339_739_495]),
        ("meshes --seed 7 --scene table --cone 30 --touches", 200, [420_478_625, 1_441_037_996]),
        ("set --seed 9 --instances --touches", 300, [1_938_372_531, 861_611_217]),
        ("meshes --seed 10 --length 5 --aim middle --touches", 300, [2_798_672_090_u32, 3_616_987_438]),
    ] {
        let capture = |out: &str, more: &str| {
            succeeds(at, &format!("capture {words} {count} -o {out} --force {more}"));
            files(&at.join(out))
        };
        let whole = capture("one", "--threads 1");
        let listed = read(&at.join("one/dataset.json"))["objects"].take();
        assert_eq!([0, 1].map(|object| in_turn(&at.join("one"), &listed[object])), expected, "{words}");
        assert!(capture("four", "--threads 4") == whole, "{words}");
        let middle = count / 3 + 1;
        let parts = [format!("0..{middle}"), format!("{middle}..{count}")];
        let [first, second] = parts.map(|part| capture("part", &format!("--samples {part}")));
        let names: Vec<&String> = whole.keys().filter(|name| *name != "dataset.json").collect();
        assert!(names.len() >= 2 && first.keys().eq(whole.keys()), "{words}");
        for name in names {
            assert!([&first[name][..], &second[name]].concat() == whole[name], "{words}, {name}");
        }
    }
}
