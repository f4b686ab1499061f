//! `palpate data record`.

use crate::commands::link::LineOptions;
use crate::commands::link::record::{RecordArguments, from_chip, summary};
use crate::commands::{Global, remark};
use palpate::error::{Place, problem};
use palpate::touches::{Log, Longest, begins_log, text};
use palpate::{Error, Result, output};
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

#[derive(clap::Args)]
#[command(after_help = "\
A line is a touch: three contact times in seconds on any clock, - for a finger that did not touch, and optionally the probe's direction and alignment (six numbers), and behind them the hand's position in millimeters (three), separated by blanks or commas. A first line of column names and lines that begin with # are skipped. Lines `- - -` for approaches that touched nothing are recorded too; a chip reports those if it is told when an approach is over (GP5 on a Pico). SOURCE may also be a robot's log (MCAP), of which the touches of NAME are taken, or a chip, whose touches are added as soon as it reports them, until Ctrl-C; if the cable is pulled, this waits for it.

On a table, the object's name may end with its placement, as `palpate capture --scene table` names it; without one, the touches may be of any placement.

The directory gets NAME.txt and dataset.json; a second recording of the object is NAME/2.txt. All lines are added, or none if one of them is wrong.

Examples:
  palpate data record monday.txt -o recorded --object bowl
  palpate data record monday.txt -o recorded --object bowl --probe probe.toml
  palpate data record monday.mcap -o recorded --object bowl
  palpate data record monday.txt -o table --object bowl/+z --pose
  robot --print | palpate data record - -o recorded --object bowl --pose
  palpate data record /dev/ttyACM0 -o recorded --object bowl")]
pub(crate) struct Arguments {
    /// A file of lines, a log (MCAP), - for standard input, or a chip: a serial port, tcp://HOST:PORT, or emulator
    #[arg(value_name = "SOURCE")]
    source: String,
    /// Output; the data set's directory, such as recorded
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// The name of the object that was touched, such as bowl; or bowl/+z, if it lay on a table in that placement
    #[arg(long, value_name = "NAME")]
    object: String,
    #[command(flatten)]
    record: RecordArguments,
    /// Stop after this many touches in all [default: all that there are]
    #[arg(long, value_name = "N")]
    stop_after: Option<u64>,
    #[command(flatten)]
    line: LineOptions,
}

pub(super) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let Arguments { source, output: directory, object, record, .. } = &arguments;
    output::refuse_stdout(directory)?;
    if is_chip(source) {
        if record.has_position() {
            return Err(Error::setting("position", "given", "a file of lines or a log: a chip reports none"));
        }
        let port = source.parse()?;
        let recording = record.open(directory, object, source, SystemTime::now())?;
        let from = (&arguments.line, &port);
        return from_chip(from, recording, directory, arguments.stop_after, global.json);
    }
    let (source, lines): (_, Box<dyn Read>) = match source == "-" {
        true => ("standard input", Box::new(std::io::stdin())),
        false => {
            let opened = File::open(source).map_err(|error| Error::io(source, "read the touches", error))?;
            (source.as_str(), Box::new(opened))
        }
    };
    let longest = record.origin(directory)?.longest();
    let mut touches = read(BufReader::new(lines), Path::new(source), object, &longest)?;
    touches.truncate(arguments.stop_after.map_or(usize::MAX, |most| usize::try_from(most).unwrap_or(usize::MAX)));
    let mut recording = record.open(directory, object, source, SystemTime::now())?;
    recording.add_all(&touches).map_err(|error| error.in_file(source))?;
    let mut counts = [0; 4];
    for touch in &touches {
        counts[touch.times().iter().filter(|time| !time.is_missing()).count()] += 1;
    }
    let all = recording.all_touches();
    let result = serde_json::json!({
        "object": object, "touches": touches.len(), "all_touches": all, "contacts": counts,
    });
    global.print(&result, || summary(&recording, directory, counts))
}

/// True if a source is a chip rather than a file of touches.
fn is_chip(source: &str) -> bool {
    let is_com = source.strip_prefix("COM").is_some_and(|number| number.parse::<u16>().is_ok());
    let is_port =
        ["tcp://", "/dev/tty", "/dev/cu.", "/dev/serial/", "/dev/pts/"].iter().any(|begin| source.starts_with(begin));
    source == "emulator" && !Path::new(source).is_file() || is_com || is_port
}

/// The touches in a file of lines; those of the object in a log.
fn read(mut lines: impl BufRead, source: &Path, object: &str, longest: &Longest) -> Result<Vec<palpate_shared::Touch>> {
    let begin = lines.fill_buf().map_err(|error| Error::io(source, "read the touches", error))?;
    if begins_log(begin) {
        let log = Log::of(lines, source)?;
        log.skipped().iter().for_each(crate::commands::say);
        let (touches, others) = log.of_object(object)?;
        if others > 0 {
            remark(&format!("palpate: {}: skipped {others} touches of other objects", source.display()));
        }
        return Ok(touches);
    }
    let touches = text::within(lines, source, longest)?;
    match touches.is_empty() {
        true => Err(problem!("no touches in it")
            .fix("Give a line for each touch: three times in seconds, - for a missing contact.")
            .at(Place::file(source))),
        false => Ok(touches),
    }
}
