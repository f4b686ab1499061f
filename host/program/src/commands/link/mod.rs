//! `palpate link`, and what it has in common with `palpate data record`.

pub(super) mod record;

use crate::commands::maps::print_located;
use crate::commands::progress::Bar;
use crate::commands::recognize_lines::Line;
use crate::commands::{self, Global};
use palpate::chip::{
    Asks, ChipModel, Connection, Emulator, Entry, Located, Port, Steps, Summary, Transport, Update, no_rows,
    probability, stream,
};
use palpate::compile::CompiledModel;
use palpate::error::{Place, problem};
use palpate::locate::{self, MapsFile};
use palpate::output::{print, print_json};
use palpate::progress::Progress;
use palpate::touches::{Log, is_log};
use palpate::{Error, Result};
use palpate_shared::link::{Decision, Event, HostSettings, Refusal, VerdictMessage};
use std::io::BufReader;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Touches of one object of a data set before the next object begins.
const PER_OBJECT: usize = 60;

/// Line to a chip.
#[derive(clap::Args)]
pub(crate) struct LineOptions {
    /// Speed of a serial port, in bits per second
    #[arg(long, value_name = "BAUD", default_value = "115200")]
    baud: u32,
}

impl LineOptions {
    /// Opens the line.
    pub(crate) fn transport(&self, port: &Port) -> Result<Transport> {
        port.open(self.baud, &Emulator::default())
    }

    /// Opens a session.
    pub(crate) fn open(&self, port: &Port) -> Result<Connection> {
        Connection::open(self.transport(port)?, HostSettings::default())
    }
}

#[derive(clap::Args)]
#[command(after_help = "\
The chip runs the firmware in onboard/firmware (uart), or a program of your own around palpate_onboard::station. A touch is one line of three contact times in seconds (- for a missing contact), as in a data set; an empty line begins another object. Maps take twelve columns, as `palpate maps recognize` does; --next then prints what that prints. Without touches, a line is printed for each touch of the chip's own fingers, until Ctrl-C or --stop-after; `palpate data record` records them.

Examples:
  palpate link /dev/ttyACM0                           what is on the chip, and what do its fingers touch?
  palpate link /dev/ttyACM0 --load model.palpate      load a model into it
  palpate link /dev/ttyACM0 touches/                  recognize a data set
  echo '0.030 0 0.050' | palpate link /dev/ttyACM0 -  recognize typed touches
  palpate link /dev/ttyACM0 - --next                  where to touch next
  palpate link emulator --load model.palpate --parity touches/ --stop-after 10000")]
pub(crate) struct Arguments {
    /// A serial port, tcp://HOST:PORT, or emulator
    port: Port,
    /// Touches to recognize: a data set's directory, a file of lines, a robot's log (MCAP), or - for standard input
    source: Option<PathBuf>,
    /// Load this model into the chip first; it is checked there before it is used. Without touches, that is all
    #[arg(long, value_name = "FILE")]
    load: Option<PathBuf>,
    /// Recognize a data set's touches, and compare every verdict, posterior and evidence with the host's recognizer
    #[arg(long, value_name = "DIR", conflicts_with = "source", requires = "load")]
    parity: Option<PathBuf>,
    /// Stop after this many touches in all [default: all that there are]
    #[arg(long, value_name = "N")]
    stop_after: Option<u64>,
    /// Say after each touch where to touch next
    #[arg(long)]
    next: bool,
    /// Keep the middle finger this close to the table's origin, in x and y [default: twice the maps' range]
    #[arg(long, value_name = "MM", requires = "next")]
    workspace: Option<f64>,
    #[command(flatten)]
    line: LineOptions,
}

impl Arguments {
    /// Opens a session, and loads the model if there is one to load.
    fn open(&self) -> Result<(Connection, Option<Vec<u8>>)> {
        let loaded = self.load.as_deref().map(model_of_touches).transpose()?;
        let mut connection = self.line.open(&self.port)?;
        if let Some(bytes) = &loaded {
            connection.load(bytes, &Bar::new())?;
        }
        Ok((connection, loaded))
    }

    /// The question to a chip with this model after each touch.
    fn asks(&self, chip: &ChipModel) -> Result<Asks> {
        match (self.next, chip.info.has_maps(), self.workspace) {
            (false, ..) => Ok(Asks::Nothing),
            (true, true, workspace) => Ok(Asks::Place { within: workspace.map(locate::within).transpose()? }),
            (true, false, None) => Ok(Asks::Approach),
            (true, false, Some(_)) => Err(Error::setting("workspace", "given", "it with a model of maps")),
        }
    }

