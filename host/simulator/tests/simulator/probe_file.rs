use palpate_shared::format::Length;
use palpate_simulator::error::Result;
use palpate_simulator::probe::Probe;
use palpate_simulator::probe::file::ProbeFile;
use palpate_simulator::probe::noise::{Deviation, Grazing, Noise};
use std::path::Path;

const MEASURES: &str = "radius = 1.5\nspacing = 15\nspeed = 100.0\n";

fn parse(text: &str) -> Result<ProbeFile> {
    ProbeFile::parse(text, Path::new("probe.toml"))
}

#[test]
fn measures_are_enough_and_a_unit_is_a_tenth_of_the_longest_side() {
    let probe = with!(Probe::default(); radius: 1.5, spacing: 15.0, speed: 100.0);
    assert_eq!(parse(MEASURES).unwrap(), ProbeFile { probe, unit: Length::Tenth, real: Noise::default() });
}

#[test]
fn a_real_probe_adds_what_its_part_says() {
    let text = format!(
        "unit = \"mm\"\n{MEASURES}tilt = 0\ntimer = \"1ms\"\n[real]\nspeed_factor = 0.98\noffsets = [0, 0.3, -0.1]\n\
         noise = \"0..5ms\"\ndebounce = \"2ms\"\nmissed = \"2%\"\nspeed_error = \"5%\"\nspeed_bias = \"1%\"\n\
         pose_noise = \"2deg\"\npose_bias = \"1deg\"\nposition = \"1mm\"\ngrazing = {{ angle = \"30deg\", bend = 0.5 }}\n"
    );
    let file = parse(&text).unwrap();
    assert_eq!((file.unit, file.probe.tilt), (Length::Millimeter, 0.0));
    let real = with!(Noise::default(); deviation: Deviation { least: 0.0, largest: 5_000.0 }, timer: 1_000.0, debounce: 2_000.0, missed: [0.02; 3], bent: [0.0, 3_000.0, -1_000.0], speed: 0.98, speed_error: 0.05, speed_bias: 0.01, pose: 2.0, pose_bias: 1.0, position: 1_000.0, drift: [0.0; 2], grazing: Grazing { angle: 30.0, bend: 5_000.0 });
    assert_eq!(file.real, real);
    let each = parse(&text.replace("\"2%\"", "[\"1%\", \"0.02\", \"0%\"]")).unwrap();
    assert_eq!(each.real, with!(real; missed: [0.01, 0.02, 0.0]));
}

#[test]
fn a_stroke_and_a_travel_are_lengths_in_the_unit_of_the_file() {
    let file = parse(&format!("{MEASURES}stroke = 30\ntravel = 200.5\n")).unwrap();
    assert_eq!((file.probe.stroke, file.probe.travel), (Some(30.0), Some(200.5)));
    assert_eq!(file.probe.window(), Some(300_000));
    let known = parse(&format!("{MEASURES}stroke = 30\nstroke_tolerance = 1.5\n")).unwrap();
    assert_eq!((known.probe.window(), known.probe.latest()), (Some(300_000), Some(315_000.0)));
    let wrong = [
        ("stroke = 0", "stroke"),
        ("travel = -3", "travel"),
        ("stroke_tolerance = 1", "stroke_tolerance is 1"),
        ("stroke = \"3\"", "4: not a usable probe file: invalid type: string \"3\""),
    ];
    for (text, named) in wrong {
        let error = parse(&format!("{MEASURES}{text}\n")).unwrap_err().to_string();
        assert!(error.starts_with("probe.toml:") && error.contains(named), "{error}");
    }
}

#[test]
fn what_is_wrong_in_a_probe_file_is_named_with_its_line() {
    for (text, line, part) in [
        (format!("{MEASURES}weight = 3\n"), 4, "weight"),
        (format!("{MEASURES}[real]\nnoise = 5\n"), 5, "string"),
        (format!("{MEASURES}[real]\nnoise = \"5\"\n"), 5, "0..10ms"),
        (format!("{MEASURES}[real]\njitter = \"5ms\"\n"), 5, "jitter"),
        (format!("{MEASURES}[real]\nmissed = [\"1%\", \"2%\"]\n"), 5, "of each finger"),
        (format!("{MEASURES}[real]\nmissed = [\"1%\", \"2\", \"few\"]\n"), 5, "few"),
        (format!("unit = \"inch\"\n{MEASURES}"), 1, "mm"),
        (format!("{MEASURES}tilt = \"much\"\n"), 4, "much"),
        (format!("{MEASURES}spacing 3\n"), 4, ""),
        ("radius = 1.0\n".into(), 1, "spacing"),
    ] {
        let error = parse(&text).unwrap_err();
        assert!(error.to_string().starts_with(&format!("probe.toml:{line}: not a usable probe file: ")), "{error}");
        assert!(error.to_string().contains(part), "{error}");
        assert_eq!(error.exit_code(), 1);
    }
}

#[test]
fn numbers_out_of_range_are_named_with_the_file() {
    for text in [MEASURES.replace("1.5", "-1"), format!("{MEASURES}[real]\nmissed = \"200%\"\n")] {
        let error = parse(&text).unwrap_err().to_string();
        assert!(error.starts_with("probe.toml: "), "{error}");
    }
}
