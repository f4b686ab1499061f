use crate::{command, globe, listing, run, stderr, stdout};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A capture of the meshes in `directory` into its folder `output`.
fn capture(directory: &Path, output: &str, more: &[&str]) -> Command {
    let mut command = command(["capture"]);
    command.arg(directory.join("meshes")).arg("-o").arg(directory.join(output)).args(more);
    command
}

/// Two meshes to capture.
fn meshes() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    std::fs::create_dir(directory.path().join("meshes")).unwrap();
    globe(&directory.path().join("meshes"), "globe", 12);
    globe(&directory.path().join("meshes"), "apple", 6);
    directory
}

/// The files of a data set, without the lock.
fn files(directory: &Path) -> BTreeMap<String, Vec<u8>> {
    let names = listing(directory).into_iter().filter(|name| name != ".lock");
    names.map(|name| (name.clone(), std::fs::read(directory.join(name)).unwrap())).collect()
}

fn is_complete(directory: &Path) -> bool {
    let manifest: serde_json::Value =
        serde_json::from_slice(&std::fs::read(directory.join("dataset.json")).unwrap()).unwrap();
    manifest["complete"].as_bool().unwrap()
}

/// Waits until the capture has written its first checkpoint, or a minute.
fn wait_for(path: &Path) {
    let start = Instant::now();
    while !path.exists() {
        assert!(start.elapsed() < Duration::from_secs(60), "{} never appeared", path.display());
        std::thread::sleep(Duration::from_millis(5));
    }
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
    let directory = meshes();
    let table = stdout(capture(directory.path(), "out", &["--touches", "300", "--seed", "7"]).output().unwrap());
    assert!(table.starts_with("object ") && table.contains("\nall "), "{table}");
    let out = directory.path().join("out");
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
    let manifest: serde_json::Value =
        serde_json::from_slice(&std::fs::read(out.join("dataset.json")).unwrap()).unwrap();
    assert_eq!(manifest["settings"]["seed"], 7);
    assert_eq!(manifest["settings"]["probe"]["spacing"], 1.5);
    assert_eq!(manifest["objects"][1]["name"], "globe");
    assert_eq!(manifest["palpate"], env!("CARGO_PKG_VERSION"));
    let approaches = manifest["objects"][1]["approaches"].as_u64().unwrap();
    assert!((300..3000).contains(&approaches), "{approaches}");
}

#[test]
fn the_summary_as_json_holds_what_the_manifest_holds() {
    let directory = meshes();
    let more = ["--touches", "50", "--pose", "--json", "--threads", "1"];
    let summary: serde_json::Value =
        serde_json::from_str(&stdout(capture(directory.path(), "out", &more).output().unwrap())).unwrap();
    assert_eq!(summary["objects"][0]["name"], "apple");
    assert_eq!(summary["objects"][0]["touches"], 50);
    assert!(summary["seconds"].as_f64().unwrap() > 0.0);
    let text = std::fs::read_to_string(directory.path().join("out/apple.txt")).unwrap();
    assert!(text.lines().all(|line| line.split(' ').count() == 9));
}

#[test]
fn every_approach_is_kept_when_asked_and_one_that_touches_nothing_is_three_dashes() {
    let directory = meshes();
    stdout(capture(directory.path(), "out", &["--approaches", "400"]).output().unwrap());
    let text = std::fs::read_to_string(directory.path().join("out/globe.txt")).unwrap();
    assert_eq!(text.lines().count(), 400);
    assert!(text.lines().any(|line| line == "- - -"));
    assert!(text.lines().any(|line| line != "- - -" && line.contains('-')));
    assert!(text.lines().any(|line| !line.contains('-')));
}