    /// The touches in `source`: a data set's directory, a file of lines, a log, or `-` for standard input.
    fn steps(&self, source: &Path) -> Result<Steps> {
        if source.as_os_str() == "-" {
            return Ok(Steps::lines(Box::new(BufReader::new(std::io::stdin())), Path::new("standard input")));
        }
        if source.is_dir() {
            let dataset = commands::dataset(source)?;
            let count = self.stop_after.unwrap_or(dataset.len() as u64);
            return Ok(Steps::sequences(dataset, PER_OBJECT, count));
        }
        if is_log(source) {
            let log = Log::read(source)?;
            log.skipped().iter().for_each(commands::say);
            return Ok(Steps::logged(&log));
        }
        let file = std::fs::File::open(source).map_err(|e| Error::io(source, "read the touches", e))?;
        Ok(Steps::lines(Box::new(BufReader::new(file)), source))
    }
}

/// The bytes of a model of trees over touches, or of maps.
fn model_of_touches(path: &Path) -> Result<Vec<u8>> {
    if let Some(maps) = MapsFile::read(path)? {
        return Ok(maps.maps().model().to_vec());
    }
    let compiled = CompiledModel::read(path)?;
    match compiled.model().descriptor() {
        Some(_) => Ok(compiled.bytes().to_vec()),
        None => Err(no_rows().at(Place::file(path))),
    }
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let steps = match arguments.parity.as_ref().or(arguments.source.as_ref()) {
        Some(source) => Some(arguments.steps(source)?),
        None => None,
    };
    let (mut connection, model) = arguments.open()?;
    let chip = connection.must_have_model()?;
    if steps.is_some() && chip.info.descriptor().is_none() && !chip.info.has_maps() {
        return Err(no_rows());
    }
    let mut printer = Printer::new(&chip, global.json);
    let Some(steps) = steps else {
        if model.is_some() {
            return printer.model(&arguments.port);
        }
        return own_fingers(&mut connection, &chip, &arguments, global.json);
    };

    let asks = arguments.asks(&chip)?;
    printer.prints_places = matches!(asks, Asks::Place { .. });
    let progress = Bar::new();
    progress.begin("touching", steps.count());
    let interactive = steps.count().is_none();
    let summary = stream(&mut connection, steps, &chip, model.as_deref(), asks, |_, update| {
        if matches!(update, Update::Touch { .. } | Update::Refused { .. }) {
            progress.advance(1);
        }
        progress.current().suspend(|| printer.update(&update, interactive))?;
        Ok(ControlFlow::Continue(()))
    })?;
    drop(progress);
    let is_silent = printer.prints_places && arguments.parity.is_none();
    printer.summary(&summary, is_silent)?;
    match summary.first_difference {
        Some(first) if arguments.parity.is_some() => {
            let Summary { differences, compared, .. } = summary;
            Err(problem!("{differences} of {compared} touches differ; the first: {first}")
                .fix("Report this as a bug, with the model and the touches."))
        }
        _ => Ok(()),
    }
}

/// Prints a line for the chip's model, and for each touch of its own fingers until there were as many as wanted.
fn own_fingers(connection: &mut Connection, chip: &ChipModel, arguments: &Arguments, json: bool) -> Result<()> {
    let say = |entry: &Entry| if json { commands::print_line(entry) } else { print(&format!("{entry}\n")) };
    let asks = match arguments.asks(chip)? {
        Asks::Place { .. } => return Err(Error::setting("next", "given", "it with touches")),
        asks => asks == Asks::Approach,
    };
    say(&Entry::model(chip))?;
    let (start, mut touches) = (Instant::now(), 0);
    while arguments.stop_after != Some(touches) {
        let Some((event, missed)) = connection.hear(Duration::from_millis(50))? else { continue };
        // A model that was loaded and cannot be read any more is replaced by the program's own.
        if event == Event::Started && connection.model()?.as_ref() != Some(chip) {
            return Err(problem!("the chip was reset and has another model than before")
                .fix(
                    "Load the model again. The chip's flash may be worn, or its program may have been replaced by one \
                     without the model's features.",
                )
                .at(Place::file(arguments.port.to_string())));
        }
        if missed > 0 {
            commands::remark(&format!("palpate: warning: {missed} reports of the chip were lost on the way"));
        }
        if let Some(entry) = Entry::of(&Update::Event(event, missed), chip, start.elapsed()) {
            say(&entry)?;
        }
        if matches!(event, Event::Touch { .. } | Event::Refused { .. }) {
            touches += 1;
            if asks {
                let approach = connection.next_approach()?.map_err(|refusal| connection.refused(refusal))?;
                say(&Entry::next(&approach))?;
            }
        }
    }
    Ok(())
}

/// Prints what happens.
struct Printer<'c> {
    chip: &'c ChipModel,
    json: bool,
    start: Instant,
    object: Option<String>,
    /// Places are printed, as JSON, and nothing else of a touch.
    prints_places: bool,
    /// The last verdict, and the refusal of a touch after it.
    last: Option<VerdictMessage>,
    refused: Option<Refusal>,
}

