//! `palpate data record`.

use crate::commands::record::{RecordArguments, summary};
use palpate::touches::{Log, begins_log, text};
use palpate::{Error, Result, output};
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

#[derive(clap::Args)]
#[command(after_help = "\
A line is a touch: three contact times in seconds on any clock, - for a finger that did not touch, and if you like \
the probe's direction and alignment (six numbers). Lines like these come from any robot that can print. Lines `- - -` for \
approaches that missed are welcome: they say how often each object is missed.

FILE may be a robot's log as well (MCAP, see docs/reference/mcap.md): its touches of NAME are taken, or all of them if its messages \
name no object.

DIR gets NAME.txt and dataset.json, which says when, from where and with which probe the touches were recorded. All \
lines are added, or none if one of them is wrong. Touches of an object that is there already are added to it.

Examples:
  palpate data record monday.txt -o recorded --object bowl
  palpate data record monday.txt -o recorded --object bowl --probe probe.toml
  palpate data record monday.mcap -o recorded --object bowl
  robot --print | palpate data record - -o recorded --object bowl --pose")]
pub(crate) struct Arguments {
    /// A file of lines or a log in MCAP, or - for standard input
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The data set's directory, such as recorded; created if it is missing
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// The name of the object that was touched, such as bowl
    #[arg(long, value_name = "NAME")]
    object: String,
    #[command(flatten)]
    record: RecordArguments,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { file, output: directory, object, record, json } = arguments;
    output::refuse_stdout(directory)?;
    let (source, lines): (_, Box<dyn Read>) = match file.as_os_str() == "-" {
        true => ("standard input".into(), Box::new(std::io::stdin())),
        false => {
            let opened = File::open(file).map_err(|error| Error::io(file, "read the touches", error))?;
            (file.display().to_string(), Box::new(opened))
        }
    };
    let touches = read(BufReader::new(lines), Path::new(&source), object)?;
    let mut recording = record.open(directory, object, &source, SystemTime::now())?;
    recording.add_all(&touches).map_err(|error| error.in_file(&source))?;
    let mut counts = [0; 4];
    for touch in &touches {
        counts[touch.times().iter().filter(|time| !time.is_missing()).count()] += 1;
    }
    if *json {
        let all = recording.all_touches();
        return output::print_json(&serde_json::json!({
            "object": object, "touches": touches.len(), "all_touches": all, "contacts": counts,
        }));
    }
    output::print(&summary(&recording, directory, counts))
}

/// The touches in a file of lines; those of the object in a log.
fn read(mut lines: impl BufRead, source: &Path, object: &str) -> Result<Vec<palpate_shared::Touch>> {
    let begin = lines.fill_buf().map_err(|error| Error::io(source, "read the touches", error))?;
    if begins_log(begin) {
        let log = Log::of(lines, source)?;
        log.skipped().iter().for_each(crate::commands::say);
        let (touches, others) = log.of_object(object)?;
        if others > 0 {
            eprintln!("palpate: {}: skipped {others} touches of other objects", source.display());
        }
        return Ok(touches);
    }
    let touches = text::touches(lines, source).collect::<Result<Vec<_>>>()?;
    match touches.is_empty() {
        true => Err(Error::at(palpate::error::Place::file(source), palpate::error::TouchesProblem::NoTouches)),
        false => Ok(touches),
    }
}
