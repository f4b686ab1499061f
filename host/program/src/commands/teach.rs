//! Options and output of `palpate train` for recorded touches.

use palpate::error::{Place, Result, problem};
use palpate::results::{Results, Value};
use palpate::row;
use palpate::teach::{Taught, TaughtObject};
use palpate::touches::{Dataset, ObjectTouches, is_log};
use palpate::wording::percent;
use std::path::{Path, PathBuf};

/// Recorded touches.
#[derive(clap::Args, Clone, Debug, Default)]
pub(crate) struct RecordedArguments {
    /// Recorded touches of new objects; a directory, a file called like its object, or a log; repeatable
    #[arg(long, value_name = "DIR|FILE")]
    teach: Vec<PathBuf>,
}

/// Recorded touches, and what they are taught to.
#[derive(clap::Args, Clone, Debug, Default)]
pub(crate) struct TeachArguments {
    #[command(flatten)]
    pub(crate) recorded: RecordedArguments,
    /// Teach the recorded touches to this ensemble, instead of training another one
    #[arg(
        long,
        value_name = "FILE",
        requires = "teach",
        requires = "directory",
        conflicts_with_all = ["preset", "descriptor", "evidence", "trees", "probe", "real"]
    )]
    pub(crate) extend: Option<PathBuf>,
}

impl TeachArguments {
    /// The files that are read; the output must not be one of them.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        self.recorded.files().into_iter().chain(self.extend.clone()).collect()
    }
}

impl RecordedArguments {
    /// The recorded objects of all that was given; none if nothing was.
    pub(crate) fn read(&self) -> Result<Option<Dataset>> {
        let mut all: Option<Dataset> = None;
        for path in &self.teach {
            let is_whole = path.is_dir() || is_log(path);
            let read = if is_whole { super::checked(Dataset::read_any(path)?) } else { file(path)? };
            match &mut all {
                None => all = Some(read),
                Some(all) => add(all, read, path)?,
            }
        }
        Ok(all)
    }

    /// The files that are read; the output must not be one of them.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        let of = |path: &PathBuf| if path.is_dir() { super::files_of(path) } else { vec![path.clone()] };
        self.teach.iter().flat_map(of).collect()
    }
}

/// The touches of one file, as an object called like it.
fn file(path: &Path) -> Result<Dataset> {
    let touches = Dataset::read_file(path)?;
    Ok(Dataset::new(vec![touches]))
}

/// Adds the objects of `read`, from `path`. Several recordings of one object with positions are all of it.
fn add(all: &mut Dataset, mut read: Dataset, path: &Path) -> Result<()> {
    let is_located = super::is_located(&read);
    for own in all.objects.iter_mut().filter(|_| is_located) {
        if let Some(place) = read.objects.iter().position(|object| object.name == own.name) {
            *own = ObjectTouches::joined(own.name.clone(), &[own.clone(), read.objects.remove(place)]);
        }
    }
    if let Some(twice) = read.objects.iter().find(|object| all.objects.iter().any(|other| other.name == object.name)) {
        return Err(problem!("the object {} was given twice", twice.name)
            .fix("Put its touches into one file.")
            .at(Place::file(path)));
    }
    if let (Some(one), Some(other)) = (&all.origin, &read.origin) {
        let stated = [one, other].map(|origin| palpate::ensemble::StatedProbe::from(origin).trained());
        palpate::ensemble::StatedProbe::compare(["the first recording", &path.display().to_string()], stated)?;
    }
    all.origin = all.origin.take().or(read.origin);
    all.objects.extend(read.objects);
    all.objects.sort_by(|a: &ObjectTouches, b| a.name.cmp(&b.name));
    Ok(())
}

/// Taught objects and their figures.
pub(crate) fn text(taught: &Taught) -> String {
    let columns =
        ["taught", "recorded", "evidence", "jitter ×", "prior", "nats per touch", "recognized", "taken for it"];
    let mut rows = Results::new(columns);
    for TaughtObject { name, approaches, touches, smoothing, constant, recognized, taken_for_it } in &taught.objects {
        rows.push(row![
            name,
            *approaches,
            *touches,
            smoothing.jitter.to_string(),
            smoothing.prior.to_string(),
            Value::Number(*constant, 3),
            Value::Percent(*recognized, 1),
            Value::Percent(*taken_for_it, 1),
        ]);
    }
    let others = taught.others.map(|share| format!(" Of the other objects {} are recognized.", percent(share, 1)));
    format!(
        "\n{}Evidence is counted in approaches, priors in touches. Recognized and, of as many others, taken for it are shares after {} \
         approaches, of recorded touches that were held out.{}\n",
        rows.text(),
        taught.approaches,
        others.unwrap_or_default()
    )
}