#[test]
fn wrong_input_is_refused_and_nothing_is_left_behind() {
    let directory = meshes();
    for (name, text, what) in [
        ("empty.obj", "", "empty.obj: the mesh has no faces"),
        ("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "range.obj:4: vertex 4 of a face is out of range"),
        ("nan.obj", "v 0 nan 0\n", "nan.obj:1: the coordinate y = \"nan\" is not finite"),
        ("point.obj", "v 1 1 1\nf 1 1 1\n", "point.obj: the mesh has no extent"),
    ] {
        let path = directory.path().join(name);
        std::fs::write(&path, text).unwrap();
        let out = directory.path().join("out");
        let error = stderr(command(["capture", "-o"]).args([&out, &path]).output().unwrap(), 1);
        assert!(error.contains(what), "{error}");
        assert!(!out.exists());
    }
    let error = stderr(run(["capture", "nowhere.obj", "-o", "never"]), 1);
    assert!(error.contains("nowhere.obj: cannot read the mesh"), "{error}");
    for wrong in
        [&["--length", "-1"][..], &["--threads", "0"], &["--touches", "0"], &["--shard", "3/2"], &["--sed", "1"]]
    {
        stderr(capture(directory.path(), "out", wrong).output().unwrap(), 2);
        assert!(!directory.path().join("out").exists());
    }
}

#[test]
fn a_second_capture_into_the_same_directory_is_refused() {
    let directory = meshes();
    let mut first = capture(directory.path(), "out", &["--touches", "100000000"]);
    let _first = Running(first.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
    wait_for(&directory.path().join("out/dataset.json"));
    for more in [&["--touches", "10"][..], &["--touches", "100000000", "--resume"]] {
        let error = stderr(capture(directory.path(), "out", more).output().unwrap(), 1);
        assert!(error.contains("another capture is writing into this directory"), "{error}");
    }
}

#[test]
fn a_capture_that_is_killed_again_and_again_ends_with_the_same_bytes() {
    let directory = meshes();
    let more = ["--touches", "60000", "--seed", "3", "--resume"];
    stdout(capture(directory.path(), "whole", &more).output().unwrap());
    let killed = directory.path().join("killed");
    let mut cut_short = 0;
    for kill in 0..10_u64 {
        let mut running = capture(directory.path(), "killed", &more);
        let mut running = Running(running.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
        // The first kill comes when a capture has surely begun; the others from before the first checkpoint to well after
        // it, in no order.
        if kill == 0 {
            wait_for(&killed.join("apple.part"));
        } else {
            std::thread::sleep(Duration::from_millis(30 + kill * 379 % 900));
        }
        running.0.kill().unwrap();
        running.0.wait().unwrap();
        cut_short += u32::from(killed.join("dataset.json").exists() && !is_complete(&killed));
    }
    assert!(cut_short > 0, "no kill came while the capture was writing");
    stdout(capture(directory.path(), "killed", &more).output().unwrap());
    assert!(files(&killed) == files(&directory.path().join("whole")), "after {cut_short} kills on the way");
    assert!(is_complete(&killed));
}

#[test]
fn objects_on_a_table_are_captured_in_their_placements_which_the_output_and_the_data_set_name() {
    let directory = meshes();
    let table = ["--scene", "table", "--approaches", "300", "--pose"];
    let said = stdout(capture(directory.path(), "out", &[&table[..], &["--cone", "45"]].concat()).output().unwrap());
    assert!(said.contains("globe: ") && said.contains(" placement") && said.contains("of its volume"), "{said}");
    let out = directory.path().join("out");
    let text = std::fs::read_to_string(out.join("dataset.json")).unwrap();
    let listing: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(listing["settings"]["scene"], serde_json::json!({"table": {"cone": 45.0}}));
    let first = &listing["objects"][1]["placements"][0];
    let name = first["name"].as_str().unwrap();
    assert!(first["weight"].as_f64().unwrap() > 0.0 && said.contains(&format!(": {name} ")), "{said}");
    // What is added is touched as the rest, and cannot be touched otherwise.
    std::fs::remove_file(directory.path().join("meshes/globe.obj")).unwrap();
    globe(&directory.path().join("meshes"), "pear", 9);
    std::fs::remove_file(directory.path().join("meshes/apple.obj")).unwrap();
    let error = stderr(capture(directory.path(), "out", &["--add", "--cone", "30"]).output().unwrap(), 1);
    assert!(error.contains("cannot add to these touches: other settings: scene"), "{error}");
    stdout(capture(directory.path(), "out", &["--add"]).output().unwrap());
    assert!(out.join("pear.txt").exists());
}

#[test]
fn options_of_a_table_are_refused_where_there_is_none_or_where_they_name_nothing() {
    let directory = meshes();
    for (more, code, what) in [
        (&["--cone", "30"][..], 2, "--scene table"),
        (&["--placements", "globe/+z=1"], 2, "--scene table"),
        (&["--scene", "table", "--cone", "91"], 2, "at most 90 degrees"),
        (&["--scene", "moon"], 2, "use one of floating, table"),
        (&["--scene", "table", "--placements", "globe/+q=1"], 1, "globe has no placement +q: it has "),
        (&["--scene", "table", "--placements", "cup/+z=1"], 2, "the name of an object: apple, globe"),
        (&["--scene", "table", "--placements", "globe"], 2, "such as mug/+z=3"),
    ] {
        let error = stderr(capture(directory.path(), "out", more).output().unwrap(), code);
        assert!(error.contains(what), "{more:?}: {error}");
        assert!(!directory.path().join("out/globe.txt").exists());
    }
}

#[test]
fn touches_with_a_position_are_captured_straight_down_and_other_combinations_are_refused_by_name() {
    let directory = meshes();
    let probe = directory.path().join("probe.toml");
    std::fs::write(&probe, "unit = \"mm\"\nradius = 1.5\nspacing = 15\nspeed = 100\n").unwrap();
    let located = ["--position", "--true-size", "mm", "--probe", probe.to_str().unwrap()];
    let table = [&located[..], &["--scene", "table"]].concat();
    for (arguments, more, what) in [
        (&located[..], &[][..], "scene is floating. Use table with --position"),
        (&table, &["--cone", "30"], "cone is 30. Use 0 with --position"),
        (&table, &["--touches", "30"], "touches is 30. Use --approaches N with --position"),
        (&table, &["--aim", "mass"], "aim is mass. Use --within MM with --position"),
        (&table, &["--within=-1"], "within is"),
        (&table[..1], &["--scene", "table"], "probe is not given"),
        (&[], &["--within", "30"], "within is 30. Use it with --position"),
    ] {
        let error = stderr(capture(directory.path(), "out", &[arguments, more].concat()).output().unwrap(), 2);
        assert!(error.contains(what), "{more:?}: {error}");
    }
    let error = stderr(
        capture(directory.path(), "out", &["--position", "--scene", "table", "--probe", located[4]]).output().unwrap(),
        1,
    );
    assert!(error.contains("the true size is unknown") && error.contains("--true-size"), "{error}");
    stdout(
        capture(directory.path(), "out", &[&table[..], &["--approaches", "40", "--within", "2"]].concat())
            .output()
            .unwrap(),
    );
    let out = directory.path().join("out");
    let listing: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(out.join("dataset.json")).unwrap()).unwrap();
    let settings = &listing["settings"];
    assert_eq!(settings["scene"], serde_json::json!({"table": {"cone": 0.0}}));
    assert_eq!([&settings["position"], &settings["pose"], &settings["approaches"]], [true, true, true]);
    assert_eq!((settings["within"].as_f64(), settings["touches"].as_u64()), (Some(2.0), Some(40)));
    let lines = std::fs::read_to_string(out.join("globe.txt")).unwrap();
    assert_eq!(lines.lines().count(), 40);
    assert!(lines.lines().all(|line| line.split(' ').count() == 12), "{lines}");
    // What is recorded from such lines states the position too.
    let mut record = command(["data", "record"]);
    record.arg(out.join("globe.txt")).arg("-o").arg(directory.path().join("recorded"));
    record.args(["--object", "globe", "--pose", "--probe", located[4]]);
    let error = stderr(record.output().unwrap(), 1);
    assert!(error.contains("globe.txt: a position, where the touches recorded here have none"), "{error}");
    stdout(record.arg("--position").output().unwrap());
    let recorded = std::fs::read_to_string(directory.path().join("recorded/globe.txt")).unwrap();
    assert_eq!(recorded, lines);
}

#[test]
fn resuming_with_other_arguments_is_refused() {
    let directory = meshes();
    stdout(capture(directory.path(), "out", &["--touches", "20"]).output().unwrap());
    let before = files(&directory.path().join("out"));
    for other in [&["--touches", "30", "--resume"][..], &["--touches", "20", "--seed", "2", "--resume"]] {
        let error = stderr(capture(directory.path(), "out", other).output().unwrap(), 1);
        assert!(error.contains("dataset.json: cannot resume: other settings"), "{error}");
        assert!(error.contains(" there and "), "what differs: {error}");
    }
    stdout(capture(directory.path(), "out", &["--touches", "20", "--resume"]).output().unwrap());
    assert_eq!(files(&directory.path().join("out")), before);
}

/// Runs a shell script, which gets the program as $1 and the directory as $2; none where it cannot be run.
#[cfg(unix)]
fn shell(script: &str, directory: &Path) -> std::process::Output {
    Command::new("sh").args(["-c", script, "sh", env!("CARGO_BIN_EXE_palpate")]).arg(directory).output().unwrap()
}

#[cfg(unix)]
#[test]
fn a_file_that_may_not_grow_stops_the_capture_which_can_be_resumed() {
    // The shell's limit is in blocks of 512 or 1024 bytes; the signal is ignored so that writing fails instead.
    let directory = meshes();
    let script = "trap '' XFSZ; ulimit -f 400; exec \"$1\" capture \"$2/meshes\" -o \"$2/out\" --touches 50000";
    let error = stderr(shell(script, directory.path()), 1);
    assert!(error.contains("apple.part: cannot write the touches") && error.contains("--resume"), "{error}");
    assert!(!is_complete(&directory.path().join("out")));
    let more = ["--touches", "50000", "--resume"];
    stdout(capture(directory.path(), "out", &more).output().unwrap());
    stdout(capture(directory.path(), "whole", &more).output().unwrap());
    assert!(files(&directory.path().join("out")) == files(&directory.path().join("whole")));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_stops_the_capture_which_can_be_resumed() {
    // A disk of one megabyte, in a mount namespace of its own; what it holds is copied out before it goes.
    let directory = meshes();
    std::fs::create_dir(directory.path().join("disk")).unwrap();
    let script = "exec unshare -rm sh -c '
        mount -t tmpfs -o size=1m none \"$2/disk\" || exit 99
        \"$1\" capture \"$2/meshes\" -o \"$2/disk/out\" --touches 50000; code=$?
        cp -r \"$2/disk/out\" \"$2/out\"; exit $code' sh \"$1\" \"$2\"";
    let output = shell(script, directory.path());
    if !directory.path().join("out").exists() {
        eprintln!("SKIPPED: no disk of our own ({})", String::from_utf8_lossy(&output.stderr).trim());
        return;
    }
    let error = stderr(output, 1);
    assert!(error.contains("No space left on device") && error.contains("--resume"), "{error}");
    let more = ["--touches", "50000", "--resume"];
    stdout(capture(directory.path(), "out", &more).output().unwrap());
    stdout(capture(directory.path(), "whole", &more).output().unwrap());
    assert!(files(&directory.path().join("out")) == files(&directory.path().join("whole")));
}

#[cfg(target_os = "linux")]
#[test]
fn memory_does_not_grow_with_the_number_of_touches() {
    let directory = meshes();
    let peak = |touches: &str| -> u64 {
        let mut child = capture(directory.path(), "out", &["--touches", touches, "--force"]);
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

#[test]
fn touches_of_other_objects_are_kept_unless_the_capture_is_forced() {
    let directory = meshes();
    let one = |mesh: &str, more: &[&str]| {
        let mesh = directory.path().join("meshes").join(mesh);
        let mut command = command(["capture", "--touches", "20"]);
        command.arg(mesh).arg("-o").arg(directory.path().join("real")).args(more).output().unwrap()
    };
    let real = directory.path().join("real");
    stdout(one("apple.obj", &[]));
    let before = files(&real);
    let error = stderr(one("globe.obj", &[]), 1);
    assert!(error.contains("real: holds 20 touches of apple, which this capture would not write"), "{error}");
    assert!(error.contains("--add") && error.contains("--force"), "{error}");
    assert_eq!(files(&real), before);
    stdout(one("globe.obj", &["--force"]));
    assert_eq!(files(&real).keys().collect::<Vec<_>>(), ["dataset.json", "globe.txt"]);
    stderr(one("apple.obj", &["--force", "--add"]), 2);
}

#[test]
fn an_object_is_added_with_the_settings_of_the_others() {
    let directory = meshes();
    let one = |mesh: &str, more: &[&str]| {
        let mesh = directory.path().join("meshes").join(mesh);
        command(["capture"]).arg(mesh).arg("-o").arg(directory.path().join("real")).args(more).output().unwrap()
    };
    let probe = directory.path().join("probe.toml");
    std::fs::write(&probe, "radius = 0.15\nspacing = 2\nspeed = 10\n").unwrap();
    let settings = ["--touches", "30", "--seed", "5", "--probe", probe.to_str().unwrap(), "--pose"];
    stdout(one("globe.obj", &settings));
    stdout(one("apple.obj", &["--add"]));
    stdout(capture(directory.path(), "together", &settings).output().unwrap());
    assert!(files(&directory.path().join("real")) == files(&directory.path().join("together")));
    let error = stderr(one("apple.obj", &["--add"]), 1);
    assert!(error.contains("already holds touches of apple"), "{error}");
    let error = stderr(one("apple.obj", &["--add", "--seed", "6"]), 1);
    assert!(error.contains("cannot add to these touches: other settings: seed is 5 there and 6 here"), "{error}");
}

#[test]
fn an_unfinished_capture_is_neither_overwritten_nor_forgotten() {
    let directory = meshes();
    let mut first = capture(directory.path(), "out", &["--touches", "100000000"]);
    let mut first = Running(first.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
    wait_for(&directory.path().join("out/apple.part"));
    first.0.kill().unwrap();
    first.0.wait().unwrap();
    let before = files(&directory.path().join("out"));
    for touches in ["100000000", "20"] {
        let error = stderr(capture(directory.path(), "out", &["--touches", touches]).output().unwrap(), 1);
        assert!(error.contains("out: holds an unfinished capture of apple, globe"), "{error}");
        assert!(error.contains("--resume") && error.contains("--force"), "{error}");
        assert!(files(&directory.path().join("out")) == before);
    }
    stdout(capture(directory.path(), "out", &["--touches", "20", "--force"]).output().unwrap());
    assert!(is_complete(&directory.path().join("out")));
}

#[test]
fn a_run_replaces_its_own_results_and_keeps_touches_of_other_objects() {
    let directory = meshes();
    let run = |sources: &[PathBuf]| {
        let mut command = command(["run", "--touches", "200", "-o"]);
        command.arg(directory.path().join("mine")).args(sources).output().unwrap()
    };
    let both = [directory.path().join("meshes")];
    let data = directory.path().join("mine/data");
    stdout(run(&both));
    let before = files(&data);
    stdout(run(&both));
    assert_eq!(files(&data), before);
    let error = stderr(run(&["bowl".into(), "mouse".into()]), 1);
    assert!(error.contains("the directory holds results of another run"), "{error}");
    assert_eq!(files(&data), before);
}

#[test]
fn numbers_in_another_notation_are_refused_with_a_hint() {
    let directory = meshes();
    for text in ["1e6", "1_000_000"] {
        let error = stderr(capture(directory.path(), "out", &["--touches", text]).output().unwrap(), 2);
        assert!(error.contains("write the number out: 1000000"), "{error}");
    }
    let error = stderr(capture(directory.path(), "out", &["--format", "csv"]).output().unwrap(), 2);
    assert!(error.contains("\"csv\" is not a format of touches. Use text or parquet."), "{error}");
    let error = stderr(capture(directory.path(), "out", &["--shard", "3/2"]).output().unwrap(), 2);
    assert!(error.contains("Give K/N with K from 1 to N, like 2/5."), "{error}");
    assert!(!directory.path().join("out").exists());
}

#[test]
fn a_capture_to_standard_output_is_refused() {
    let directory = meshes();
    let mut command = command(["capture", "-o", "-"]);
    let output = command.arg(directory.path().join("meshes")).current_dir(directory.path()).output().unwrap();
    assert!(stderr(output, 2).contains("Use a directory"));
    assert_eq!(listing(directory.path()), ["meshes"]);
}

#[cfg(target_os = "linux")]
#[test]
fn threads_that_the_system_refuses_are_an_error_and_no_panic() {
    // Six gigabytes of addresses hold few stacks of one each. The builder of scenes gets one thread.
    let directory = meshes();
    let script = "ulimit -v 6000000; export RUST_MIN_STACK=1073741824 RAYON_NUM_THREADS=1
        exec \"$1\" capture \"$2/meshes\" -o \"$2/out\" --touches 1000000 --threads 100000";
    let error = stderr(shell(script, directory.path()), 1);
    assert!(error.contains("of 256 threads (") && error.contains("Use fewer threads."), "{error}");
}

#[test]
fn an_edited_line_is_a_warning_and_a_cut_file_an_error() {
    let directory = meshes();
    stdout(capture(directory.path(), "out", &["--touches", "400"]).output().unwrap());
    let path = directory.path().join("out/apple.txt");
    let text = std::fs::read_to_string(&path).unwrap();
    let train = || {
        let mut command = command(["train", "--trees", "rounds=2", "-o"]);
        command.args([directory.path().join("ensemble.json"), directory.path().join("out")]).output().unwrap()
    };
    let untouched = train();
    assert!(untouched.stderr.is_empty(), "{}", String::from_utf8_lossy(&untouched.stderr));
    std::fs::write(&path, text.replacen("0.0", "0.1", 1)).unwrap();
    let warned = train();
    assert!(String::from_utf8_lossy(&warned.stderr).contains("apple.txt: changed since its capture"));
    stdout(warned);
    std::fs::write(&path, text.split_inclusive('\n').take(399).collect::<String>()).unwrap();
    let error = stderr(train(), 1);
    assert!(error.contains("apple.txt: 399 touches where dataset.json states 400"), "{error}");
}

#[cfg(unix)]
#[test]
fn results_go_through_links_and_to_standard_output_and_never_onto_what_is_read() {
    let directory = meshes();
    stdout(capture(directory.path(), "out", &["--touches", "400"]).output().unwrap());
    let at = |name: &str| directory.path().join(name);
    let train =
        |output: &Path| command(["train", "--trees", "rounds=2", "-o"]).arg(output).arg(at("out")).output().unwrap();
    stdout(train(&at("ensemble.json")));
    let ensemble = std::fs::read(at("ensemble.json")).unwrap();
    // Through a link, and to standard output, where nothing else may stand.
    std::os::unix::fs::symlink("real.json", at("link.json")).unwrap();
    stdout(train(&at("link.json")));
    assert!(at("link.json").is_symlink());
    assert_eq!(std::fs::read(at("real.json")).unwrap(), ensemble);
    for name in ["-", "/dev/stdout"] {
        let output = train(Path::new(name));
        assert!(output.status.success() && output.stdout == ensemble, "{name}");
        assert!(String::from_utf8_lossy(&output.stderr).contains("trees"), "the summary goes to stderr");
    }
    // Onto what is read.
    for (output, arguments) in [
        (at("out/apple.txt"), ["train", "--trees", "rounds=2"]),
        (at("out/dataset.json"), ["train", "--trees", "rounds=2"]),
    ] {
        let before = std::fs::read(&output).unwrap();
        let error = stderr(command(arguments).arg("-o").arg(&output).arg(at("out")).output().unwrap(), 2);
        assert!(error.contains("Use another file than what is read"), "{error}");
        assert_eq!(std::fs::read(&output).unwrap(), before);
    }
    let export = command(["export", "-o"]).args([at("ensemble.json"), at("ensemble.json")]).output().unwrap();
    assert!(stderr(export, 2).contains("Use another file than what is read"));
    assert_eq!(std::fs::read(at("ensemble.json")).unwrap(), ensemble);
}

#[test]
fn help_has_examples() {
    assert!(stdout(run(["capture", "--help"])).contains("Examples:\n  palpate capture builtin -o data"));
}
