//! `palpate link --watch`.

use super::Arguments;
use super::screen::Screen;
use crate::commands::Global;
use palpate::Result;
use palpate::chip::watch::{Follow, Status};
use palpate::chip::{ChipModel, Connection, Entry, Port, Received, Update, probability, stream};
use palpate::output::print;
use palpate_shared::link::Event;
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::{Duration, Instant};

pub(super) fn run(arguments: &Arguments, global: &Global) -> Result<()> {
    let path = Path::new(&arguments.port);
    // A serial port is a file, too, but none with lines to follow.
    if path.is_file() {
        return follow(path, global.json);
    }
    watch(arguments, &arguments.port.parse()?, global)
}

fn watch(arguments: &Arguments, port: &Port, global: &Global) -> Result<()> {
    let steps = arguments.source.as_deref().map(|source| arguments.steps(source)).transpose()?;
    let (mut connection, loaded) = arguments.open(port, global.seed())?;
    let chip = connection.model()?;
    let asked = arguments.asks(&chip)?;
    let mut display = Display::open(port.to_string(), global.json)?;
    display.take(Entry::model(&chip))?;
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
            stream(&mut connection, steps, &chip, loaded.as_deref(), asked, &mut each)?;
        }
        None => loop {
            let update = match connection.hear(Duration::from_millis(50))? {
                Some(Received::Event(event, missed)) => Update::Event(event, missed),
                Some(Received::Earlier(event)) => Update::Event(event, 0),
                _ => Update::Idle,
            };
            let asks =
                arguments.active && matches!(&update, Update::Event(Event::Touch { .. } | Event::Refused { .. }, _));
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
fn follow(path: &Path, json: bool) -> Result<()> {
    let mut journal = Follow::open(path)?;
    let mut display = Display::open(path.display().to_string(), json)?;
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

/// A screen, or plain lines, or JSON lines.
struct Display {
    json: bool,
    status: Status,
    screen: Option<Screen>,
    has_quit: bool,
}

impl Display {
    fn open(source: String, json: bool) -> Result<Self> {
        let screen = (!json && std::io::stdout().is_terminal()).then(Screen::open).transpose()?;
        Ok(Self { json, status: Status::new(source), screen, has_quit: false })
    }

    fn take(&mut self, entry: Entry) -> Result<()> {
        self.status.take(&entry);
        if self.json {
            crate::commands::print_line(&entry)?;
        } else if self.screen.is_none() {
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
