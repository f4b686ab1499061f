//! State of a chip, drawn in a terminal.

use crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};
use crossterm::style::{ContentStyle, PrintStyledContent, StyledContent, Stylize};
use crossterm::{cursor, execute, queue, terminal};
use palpate::chip::watch::Status;
use palpate::{Error, Result};
use std::io::{Write, stdout};
use std::iter::repeat_n;
use std::time::{Duration, Instant};
use unicode_width::{UnicodeWidthChar, UnicodeWidthStr};

/// Between two drawings.
const INTERVAL: Duration = Duration::from_millis(50);

/// The longest name that is shown whole, in columns.
const LONGEST_NAME: usize = 20;

/// A terminal that shows a chip's status. When this is dropped, and after a panic, the terminal is as it was before.
pub(super) struct Screen {
    drawn: Option<Instant>,
}

impl Screen {
    /// Takes the terminal over.
    ///
    /// # Errors
    /// When there is none.
    pub(super) fn open() -> Result<Self> {
        terminal::enable_raw_mode().map_err(io)?;
        let screen = Self { drawn: None };
        execute!(stdout(), terminal::EnterAlternateScreen, cursor::Hide).map_err(io)?;
        let report = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            restore();
            report(panic);
        }));
        Ok(screen)
    }

    /// True if it is time to draw again.
    pub(super) fn is_due(&self) -> bool {
        self.drawn.is_none_or(|drawn| drawn.elapsed() >= INTERVAL)
    }

    /// Draws, and returns whether the user wants to go on: q, Esc and Ctrl-C end the program.
    ///
    /// # Errors
    /// When the terminal is gone.
    pub(super) fn show(&mut self, status: &Status) -> Result<bool> {
        let (width, height) = terminal::size().map_err(io)?;
        paint(&lines(status, width.into(), height.into())).map_err(io)?;
        self.drawn = Some(Instant::now());
        while event::poll(Duration::ZERO).map_err(io)? {
            if let Event::Key(key) = event::read().map_err(io)?
                && key.kind == KeyEventKind::Press
            {
                let interrupted = key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
                if interrupted || matches!(key.code, KeyCode::Char('q') | KeyCode::Esc) {
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }

    /// Waits for a key, or until it is time to draw again.
    ///
    /// # Errors
    /// When the terminal is gone.
    pub(super) fn wait(&self) -> Result<()> {
        event::poll(INTERVAL).map(|_| ()).map_err(io)
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        restore();
    }
}

fn restore() {
    // Without a terminal there is nothing to restore.
    let _ = execute!(stdout(), terminal::LeaveAlternateScreen, cursor::Show);
    let _ = terminal::disable_raw_mode();
}

fn io(source: std::io::Error) -> Error {
    let fix = "To get plain lines instead, send the output to a file or a pipe.".into();
    Error::Io { path: "the terminal".into(), action: "draw", source, fix }
}

type Text = StyledContent<String>;

/// Writes lines over what is on the screen, at once.
fn paint(lines: &[Vec<Text>]) -> std::io::Result<()> {
    let mut bytes = Vec::new();
    queue!(bytes, terminal::BeginSynchronizedUpdate)?;
    for (row, line) in (0..).zip(lines) {
        queue!(bytes, cursor::MoveTo(0, row))?;
        for text in line {
            queue!(bytes, PrintStyledContent(text.clone()))?;
        }
        queue!(bytes, terminal::Clear(terminal::ClearType::UntilNewLine))?;
    }
    queue!(bytes, terminal::EndSynchronizedUpdate)?;
    let mut out = stdout().lock();
    out.write_all(&bytes)?;
    out.flush()
}

/// Fills `height` lines of at most `width` columns: source and verdict, posteriors, the last touches, the link.
fn lines(status: &Status, width: usize, height: usize) -> Vec<Vec<Text>> {
    // Besides the posteriors: the heading, a rule, an empty line, a rule, two touches and the footing.
    let shown = status.objects.len().min(height.saturating_sub(7).max(1));
    let mut lines = vec![heading(status)];
    lines.push(rule(
        &match status.objects.len() - shown {
            0 => " posterior ".into(),
            hidden => format!(" posterior, {hidden} more objects hidden "),
        },
        width,
    ));
    lines.extend(posteriors(status, shown, width));
    lines.push(status.next.iter().map(|next| next.clone().stylize()).collect());
    lines.push(rule("  no.       first    middle      last ", width));
    lines.extend(status.touches.iter().map(|touch| vec![touch.clone().stylize()]));
    lines.resize(height.saturating_sub(1), Vec::new());
    lines.push(vec![footing(status).dim()]);
    lines.truncate(height);
    lines.into_iter().map(|line| clip(line, width)).collect()
}

fn heading(status: &Status) -> Vec<Text> {
    let truth = status.truth.as_ref().map(|truth| format!("touching {truth}: ")).unwrap_or_default();
    let verdict = match status.verdict.as_str() {
        "undecided" => "undecided".to_owned().stylize(),
        "unknown" => "unknown".to_owned().bold().yellow(),
        "gave-up" => "gave up".to_owned().bold().yellow(),
        object => format!("recognized {object}").bold().green(),
    };
    vec![status.source.clone().bold(), format!("  {truth}").stylize(), verdict]
}

fn footing(status: &Status) -> String {
    let Status { count, rate, resent, garbled, missed, ended, .. } = status;
    let end = if *ended { "ended; q quits" } else { "q quits" };
    format!("{count} touches, {rate:.0}/s  link: {resent} resent, {garbled} garbled, {missed} missed  {end}")
}

/// A title in a horizontal rule.
fn rule(title: &str, width: usize) -> Vec<Text> {
    vec![(title.to_owned() + &"─".repeat(width.saturating_sub(title.width()))).stylize()]
}

/// One bar for each of `shown` objects, in the model's order; where they do not all fit, the likeliest first.
fn posteriors(status: &Status, shown: usize, width: usize) -> Vec<Vec<Text>> {
    let posterior = |object: usize| status.posteriors.get(object).copied().unwrap_or(0.0);
    let mut objects: Vec<usize> = (0..status.objects.len()).collect();
    let best = objects.iter().copied().max_by(|&a, &b| posterior(a).total_cmp(&posterior(b)));
    if shown < objects.len() {
        objects.sort_by(|&a, &b| posterior(b).total_cmp(&posterior(a)));
        objects.truncate(shown);
    }
    let names = status.objects.iter().map(|name| name.width()).max().unwrap_or(0).min(LONGEST_NAME);
    let bars = width.saturating_sub(names + 12);
    let line = |object: usize| {
        let probability = posterior(object);
        let name = status.objects.get(object).map_or("", String::as_str);
        let bar = bar(probability, bars);
        let text = format!(" {} {bar:bars$} {:7.2} %", pad(name, names), 100.0 * probability);
        vec![match (Some(object) == best && probability > 0.0, status.verdict == name) {
            (_, true) => text.green().bold(),
            (true, false) => text.cyan(),
            _ => text.stylize(),
        }]
    };
    objects.into_iter().map(line).collect()
}

/// A bar of eighths of a character.
fn bar(fraction: f64, width: usize) -> String {
    let eighths = (fraction.clamp(0.0, 1.0) * (8 * width) as f64).round() as usize;
    let mut bar = "█".repeat(eighths / 8);
    let rest = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉"];
    bar.push_str(rest.get(eighths % 8).unwrap_or(&""));
    bar
}

/// The beginning of a text that fits into `width` columns.
fn start(text: &str, width: usize) -> String {
    let mut used = 0;
    text.chars()
        .filter(|c| !c.is_control())
        .take_while(|c| {
            used += c.width().unwrap_or(0);
            used <= width
        })
        .collect()
}

/// The text, padded to `width` columns.
fn pad(text: &str, width: usize) -> String {
    let mut text = start(text, width);
    text.extend(repeat_n(' ', width - text.width()));
    text
}

/// The beginning of a line that fits into `width` columns.
fn clip(line: Vec<Text>, mut width: usize) -> Vec<Text> {
    let clip = |text: Text| {
        let style: ContentStyle = *text.style();
        let text = start(text.content(), width);
        width -= text.width();
        style.apply(text)
    };
    line.into_iter().map(clip).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::chip::Entry;

    fn status(objects: usize) -> Status {
        let mut status = Status::new("emulator");
        let names = (0..objects).map(|object| format!("object{object}")).collect();
        status.take(&Entry::Model { objects: names, length: 9_000, checksum: 7 });
        for number in 0..30_u32 {
            let posteriors = (0..objects).map(|object| if object == 3 { 0.75 } else { 0.01 }).collect();
            status.take(&Entry::Touch {
                times: [Some(0), None, Some(1_000 * number)],
                verdict: if number < 29 { "undecided".into() } else { "object3".into() },
                best: "object3".into(),
                touches: number + 1,
                posteriors: Some(posteriors),
                at: f64::from(number) / 10.0,
            });
        }
        status.take(&Entry::Link { resent: 5, garbled: 6, missed: 7 });
        status
    }

    fn text(status: &Status, width: usize, height: usize) -> Vec<String> {
        let rows = lines(status, width, height);
        assert_eq!(rows.len(), height);
        let row = |line: &Vec<Text>| line.iter().map(|text| text.content().as_str()).collect::<String>();
        let rows: Vec<String> = rows.iter().map(row).collect();
        assert!(rows.iter().all(|row| row.width() <= width), "{rows:#?}");
        rows
    }

    #[test]
    fn eighty_by_twenty_four_holds_ten_objects_touches_and_the_link() {
        let rows = text(&status(10), 80, 24);
        assert!(rows[0].contains("recognized object3"), "{rows:#?}");
        assert!(rows[5].contains("object3") && rows[5].contains("75.00 %") && rows[5].contains("████"), "{rows:#?}");
        assert!(rows[14].contains("30") && rows[14].contains("29.000 ms") && rows[14].contains("object3"), "{rows:#?}");
        assert!(rows[23].starts_with("30 touches, 10/s  link: 5 resent, 6 garbled, 7 missed  q quits"), "{rows:#?}");
    }

    #[test]
    fn many_objects_show_the_likeliest() {
        let rows = text(&status(100), 80, 24);
        assert!(rows[1].contains("83 more objects hidden"), "{rows:#?}");
        assert!(rows[2].contains("object3 "), "{rows:#?}");
    }

    #[test]
    fn no_size_makes_it_panic() {
        for (width, height) in [(0, 0), (1, 1), (2, 50), (200, 2), (10, 5), (300, 100)] {
            text(&status(10), width, height);
            text(&Status::new("nothing yet"), width, height);
        }
    }

    #[test]
    fn bars_grow_by_eighths() {
        assert_eq!(
            ["", "▏", "▌", "█"],
            [0.0, 1.0 / 32.0, 0.125, 0.25].map(|fraction| bar(fraction, 4)).each_ref().map(String::as_str)
        );
        assert_eq!((bar(1.0, 4), bar(7.0, 4)), ("████".into(), "████".into()));
    }

    #[test]
    fn wide_characters_keep_the_columns_and_control_characters_are_left_out() {
        assert_eq!((start("杯子 cup", 5), pad("杯子", 6)), ("杯子 ".into(), "杯子  ".into()));
        assert_eq!((start("杯子", 3), pad("a\u{1b}[2Jb", 6)), ("杯".into(), "a[2Jb ".into()));
    }
}
