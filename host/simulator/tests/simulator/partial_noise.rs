use palpate_simulator::probe::noise::{Deviation, Grazing, Noise, PartialNoise};

fn read(text: &str) -> PartialNoise {
    text.parse().unwrap_or_else(|error| panic!("{text}: {error}"))
}

#[test]
fn every_key_sets_its_own_setting_and_leaves_the_others_open() {
    let none = Noise::default();
    let all = "noise=1..2ms,timer=3ms,debounce=4ms,missed=5%,bent=6ms,speed_factor=0.7,speed_error=8%,speed_bias=9%,\
               pose_noise=10deg,pose_bias=11deg,position=12mm,drift=13mm/14deg";
    let range = Deviation { least: 0.0, largest: 5_000.0 };
    for (text, expected) in [
        ("noise=0..5ms", with!(none; deviation: range)),
        ("noise=5ms", with!(none; deviation: 5_000.0.into())),
        ("timer=1ms", with!(none; timer: 1_000.0)),
        ("timer=0.005 s", with!(none; timer: 5_000.0)),
        ("debounce=300us", with!(none; debounce: 300.0)),
        ("missed=2%", with!(none; missed: [0.02; 3])),
        ("missed=2 %", with!(none; missed: [0.02; 3])),
        ("missed=1%/0.02/0%", with!(none; missed: [0.01, 0.02, 0.0])),
        ("bent=3ms/0ms/-500us", with!(none; bent: [3_000.0, 0.0, -500.0])),
        ("speed_factor=0.98", with!(none; speed: 0.98)),
        ("speed_error=5%", with!(none; speed_error: 0.05)),
        ("speed-bias=0.1", with!(none; speed_bias: 0.1)),
        ("pose-noise=5deg", with!(none; pose: 5.0)),
        ("drift=1mm/0.5deg", with!(none; drift: [1_000.0, 0.5])),
        ("position=0.5mm", with!(none; position: 500.0)),
        ("position=300um", with!(none; position: 300.0)),
        (" pose_bias = 1.5° ", with!(none; pose_bias: 1.5)),
    ] {
        assert_eq!(read(text).over(none), expected, "{text}");
        let over = read(text).over(read(all).over(none)).settings();
        let changed: Vec<&str> = over.split(',').filter(|setting| !all.contains(setting)).collect();
        let key = text.split('=').next().unwrap().trim().replace('-', "_");
        assert!(changed.len() == 1 && changed[0].starts_with(&key), "{over}");
    }
    assert_eq!(read("none").over(Noise::switch()), none);
    assert_eq!(read("none,missed=2%").over(Noise::switch()), with!(none; missed: [0.02; 3]));
    assert_eq!(read("timer=0ms").over(Noise::switch()), with!(Noise::switch(); timer: 0.0));
}

#[test]
fn a_setting_is_taken_by_its_key_and_refused_with_an_example() {
    let mut noise = Noise::default();
    noise.set("noise", "0..5ms").unwrap();
    noise.set("timer", "1ms").unwrap();
    assert_eq!(noise, Noise::switch());
    let error = noise.set("timer", "5").unwrap_err();
    assert_eq!(
        error.to_string(),
        "\"5\" is not a quantity with its unit. Give a duration such as 5ms, 300us or 0.005s."
    );
    assert!(noise.set("jitter", "5ms").unwrap_err().to_string().contains("one of noise, timer"));
}

#[test]
fn what_is_written_reads_as_the_same_to_the_last_bit() {
    for text in [
        "noise=0..5ms,timer=1ms,debounce=2ms,missed=2%,bent=3ms/0ms/-0.5ms,speed_factor=0.98",
        "speed_error=5%,speed_bias=10%,pose_noise=5deg,pose_bias=1.5deg,position=0.3mm,drift=1mm/1deg",
        "noise=2.5ms,pose_noise=5deg",
        "none",
        "missed=1%/2%/0%",
    ] {
        assert_eq!(read(text).over(Noise::default()).settings(), text);
    }
    let mut random = palpate_simulator::random::generator(1, palpate_simulator::random::Purpose::Noise, "text", 0);
    for _ in 0..200 {
        use rand::RngExt;
        let mut number = || random.random::<f64>();
        let noise = with!(Noise::default(); deviation: Deviation { least: 100.0 * number(), largest: 100.0 + 9e3 * number() }, timer: 1e4 * number(), debounce: number(), missed: [number(), number(), number()], bent: [-1e3 * number(), number(), 0.0], speed: 0.5 + number(), speed_error: 0.9 * number(), speed_bias: 0.9 * number(), pose: 180.0 * number(), pose_bias: number(), position: 1e4 * number(), drift: [1e3 * number(), number()], grazing: Grazing::default());
        assert_eq!(read(&noise.settings()).over(Noise::default()), noise, "{}", noise.settings());
    }
}

