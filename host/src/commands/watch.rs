use super::link::{Reach, chip_model};
use palpate::Error;
use palpate::Result;
use palpate::chip::watch::{Follow, Screen, View, line};
use palpate::chip::{ChipModel, Connection, Entry, Owned, Port, Update, probability, stream};
use palpate::compile::CompiledModel;
use palpate::output::print;

use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate watch /dev/ttyACM0                          a chip with fingers of its own
  palpate watch emulator touches/ --load model.palpate   an emulated chip that gets a data set's touches
  palpate link /dev/ttyACM0 touches/ --journal j.jsonl &  then:  palpate watch j.jsonl

q, Esc or Ctrl-C quit. When the output is not a terminal, plain lines are printed instead.")]
pub(crate) struct Arguments {
    /// A serial port, tcp://host:port, emulator, or a journal that palpate link writes
    source: String,
    /// Touches to recognize: a data set's directory, a file of lines, or - for standard input
    data: Option<PathBuf>,
    #[command(flatten)]
    reach: Reach,
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    let path = Path::new(&arguments.source);
    // A serial port is a file, too, but none with lines to follow.
    if path.is_file() {
        return follow(path);
    }
    let port: Port = arguments
        .source
        .parse()
        .map_err(|what: String| Error::argument(format!("{}: {what}", arguments.source), "See palpate help watch."))?;
    let steps = arguments.data.as_deref().map(|source| arguments.reach.steps(source)).transpose()?;
    let (mut connection, loaded) = arguments.reach.open(&port)?;
    let chip = chip_model(&mut connection)?;
    let mut show = Show::open(port.to_string())?;
    show.take(Entry::Model { objects: chip.names.clone(), length: chip.info.length, checksum: chip.info.checksum })?;
    let start = Instant::now();
    let mut each = |connection: &mut Connection, update: Update| {
        let asks = matches!(&update, Update::Touch { posteriors: None, .. } | Update::Event(..));
        if let Some(entry) = Entry::of(&update, &chip, start.elapsed()) {
            show.take(entry)?;
        }
        if show.is_due() {
            show.look(connection, &chip, asks)?;
            return show.show();
        }
        Ok(ControlFlow::Continue(()))
    };
    match steps {
        Some(steps) => {
            let model = loaded.as_ref().map(CompiledModel::model);
            stream(&mut connection, steps, &chip, model.as_ref(), &mut each)?;
        }
        None => loop {
            let update = match connection.hear(Duration::from_millis(50))? {
                Some(Owned::Event(event, missed)) => Update::Event(event, missed),
                _ => Update::Idle,
            };
            if each(&mut connection, update)?.is_break() {
                return Ok(());
            }
        },
    }
    if show.has_quit {
        return Ok(());
    }
    show.look(&mut connection, &chip, false)?;
    show.finish()
}

/// Shows a journal, and what is appended to it while someone looks.
fn follow(path: &Path) -> Result<()> {
    let mut journal = Follow::open(path)?;
    let mut show = Show::open(path.display().to_string())?;
    loop {
        while let Some(entry) = journal.next_entry()? {
            show.take(entry)?;
            if show.is_due() && show.show()?.is_break() {
                return Ok(());
            }
        }
        let Some(screen) = &show.screen else { return Ok(()) };
        screen.wait();
        if show.show()?.is_break() {
            return Ok(());
        }
    }
}

/// A screen, or plain lines.
struct Show {
    view: View,
    screen: Option<Screen>,
    /// The user has seen enough.
    has_quit: bool,
}

impl Show {
    fn open(source: String) -> Result<Self> {
        let screen = std::io::stdout().is_terminal().then(Screen::open).transpose()?;
        Ok(Self { view: View::new(source), screen, has_quit: false })
    }

    fn take(&mut self, entry: Entry) -> Result<()> {
        self.view.take(&entry);
        if self.screen.is_none() {
            print(&(line(&entry) + "\n"))?;
        }
        Ok(())
    }

    fn is_due(&self) -> bool {
        self.screen.as_ref().is_some_and(Screen::is_due)
    }

    /// Looks at the link's statistics, and asks the chip for its posteriors.
    fn look(&mut self, connection: &mut Connection, chip: &ChipModel, posteriors: bool) -> Result<()> {
        let (here, there) = (connection.statistics(), connection.chip_statistics()?);
        let garbled = here.garbled + u64::from(there.garbled);
        let entry = Entry::Link { resent: here.resent, garbled, missed: here.missed_events };
        if posteriors {
            let q56 = connection.posteriors(chip.names.len())?;
            self.view.posteriors = q56.into_iter().map(probability).collect();
        }
        match self.screen {
            Some(_) => self.view.take(&entry),
            None => self.take(entry)?,
        }
        Ok(())
    }

    fn show(&mut self) -> Result<ControlFlow<()>> {
        let Some(screen) = &mut self.screen else { return Ok(ControlFlow::Continue(())) };
        self.has_quit |= !screen.show(&self.view)?;
        Ok(if self.has_quit { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
    }

    /// Keeps the last view until the user has seen enough.
    fn finish(mut self) -> Result<()> {
        self.view.ended = true;
        while self.screen.is_some() && self.show()?.is_continue() {
            if let Some(screen) = &self.screen {
                screen.wait();
            }
        }
        Ok(())
    }
}