impl<'c> Printer<'c> {
    fn new(chip: &'c ChipModel, json: bool) -> Self {
        let (start, object, last, refused) = (Instant::now(), None, None, None);
        Self { chip, json, start, object, prints_places: false, last, refused }
    }

    fn model(&self, port: &Port) -> Result<()> {
        let info = self.chip.info;
        if self.json {
            return print_json(&Entry::model(self.chip));
        }
        let other = if info.has_maps() { "maps" } else { "other features" };
        let descriptor = info.descriptor().map_or(other, |descriptor| descriptor.name());
        print(&format!(
            "{port}: a model of {} bytes, checksum {:08x}, {descriptor}, {} objects: {}\n",
            info.length,
            info.checksum,
            self.chip.names.len(),
            self.chip.names.join(", ")
        ))
    }

    fn name(&self, object: u8) -> &str {
        self.chip.names.get(usize::from(object)).map_or("?", String::as_str)
    }

    fn update(&mut self, update: &Update, every_touch: bool) -> Result<()> {
        let entry = Entry::of(update, self.chip, self.start.elapsed());
        match update {
            Update::Object(name) => (self.object, self.last) = (name.clone(), None),
            Update::Touch { verdict, .. } if self.prints_places => (self.last, self.refused) = (Some(*verdict), None),
            Update::Refused { refusal, .. } if self.prints_places => self.refused = Some(*refusal),
            Update::Located(Located { table_alone, exhausted, poses, next }) => {
                let decision = self.last.map_or(Decision::Undecided, |last| last.decision);
                let posterior =
                    self.last.and_then(|last| last.detail).map_or(0.0, |detail| probability(detail.posterior()));
                let line = Line {
                    touch: self.last.map_or(0, |last| last.touches),
                    verdict: decision.name(),
                    object: self.last.map_or("", |last| self.name(last.best)),
                    posterior,
                    refused: self.refused.map(|refusal| refusal.to_string()),
                    table_alone: matches!(decision, Decision::Unknown | Decision::GaveUp) && *table_alone,
                    exhausted: *exhausted,
                    next: None,
                };
                let name = |placement: u8| self.chip.placements.get(usize::from(placement)).map_or("", String::as_str);
                print_located(line, poses.clone(), *next, name)?;
            }
            Update::Touch { verdict, decided, .. } if !self.json && (*decided || every_touch) => {
                let posterior = probability(verdict.detail.map_or(0, |detail| detail.posterior()));
                let said = match verdict.decision {
                    Decision::Recognized(object) => format!("recognized {}", self.name(object)),
                    Decision::Unknown => "unknown, fits no object".into(),
                    Decision::GaveUp => format!("gave up, most likely {}", self.name(verdict.best)),
                    _ => format!("most likely {}", self.name(verdict.best)),
                };
                let truth = self.object.as_ref().map(|name| format!("{name}: ")).unwrap_or_default();
                let touches = verdict.touches;
                let s = if touches == 1 { "" } else { "es" };
                print(&format!("{truth}{said} after {touches} touch{s}, posterior {posterior:.4}\n"))?;
            }
            Update::Next(_) if !self.json && every_touch => {
                if let Some(entry) = &entry {
                    print(&format!("{entry}\n"))?;
                }
            }
            Update::Refused { refusal, .. } if !self.json && every_touch => {
                print(&format!("not counted: {refusal}\n"))?
            }
            Update::Event(event, missed) if !self.json => print(&format!("the chip: {event:?}, {missed} missed\n"))?,
            _ => {}
        }
        Ok(())
    }

    /// Prints a summary, except where lines of JSON are all that is printed.
    fn summary(&mut self, summary: &Summary, is_silent: bool) -> Result<()> {
        if is_silent {
            return Ok(());
        }
        if self.json {
            return print_json(summary);
        }
        let Summary { touches, compared, differences, right, wrong, undecided, .. } = summary;
        let mut text = format!("{touches} touches in {:.1} s, {:.0} per second\n", summary.seconds, summary.rate());
        if right + wrong + undecided > 0 {
            text += &format!("objects: {right} correct, {wrong} wrong, {undecided} not recognized\n");
        }
        if summary.refused > 0 {
            text += &format!("not counted: {} touches that the model was not trained for\n", summary.refused);
        }
        if *compared > 0 {
            let approaches = match summary.approaches {
                0 => String::new(),
                approaches => format!(" and {approaches} proposed approaches"),
            };
            text += &format!("compared with the host: {compared} touches{approaches}, {differences} differences\n");
        }
        text += &format!(
            "link: {} requests sent, {} again; {} frames garbled here, {} on the chip; {} requests came twice, {} too late\n",
            summary.sent,
            summary.resent,
            summary.garbled,
            summary.chip_garbled,
            summary.chip_repeated,
            summary.chip_late
        );
        print(&text)
    }
}
