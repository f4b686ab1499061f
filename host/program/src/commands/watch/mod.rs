mod screen;

use super::link::ChipOptions;
use palpate::Result;
use palpate::chip::watch::{Follow, Status};
use palpate::chip::{ChipModel, Connection, Entry, Port, Received, Update, probability, stream};
use palpate::output::print;
use palpate_shared::link::Event;
use screen::Screen;
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate watch /dev/ttyACM0              a chip with its own fingers
  palpate watch emulator touches/ --load model.palpate
                                          an emulated chip and a data set
  palpate watch journal.jsonl             what palpate link --journal writes

q, Esc or Ctrl-C quit. When the output is not a terminal, plain lines are printed instead.")]
pub(crate) struct Arguments {
    /// A serial port, tcp://HOST:PORT, emulator, or a journal that `palpate link --journal` writes
    #[arg(value_parser = source)]
    source: Source,
    /// Touches to recognize: a data set's directory, a file of lines, or - for standard input
    data: Option<PathBuf>,
    #[command(flatten)]
    chip: ChipOptions,
}

#[derive(Clone)]
enum Source {
    Chip(Port),
    Journal(PathBuf),
}

fn source(text: &str) -> Result<Source> {
    // A serial port is a file, too, but none with lines to follow.
    if Path::new(text).is_file() { Ok(Source::Journal(text.into())) } else { text.parse().map(Source::Chip) }
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    match &arguments.source {
        Source::Journal(path) => follow(path),
        Source::Chip(port) => watch(&arguments, port),
    }
}

fn watch(arguments: &Arguments, port: &Port) -> Result<()> {
    let steps = arguments.data.as_deref().map(|source| arguments.chip.steps(source)).transpose()?;
    let (mut connection, loaded) = arguments.chip.open(port)?;
    let chip = connection.model()?;
    let mut display = Display::open(port.to_string())?;
    display.take(Entry::Model {
        objects: chip.names.clone(),
        length: chip.info.length,
        checksum: chip.info.checksum,
    })?;
    let start = Instant::now();
    let mut each = |connection: &mut Connection, update: Update| {
        let asks = matches!(&update, Update::Touch { posteriors: None, .. } | Update::Event(..));
        if let Some(entry) = Entry::of(&update, &chip, start.elapsed()) {
            display.take(entry)?;
        }
        if display.is_due() {
            display.ask(connection, &chip, asks)?;
            return display.show();
        }
        Ok(ControlFlow::Continue(()))
    };
    match steps {
        Some(steps) => {
            let model = loaded.as_ref().map(|file| file.model());
            stream(&mut connection, steps, &chip, model.as_ref(), arguments.chip.active, &mut each)?;
        }
        None => loop {
            let update = match connection.hear(Duration::from_millis(50))? {
                Some(Received::Event(event, missed)) => Update::Event(event, missed),
                Some(Received::Earlier(event)) => Update::Event(event, 0),
                _ => Update::Idle,
            };
            let asks = arguments.chip.active
                && matches!(&update, Update::Event(Event::Touch { .. } | Event::Refused { .. }, _));
            if each(&mut connection, update)?.is_break() {
                return Ok(());
            }
            if asks {
                let approach = connection.next_approach()?;
                if each(&mut connection, Update::Next(approach))?.is_break() {
                    return Ok(());
                }
            }
        },
    }
    if display.has_quit {
        return Ok(());
    }
    display.ask(&mut connection, &chip, false)?;
    display.finish()
}

/// Shows a journal, and on a screen also what is appended to it meanwhile.
fn follow(path: &Path) -> Result<()> {
    let mut journal = Follow::open(path)?;
    let mut display = Display::open(path.display().to_string())?;
    loop {
        while let Some(entry) = journal.next_entry()? {
            display.take(entry)?;
            if display.is_due() && display.show()?.is_break() {
                return Ok(());
            }
        }
        let Some(screen) = &display.screen else { return Ok(()) };
        screen.wait()?;
        if display.show()?.is_break() {
            return Ok(());
        }
    }
}

/// A screen, or plain lines.
struct Display {
    status: Status,
    screen: Option<Screen>,
    has_quit: bool,
}

impl Display {
    fn open(source: String) -> Result<Self> {
        let screen = std::io::stdout().is_terminal().then(Screen::open).transpose()?;
        Ok(Self { status: Status::new(source), screen, has_quit: false })
    }

    fn take(&mut self, entry: Entry) -> Result<()> {
        self.status.take(&entry);
        if self.screen.is_none() {
            print(&format!("{entry}\n"))?;
        }
        Ok(())
    }

    fn is_due(&self) -> bool {
        self.screen.as_ref().is_some_and(Screen::is_due)
    }

    /// Takes the link's statistics, and if need be the chip's posteriors.
    fn ask(&mut self, connection: &mut Connection, chip: &ChipModel, posteriors: bool) -> Result<()> {
        let (here, there) = (connection.statistics(), connection.chip_statistics()?);
        let garbled = here.garbled + u64::from(there.garbled);
        if posteriors {
            let q56 = connection.posteriors(chip.names.len())?;
            self.status.posteriors = q56.into_iter().map(probability).collect();
        }
        self.take(Entry::Link { resent: here.resent, garbled, missed: here.missed_events })
    }

    fn show(&mut self) -> Result<ControlFlow<()>> {
        let Some(screen) = &mut self.screen else { return Ok(ControlFlow::Continue(())) };
        self.has_quit |= !screen.show(&self.status)?;
        Ok(if self.has_quit { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
    }

    /// Keeps the last screen until the user quits.
    fn finish(mut self) -> Result<()> {
        self.status.ended = true;
        while self.screen.is_some() && self.show()?.is_continue() {
            if let Some(screen) = &self.screen {
                screen.wait()?;
            }
        }
        Ok(())
    }
}
