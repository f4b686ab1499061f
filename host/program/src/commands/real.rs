//! The option for what a real sensor, timer and robot add to touches.

use super::keys::nearest;
use palpate::error::{Kind, Place, problem};
use palpate::probe::file::ProbeFile;
use palpate::probe::noise::{Noise, PartialNoise, keys};
use palpate::{Error, Result};
use std::path::{Path, PathBuf};

/// Disturbances of touches.
#[derive(clap::Args, Clone, Debug, Default)]
pub(crate) struct RealArguments {
    /// Disturbances of touches: noise=0..5ms,timer=1ms,missed=2% and the like, none, or a probe file
    #[arg(long, value_parser = real, value_name = "NOISE")]
    real: Option<Real>,
}

#[derive(Clone, Debug)]
enum Real {
    Settings(PartialNoise),
    File(PathBuf),
}

impl RealArguments {
    /// Noise of the option; `base` without it, and where it leaves settings open.
    ///
    /// # Errors
    /// Noise on a table, as [`on_table`](Self::on_table), and moves of the object.
    pub(crate) fn over(&self, base: Noise) -> Result<Noise> {
        let noise = self.on_table(base)?;
        if noise.drift == [0.0; 2] {
            return Ok(noise);
        }
        Err(Error::setting("real", "drift=…", "it with maps: objects move between approaches to a simulated table"))
    }

    /// Noise of approaches on a table, where objects may move.
    ///
    /// # Errors
    /// If its probe file cannot be read; for fingers that bend aside.
    pub(crate) fn on_table(&self, base: Noise) -> Result<Noise> {
        let noise = match &self.real {
            None => base,
            Some(Real::Settings(settings)) => settings.over(base),
            Some(Real::File(path)) => ProbeFile::read(path)?.real,
        };
        match &self.real {
            _ if noise.grazing.is_none() => Ok(noise),
            Some(Real::File(path)) => Err(only_captured().at(Place::file(path))),
            _ => Err(only_captured()),
        }
    }

    /// True if the option was given.
    pub(crate) fn is_given(&self) -> bool {
        self.real.is_some()
    }
}

/// A probe file by its name, or settings; what is wrong with them, with what to write.
fn real(text: &str) -> Result<Real, String> {
    let path = Path::new(text);
    let is_file = path.extension().is_some_and(|extension| extension == "toml") || path.is_file();
    match is_file {
        true => Ok(Real::File(path.into())),
        false => text.parse().map(Real::Settings).map_err(wrong),
    }
}

/// A problem with the settings, with the key that may have been meant.
fn wrong(error: Error) -> String {
    let nearest = match error.kind() {
        Kind::Setting { name: "real", value, .. } => nearest(value.split('=').next().unwrap_or_default(), &keys()),
        _ => String::new(),
    };
    format!("{error}{nearest}")
}

/// Fingers that bend aside were to be added to touches that are captured already.
pub(super) fn only_captured() -> Error {
    problem!("grazing is added to touches while they are captured: a data set does not hold the angles of contacts")
        .fix("Capture with `palpate capture --probe FILE`, or leave grazing out of the file.")
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use palpate::with;

    #[derive(Parser)]
    struct Program {
        #[command(flatten)]
        real: RealArguments,
    }

    fn parsed(words: &[&str]) -> RealArguments {
        Program::try_parse_from([&["program"], words].concat()).unwrap_or_else(|error| panic!("{error}")).real
    }

    #[test]
    fn settings_stand_for_noise() {
        let given = parsed(&["--real", "noise=0..10ms,missed=2%"]);
        let noise = given.over(Noise::switch()).unwrap();
        assert_eq!((noise.deviation.largest, noise.timer, noise.missed), (10_000.0, 1_000.0, [0.02; 3]));
        assert!(given.is_given() && !parsed(&[]).is_given() && parsed(&["--real", "none"]).is_given());
        assert_eq!(parsed(&[]).over(Noise::switch()).unwrap(), Noise::switch());
        assert!(parsed(&["--real", "none"]).over(Noise::switch()).unwrap().is_none());
    }

    #[test]
    fn a_probe_file_says_all_of_it() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("probe.toml");
        std::fs::write(&path, "radius = 1\nspacing = 2\nspeed = 3\n[real]\nmissed = \"2%\"\n").unwrap();
        let given = parsed(&["--real", path.to_str().unwrap()]);
        assert_eq!(given.over(Noise::switch()).unwrap(), with!(Noise::default(), missed = [0.02; 3]));
        std::fs::remove_file(&path).unwrap();
        assert!(given.over(Noise::switch()).unwrap_err().to_string().contains("probe.toml"));
    }

    #[test]
    fn what_is_no_noise_is_refused_with_an_example() {
        for text in ["5ms", "noise=5", "missed=few", "pose_noise=5", ""] {
            let error = Program::try_parse_from(["program", "--real", text]).err().unwrap().to_string();
            assert!(error.contains("such as") || error.contains("value is required"), "{error}");
        }
        let error = Program::try_parse_from(["program", "--real", "timer=1ms,mised=2%"]).err().unwrap().to_string();
        assert!(error.contains("Did you mean missed?"), "{error}");
    }
}
