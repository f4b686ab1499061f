//! Options for what a real sensor, timer and robot add to touches.

use palpate::error::{ProbeProblem, Problem};
use palpate::probe::noise::{Deviation, Noise, quantity};

/// The noise options. `bias` is what all touches of one robot share; everything else differs from touch to touch.
#[derive(clap::Args, Clone, Debug, Default)]
pub(crate) struct NoiseArguments {
    /// Gaussian noise on every contact time: its standard deviation, such as 5ms, or a range that each touch draws it from, such as 0..10ms
    #[arg(long, value_parser = quantity_of::<Deviation>, value_name = "DURATION[..DURATION]")]
    noise: Option<Deviation>,
    /// Round contact times down to the ticks of a timer or of polling, such as 1ms
    #[arg(long, value_parser = duration, value_name = "DURATION")]
    timer: Option<f64>,
    /// Add to each contact time what a bouncing switch does: uniform from 0 to this, such as 2ms
    #[arg(long, value_parser = duration, value_name = "DURATION")]
    debounce: Option<f64>,
    /// Miss each contact with this probability, such as 2%
    #[arg(long, value_parser = share, value_name = "SHARE")]
    missed: Option<f64>,
    /// Bend a finger (1 to 3), so that it touches earlier by this, such as 1:3ms
    #[arg(long, value_parser = bent, value_name = "FINGER:DURATION")]
    bent: Vec<(usize, f64)>,
    /// Let the speed of each touch be off by up to this share, such as 5%
    #[arg(long, value_parser = share, value_name = "SHARE")]
    speed_error: Option<f64>,
    /// Let the speed of each robot be off by up to this share, the same through all of its touches
    #[arg(long, value_parser = share, value_name = "SHARE")]
    speed_bias: Option<f64>,
    /// Turn the pose of each touch about a random axis by an angle of this standard deviation, such as 5deg
    #[arg(long, value_parser = angle, value_name = "ANGLE")]
    pose_noise: Option<f64>,
    /// Turn the poses of each robot in the same way, all alike, such as 5deg
    #[arg(long, value_parser = angle, value_name = "ANGLE")]
    pose_bias: Option<f64>,
}

impl NoiseArguments {
    /// What the options say, and where they say nothing `base`.
    pub(crate) fn over(&self, base: Noise) -> Noise {
        let mut noise = Noise {
            deviation: self.noise.unwrap_or(base.deviation),
            timer: self.timer.unwrap_or(base.timer),
            debounce: self.debounce.unwrap_or(base.debounce),
            missed: self.missed.map_or(base.missed, |share| [share; 3]),
            speed_error: self.speed_error.unwrap_or(base.speed_error),
            speed_bias: self.speed_bias.unwrap_or(base.speed_bias),
            pose: self.pose_noise.unwrap_or(base.pose),
            pose_bias: self.pose_bias.unwrap_or(base.pose_bias),
            ..base
        };
        for &(finger, early) in &self.bent {
            noise.bent[finger] = early;
        }
        noise
    }

    /// Whether any of the options was given.
    pub(crate) fn is_given(&self) -> bool {
        self.over(Noise::default()) != Noise::default() || self.noise.is_some()
    }

    /// The options as words of a command line, to repeat it.
    pub(crate) fn words(&self) -> Vec<String> {
        let duration = |micros: f64| format!("{}ms", micros / 1e3);
        let share = |share: f64| format!("{share}");
        let angle = |degrees: f64| format!("{degrees}deg");
        let level = self.noise.map(|level| match (level.least, level.largest) {
            (least, largest) if least == largest => duration(least),
            (least, largest) => format!("{}..{}", duration(least), duration(largest)),
        });
        let bent =
            self.bent.iter().map(|(finger, early)| ("--bent", Some(format!("{}:{}", finger + 1, duration(*early)))));
        let options = [
            ("--noise", level),
            ("--timer", self.timer.map(duration)),
            ("--debounce", self.debounce.map(duration)),
            ("--missed", self.missed.map(share)),
            ("--speed-error", self.speed_error.map(share)),
            ("--speed-bias", self.speed_bias.map(share)),
            ("--pose-noise", self.pose_noise.map(angle)),
            ("--pose-bias", self.pose_bias.map(angle)),
        ];
        let given = options.into_iter().chain(bent).filter_map(|(name, value)| Some([name.to_owned(), value?]));
        given.flatten().collect()
    }
}

