use palpate_simulator::probe::noise::{Deviation, Grazing, Noise, PartialNoise};

fn read(text: &str) -> PartialNoise {
    text.parse().unwrap_or_else(|error| panic!("{text}: {error}"))
}

#[test]
fn every_key_sets_its_own_setting_and_leaves_the_others_open() {
    let deviation = Deviation { least: 0.0, largest: 5_000.0 };
    for (text, expected) in [
        ("noise=0..5ms", PartialNoise { deviation: Some(deviation), ..PartialNoise::default() }),
        ("noise=5ms", PartialNoise { deviation: Some(5_000.0.into()), ..PartialNoise::default() }),
        ("timer=1ms", PartialNoise { timer: Some(1_000.0), ..PartialNoise::default() }),
        ("timer=0.005 s", PartialNoise { timer: Some(5_000.0), ..PartialNoise::default() }),
        ("debounce=300us", PartialNoise { debounce: Some(300.0), ..PartialNoise::default() }),
        ("missed=2%", PartialNoise { missed: Some([0.02; 3]), ..PartialNoise::default() }),
        ("missed=2 %", PartialNoise { missed: Some([0.02; 3]), ..PartialNoise::default() }),
        ("missed=1%/0.02/0%", PartialNoise { missed: Some([0.01, 0.02, 0.0]), ..PartialNoise::default() }),
        ("bent=3ms/0ms/-500us", PartialNoise { bent: Some([3_000.0, 0.0, -500.0]), ..PartialNoise::default() }),
        ("speed_factor=0.98", PartialNoise { speed: Some(0.98), ..PartialNoise::default() }),
        ("speed_error=5%", PartialNoise { speed_error: Some(0.05), ..PartialNoise::default() }),
        ("speed-bias=0.1", PartialNoise { speed_bias: Some(0.1), ..PartialNoise::default() }),
        ("pose-noise=5deg", PartialNoise { pose: Some(5.0), ..PartialNoise::default() }),
        ("drift=1mm/0.5deg", PartialNoise { drift: Some([1_000.0, 0.5]), ..PartialNoise::default() }),
        ("position=0.5mm", PartialNoise { position: Some(500.0), ..PartialNoise::default() }),
        ("position=300um", PartialNoise { position: Some(300.0), ..PartialNoise::default() }),
        (" pose_bias = 1.5° ", PartialNoise { pose_bias: Some(1.5), ..PartialNoise::default() }),
    ] {
        assert_eq!(read(text), expected, "{text}");
    }
    assert_eq!(read("none"), Noise::default().into());
    assert_eq!(read("none,missed=2%").over(Noise::switch()), with!(Noise::default(); missed: [0.02; 3]));
    assert_eq!(read("timer=0ms").over(Noise::switch()), with!(Noise::switch(); timer: 0.0));
}

#[test]
fn what_is_written_reads_as_the_same_to_the_last_bit() {
    for text in [
        "noise=0ms..5ms,timer=1ms,debounce=2ms,missed=2%,bent=3ms/0ms/-0.5ms,speed_factor=0.98",
        "speed_error=5%,speed_bias=10%,pose_noise=5deg,pose_bias=1.5deg,position=0.3mm,drift=1mm/1deg",
        "none",
        "none,timer=1ms",
        "missed=1%/2%/0%",
    ] {
        assert_eq!(read(text).to_string(), text);
    }
    let mut random = palpate_simulator::random::generator(1, palpate_simulator::random::Purpose::Noise, "text", 0);
    for _ in 0..200 {
        use rand::RngExt;
        let mut number = || random.random::<f64>();
        let noise = with!(Noise::default(); deviation: Deviation { least: 100.0 * number(), largest: 100.0 + 9e3 * number() }, timer: 1e4 * number(), debounce: number(), missed: [number(), number(), number()], bent: [-1e3 * number(), number(), 0.0], speed: 0.5 + number(), speed_error: 0.9 * number(), speed_bias: 0.9 * number(), pose: 180.0 * number(), pose_bias: number(), position: 1e4 * number(), drift: [1e3 * number(), number()], grazing: Grazing::default());
        let given = PartialNoise::from(noise);
        assert_eq!(read(&given.to_string()), given, "{given}");
    }
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