/// The first words between backquotes of the lines of a table.
fn first_words(table: &str) -> Vec<&str> {
    table.lines().filter_map(|line| line.strip_prefix("| `")?.split('`').next()).collect()
}

#[test]
fn the_reference_of_options_describes_every_key_in_the_same_order() {
    let text = std::fs::read_to_string("../../docs/reference/options.md").unwrap();
    let section = text.split("\n## ").find(|section| section.starts_with("What disturbs touches")).unwrap();
    assert_eq!(first_words(section), palpate_simulator::probe::noise::keys());
}

#[test]
fn what_is_no_noise_is_refused_by_key_and_value_with_what_to_use() {
    for (text, expected) in [
        ("", "real is \"\"; use settings such as noise=0..5ms"),
        ("5ms", "real is \"5ms\"; use settings such as"),
        ("noise", "real is \"noise\"; use settings"),
        ("noise=5", "noise is \"5\"; use a duration with its unit such as 5ms, or a range such as 0..10ms"),
        ("noise=9..5ms", "noise is \"9..5ms\"; use a duration"),
        ("timer=", "timer is \"\"; use a duration such as 5ms"),
        ("timer=-1ms", "timer is \"-1ms\"; use a duration"),
        ("timer=1e999s", "timer is \"1e999s\"; use a duration"),
        ("jitter=5ms", "real is \"jitter=5ms\"; use one of noise, timer, debounce, missed, bent"),
        ("missed=few", "missed is \"few\"; use a share such as 2% or 0.02"),
        ("missed=200%", "missed is \"200%\"; use a share from 0 to 1"),
        ("missed=1%/2%", "missed is \"1%/2%\"; use one value for all fingers, or one for each"),
        ("missed=1%/2%/3%/4%", "missed is \"1%/2%/3%/4%\"; use one value"),
        ("bent=1:3ms", "bent is \"1:3ms\"; use a duration"),
        ("speed_factor=0", "speed_factor is \"0\"; use a number greater than 0"),
        ("speed_factor=nan", "speed_factor is \"nan\"; use a number greater than 0"),
        ("speed_error=95%", "speed_error is \"95%\"; use a share from 0 to 0.9"),
        ("pose_noise=5", "pose_noise is \"5\"; use an angle such as 5deg"),
        ("position=1", "position is \"1\"; use a length such as 1mm"),
        ("drift=1mm", "drift is \"1mm\"; use a length and an angle such as 1mm/1deg"),
        ("position=-1mm", "position is \"-1mm\"; use a length"),
        ("pose_bias=181deg", "pose_bias is \"181deg\"; use degrees from 0 to 180"),
        ("timer=1ms,timer=2ms", "timer is \"2ms\"; use each key once"),
        ("timer=1ms,none", "real is \"none\"; use settings"),
        ("timer=1ms,", "real is \"\"; use settings"),
        ("noise=5ms\u{0}", "noise is \"5ms\\0\"; use a duration"),
    ] {
        let error = text.parse::<PartialNoise>().unwrap_err().to_string();
        assert!(error.starts_with(expected), "{text}: {error}");
    }
    for (key, values, wanted) in [
        ("timer", &["5", "ms", "5 m"][..], "a duration such as 5ms"),
        ("position", &["5", "mm", "1m", "nanmm"], "a length such as 1mm"),
        ("pose_noise", &["deg", "-1deg", "5rad"], "an angle such as 5deg"),
        ("missed", &["%", "-2%", "2%%", "nan"], "a share such as 2%"),
    ] {
        for value in values {
            let error = format!("{key}={value}").parse::<PartialNoise>().unwrap_err().to_string();
            assert!(error.starts_with(&format!("{key} is {value:?}; use {wanted}")), "{error}");
        }
    }
    // Hostile lengths end at once.
    assert!("noise=5ms,".repeat(1_000).parse::<PartialNoise>().is_err());
    assert!("=".repeat(100_000).parse::<PartialNoise>().is_err());
}