/// A quantity; what is wrong with it, with an example.
fn said<T>(result: Result<T, ProbeProblem>) -> Result<T, String> {
    result.map_err(|problem| problem.fix().trim_end_matches('.').to_lowercase())
}

fn quantity_of<T: std::str::FromStr<Err = ProbeProblem>>(text: &str) -> Result<T, String> {
    said(text.parse())
}

pub(super) fn duration(text: &str) -> Result<f64, String> {
    said(quantity::duration(text))
}

fn share(text: &str) -> Result<f64, String> {
    said(quantity::share(text))
}

fn angle(text: &str) -> Result<f64, String> {
    said(quantity::angle(text))
}

/// A finger, counted from 0, and how early it touches.
fn bent(text: &str) -> Result<(usize, f64), String> {
    let example = || "give a finger and a duration such as 1:3ms".to_owned();
    let (finger, early) = text.split_once(':').ok_or_else(example)?;
    let finger = finger.trim().parse::<usize>().ok().filter(|finger| (1..=3).contains(finger)).ok_or_else(example)?;
    let (early, sign) = match early.strip_prefix('-') {
        Some(late) => (late, -1.0),
        None => (early, 1.0),
    };
    Ok((finger - 1, sign * quantity::duration(early).map_err(|_| example())?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Program {
        #[command(flatten)]
        noise: NoiseArguments,
    }

    fn parsed(words: &[&str]) -> NoiseArguments {
        Program::parse_from([&["program"], words].concat()).noise
    }

    #[test]
    fn options_stand_for_noise_and_are_repeated_as_words() {
        let words = [
            "--noise",
            "0..10ms",
            "--timer",
            "1ms",
            "--debounce",
            "2ms",
            "--missed",
            "2%",
            "--bent",
            "1:3ms",
            "--bent",
            "3:-500us",
            "--speed-error",
            "5%",
            "--speed-bias",
            "0.1",
            "--pose-noise",
            "5deg",
            "--pose-bias",
            "1.5deg",
        ];
        let noise = parsed(&words).over(Noise::default());
        let expected = Noise {
            deviation: Deviation { least: 0.0, largest: 10_000.0 },
            timer: 1_000.0,
            debounce: 2_000.0,
            missed: [0.02; 3],
            bent: [3_000.0, 0.0, -500.0],
            speed: 1.0,
            speed_error: 0.05,
            speed_bias: 0.1,
            pose: 5.0,
            pose_bias: 1.5,
        };
        assert_eq!(noise, expected);
        let repeated = parsed(&words).words();
        let repeated: Vec<&str> = repeated.iter().map(String::as_str).collect();
        assert_eq!(parsed(&repeated).over(Noise::default()), expected);
        assert!(parsed(&words).is_given() && !parsed(&[]).is_given() && parsed(&["--noise", "0ms"]).is_given());
        assert_eq!(parsed(&["--timer", "0ms"]).over(expected), Noise { timer: 0.0, ..expected });
    }

    #[test]
    fn what_is_no_noise_is_refused_with_an_example() {
        for words in
            [["--noise", "5"], ["--bent", "4:3ms"], ["--bent", "3ms"], ["--missed", "few"], ["--pose-noise", "5"]]
        {
            let error = Program::try_parse_from(["program"].iter().chain(&words)).err().unwrap().to_string();
            assert!(error.contains("such as"), "{error}");
        }
    }
}
