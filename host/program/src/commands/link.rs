use super::progress::Bar;
use super::record::LinkArguments;
use clap::ArgGroup;
use palpate::chip::{
    ChipModel, Connection, Emulator, Entry, Faults, Journal, Port, Steps, Summary, Transport, Update, probability,
    stream,
};
use palpate::compile::CompiledModel;
use palpate::error::{ChipProblem, Place};
use palpate::output::{print, print_json};
use palpate::progress::Progress;
use palpate::touches::{Log, is_log};
use palpate::{Error, Result};
use palpate_shared::link::{Decision, HostSettings};
use std::io::BufReader;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Options of `link` and `watch`: how the chip is reached, and which touches it gets.
#[derive(clap::Args)]
pub(crate) struct ChipOptions {
    /// Load this model into the chip first; it is checked there before it is used
    #[arg(long, value_name = "FILE")]
    load: Option<PathBuf>,
    /// Touches of one object before the next object begins
    #[arg(long, value_name = "N", default_value_t = 60)]
    sequence: usize,
    /// Touches in all, from a data set or to record [default: all that it holds; until Ctrl-C]
    #[arg(long, value_name = "N")]
    touches: Option<u64>,
    /// Ask the chip after each touch for the approach that helps most; its model needs a plan (see `palpate plan`)
    #[arg(long)]
    pub(super) active: bool,
    /// Speed of a serial port, in bits per second
    #[arg(long, value_name = "BAUD", default_value_t = 115_200)]
    baud: u32,
    /// Image that the emulator runs [default: onboard/firmware/target/thumbv7em-none-eabihf/release/uart]
    #[arg(long, value_name = "ELF")]
    firmware: Option<PathBuf>,
    /// Make the line bad: the probabilities that a byte is lost, that a byte is changed and that a frame comes twice, and
    /// the longest delay in milliseconds
    #[arg(long, value_name = "LOST,CHANGED,DOUBLED,MS")]
    bad_line: Option<Faults>,
    /// Seed of the bad line
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

impl ChipOptions {
    /// Opens the line.
    fn transport(&self, port: &Port) -> Result<Transport> {
        let emulator = self.firmware.clone().map_or_else(Emulator::default, Emulator::for_firmware);
        let transport = port.open(self.baud, &emulator)?;
        Ok(match self.bad_line {
            Some(faults) => transport.with_faults(faults, self.seed),
            None => transport,
        })
    }

    /// Opens a session, and loads the model if there is one to load.
    pub(crate) fn open(&self, port: &Port) -> Result<(Connection, Option<CompiledModel>)> {
        let model = self.load.as_deref().map(CompiledModel::read).transpose()?;
        if let Some(path) = self.load.as_deref()
            && model.as_ref().is_some_and(|model| model.model().descriptor().is_none())
        {
            return Err(Error::at(Place::file(path), ChipProblem::Rows));
        }
        let settings = match self.bad_line {
            // A bad line fails often: retry sooner, and more often.
            Some(_) => HostSettings { retry: 50_000, attempts: 200 },
            None => HostSettings::default(),
        };
        let mut connection = Connection::open(self.transport(port)?, settings)?;
        if let Some(file) = &model {
            connection.load(file.bytes(), &Bar::new())?;
        }
        Ok((connection, model))
    }

    /// The touches in `source`: a data set's directory, a file of lines, a log, or `-` for standard input.
    pub(crate) fn steps(&self, source: &Path) -> Result<Steps> {
        if source.as_os_str() == "-" {
            return Ok(Steps::lines(Box::new(BufReader::new(std::io::stdin())), Path::new("standard input")));
        }
        if source.is_dir() {
            let dataset = super::dataset(source)?;
            let count = self.touches.unwrap_or(dataset.len() as u64);
            return Ok(Steps::sequences(dataset, self.sequence, count));
        }
        if is_log(source) {
            let log = Log::read(source)?;
            log.skipped().iter().for_each(super::say);
            return Ok(Steps::logged(&log));
        }
        let file = std::fs::File::open(source).map_err(|e| Error::io(source, "read the touches", e))?;
        Ok(Steps::lines(Box::new(BufReader::new(file)), source))
    }
}

#[derive(clap::Args)]
#[command(group(ArgGroup::new("expected").args(["model", "load"])), after_help = "\
Examples:
  palpate link /dev/ttyACM0                           what is on the chip?
  palpate link /dev/ttyACM0 --load model.palpate      load a model into it
  palpate link /dev/ttyACM0 touches/                  recognize a data set
  echo '0.030 0 0.050' | palpate link /dev/ttyACM0 -  recognize typed touches
  palpate link /dev/ttyACM0 - --active                where to touch next
  palpate link /dev/ttyACM0 --record recorded --object bowl
                                                      keep its touches
  palpate link emulator --load model.palpate --parity touches/ --touches 10000
  palpate link emulator --load model.palpate --parity touches/ \\
      --bad-line 0.001,0.001,0.01,5

The chip runs the firmware in onboard/firmware (uart), or a program of your own around palpate_onboard::station.

A touch is one line of three contact times in seconds (- for a missing contact), as in a data set. An empty line begins \
another object. Every touch is counted exactly once, however bad the line.

With --record, what the chip's own fingers touch goes to DIR/NAME.txt, each touch as soon as the chip reports it, and \
dataset.json says when, with which probe and by which firmware. A model on the chip is not needed. If the cable is \
pulled, this waits for it; recording the same object again adds to it. See docs/guide/real-probe.md.

An approach that touches nothing closes no switch, so the chip cannot report it and it is not recorded. To train on misses \
(palpate train --touches all) or to compare contact patterns with those of a simulation, the robot has to say when an \
approach ended without a contact: add lines `- - -` for these with `palpate data record`.")]
pub(crate) struct Arguments {
    /// A serial port, tcp://HOST:PORT, or emulator
    port: Port,
    /// Touches to recognize: a data set's directory, a file of lines, a robot's log (MCAP), or - for standard input
    source: Option<PathBuf>,
    /// Recognize a data set's touches, and compare every verdict, posterior and evidence with the host's recognizer
    #[arg(long, value_name = "DIR", conflicts_with = "source", requires = "expected")]
    parity: Option<PathBuf>,
    /// The model to compare with, if it is on the chip already
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Write what happens to a file that `palpate watch` can follow
    #[arg(long, value_name = "FILE")]
    journal: Option<PathBuf>,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    record: LinkArguments,
    #[command(flatten)]
    chip: ChipOptions,
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    if let Some(recording) = arguments.record.open(&arguments.port.to_string())? {
        let (port, chip) = (&arguments.port, &arguments.chip);
        let (connection, _) = chip.open(port)?;
        let reopen = || chip.transport(port);
        return arguments.record.run(connection, reopen, recording, chip.touches, arguments.json);
    }
    let named = arguments.model.as_deref().map(CompiledModel::read).transpose()?;
    let steps = match arguments.parity.as_ref().or(arguments.source.as_ref()) {
        Some(source) => Some(arguments.chip.steps(source)?),
        None => None,
    };
    let (mut connection, loaded) = arguments.chip.open(&arguments.port)?;
    let chip = connection.model()?;
    if steps.is_some() && chip.info.descriptor().is_none() {
        return Err(ChipProblem::Rows.into());
    }
    let mut printer = Printer::new(&chip, arguments.json, arguments.journal.as_deref())?;
    let Some(steps) = steps else { return printer.model(&arguments.port) };

    let compiled = named.or(loaded);
    let model = compiled.as_ref().map(CompiledModel::model);
    let progress = Bar::new();
    progress.begin("touching", steps.count());
    let interactive = steps.count().is_none();
    let summary = stream(&mut connection, steps, &chip, model.as_ref(), arguments.chip.active, |_, update| {
        if matches!(update, Update::Touch { .. } | Update::Refused { .. }) {
            progress.advance(1);
        }
        progress.current().suspend(|| printer.update(&update, interactive))?;
        Ok(ControlFlow::Continue(()))
    })?;
    drop(progress);
    printer.summary(&summary)?;
    match summary.first_difference {
        Some(first) if arguments.parity.is_some() => {
            let Summary { differences, compared, .. } = summary;
            Err(ChipProblem::Differs { differences, compared, first }.into())
        }
        _ => Ok(()),
    }
}

/// Prints what happens, and writes it to a journal.
struct Printer<'c> {
    chip: &'c ChipModel,
    json: bool,
    journal: Option<Journal>,
    start: Instant,
    object: Option<String>,
}

impl<'c> Printer<'c> {
    fn new(chip: &'c ChipModel, json: bool, journal: Option<&Path>) -> Result<Self> {
        let mut journal = journal.map(Journal::create).transpose()?;
        if let Some(journal) = &mut journal {
            let info = chip.info;
            journal.write(&Entry::Model {
                objects: chip.names.clone(),
                length: info.length,
                checksum: info.checksum,
            })?;
        }
        Ok(Self { chip, json, journal, start: Instant::now(), object: None })
    }

    fn model(&self, port: &Port) -> Result<()> {
        let info = self.chip.info;
        if self.json {
            return print_json(&Entry::Model {
                objects: self.chip.names.clone(),
                length: info.length,
                checksum: info.checksum,
            });
        }
        let descriptor = info.descriptor().map_or("other features", |descriptor| descriptor.name());
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
        if let (Some(journal), Some(entry)) = (&mut self.journal, &entry) {
            journal.write(entry)?;
        }
        match update {
            Update::Object(name) => self.object.clone_from(name),
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

    fn summary(&mut self, summary: &Summary) -> Result<()> {
        if let Some(journal) = &mut self.journal {
            let garbled = summary.garbled + summary.chip_garbled;
            journal.write(&Entry::Link { resent: summary.resent, garbled, missed: summary.missed_events })?;
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
            "link: {} frames sent, {} again; {} garbled here, {} on the chip; {} commands came twice, {} too early\n",
            summary.sent,
            summary.resent,
            summary.garbled,
            summary.chip_garbled,
            summary.chip_repeated,
            summary.chip_early
        );
        print(&text)
    }
}
