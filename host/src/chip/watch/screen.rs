//! The live view in a terminal.

use super::View;
use crate::error::{Error, Result};
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Borders, Paragraph};
use ratatui::{DefaultTerminal, Frame};
use std::time::{Duration, Instant};

/// Between two drawings.
const INTERVAL: Duration = Duration::from_millis(50);

/// A terminal that shows a view. The terminal is as it was before when this is dropped, and after a panic.
pub struct Screen {
    terminal: DefaultTerminal,
    drawn: Option<Instant>,
}

impl Screen {
    /// Takes the terminal over.
    ///
    /// # Errors
    /// When there is none.
    pub fn open() -> Result<Self> {
        let terminal = ratatui::try_init().map_err(io)?;
        Ok(Self { terminal, drawn: None })
    }

    /// Whether it is time to draw again.
    pub fn is_due(&self) -> bool {
        self.drawn.is_none_or(|drawn| drawn.elapsed() >= INTERVAL)
    }

    /// Draws, and says whether the user wants to go on: q, Esc and Ctrl-C end the view.
    ///
    /// # Errors
    /// When the terminal is gone.
    pub fn show(&mut self, view: &View) -> Result<bool> {
        self.terminal.draw(|frame| draw(view, frame)).map_err(io)?;
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

    /// Waits until it is time to draw again.
    pub fn wait(&self) {
        std::thread::sleep(INTERVAL);
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        ratatui::restore();
    }
}

fn io(source: std::io::Error) -> Error {
    Error::io("the terminal", "draw", source)
}

/// Draws a view: who and how fast, the posteriors, the last touches. Any size will do.
pub fn draw(view: &View, frame: &mut Frame) {
    let area = frame.area();
    let bars = u16::try_from(view.objects.len().max(1)).unwrap_or(u16::MAX).saturating_add(2);
    let bars = bars.min(area.height.saturating_sub(5).max(3));
    let rows = [Constraint::Length(1), Constraint::Length(bars), Constraint::Min(0), Constraint::Length(1)];
    let [head, posteriors, touches, foot] = Layout::vertical(rows).areas(area);
    frame.render_widget(Paragraph::new(heading(view)), head);
    draw_posteriors(view, frame, posteriors);
    let lines: Vec<Line> = view.touches.iter().map(|line| Line::from(line.as_str())).collect();
    let title = "  no.       first    middle      last ";
    frame.render_widget(Paragraph::new(lines).block(Block::new().borders(Borders::TOP).title(title)), touches);
    frame.render_widget(Paragraph::new(footing(view)).style(Style::new().add_modifier(Modifier::DIM)), foot);
}

fn heading(view: &View) -> Line<'_> {
    let bold = Style::new().add_modifier(Modifier::BOLD);
    let truth = view.truth.as_ref().map(|truth| format!("touching {truth}: ")).unwrap_or_default();
    let verdict = match view.verdict.as_str() {
        "undecided" => Span::raw("undecided"),
        "unknown" => Span::styled("unknown", bold.fg(Color::Yellow)),
        object => Span::styled(format!("recognized {object}"), bold.fg(Color::Green)),
    };
    Line::from(vec![Span::styled(view.source.as_str(), bold), Span::raw("  "), Span::raw(truth), verdict])
}

fn footing(view: &View) -> String {
    let View { count, rate, resent, garbled, missed, ended, .. } = view;
    let end = if *ended { "ended; q quits" } else { "q quits" };
    format!("{count} touches, {rate:.0}/s  link: {resent} resent, {garbled} garbled, {missed} missed  {end}")
}

/// A bar for each object, in the model's order; where they do not all fit, the likeliest.
fn draw_posteriors(view: &View, frame: &mut Frame, area: Rect) {
    let rows = usize::from(area.height.saturating_sub(2));
    let mut shown: Vec<usize> = (0..view.objects.len()).collect();
    let posterior = |object: usize| view.posteriors.get(object).copied().unwrap_or(0.0);
    if shown.len() > rows {
        shown.sort_by(|&a, &b| posterior(b).total_cmp(&posterior(a)));
        shown.truncate(rows);
    }
    let hidden = view.objects.len() - shown.len();
    let best = shown.iter().copied().max_by(|&a, &b| posterior(a).total_cmp(&posterior(b)));
    let names = view.objects.iter().map(|name| name.chars().count()).max().unwrap_or(0).min(20);
    let width = usize::from(area.width).saturating_sub(names + 12);
    let lines: Vec<Line> = shown
        .iter()
        .map(|&object| {
            let probability = posterior(object);
            let name = view.objects.get(object).map_or("", String::as_str);
            let style = match (Some(object) == best && probability > 0.0, view.verdict == name) {
                (_, true) => Style::new().fg(Color::Green).add_modifier(Modifier::BOLD),
                (true, false) => Style::new().fg(Color::Cyan),
                _ => Style::new(),
            };
            let name: String = name.chars().take(names).collect();
            let bar = bar(probability, width);
            Line::styled(format!(" {name:names$} {bar:width$} {:7.2} %", 100.0 * probability), style)
        })
        .collect();
    let title = match hidden {
        0 => " posterior ".into(),
        _ => format!(" posterior, {hidden} more objects hidden "),
    };
    let block = Block::new().borders(Borders::TOP | Borders::BOTTOM).title(title);
    frame.render_widget(Paragraph::new(lines).block(block), area);
}

/// A bar of eighths of a character.
fn bar(fraction: f64, width: usize) -> String {
    let eighths = (fraction.clamp(0.0, 1.0) * (8 * width) as f64).round() as usize;
    let mut bar = "█".repeat(eighths / 8);
    let rest = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉"];
    bar.push_str(rest.get(eighths % 8).unwrap_or(&""));
    bar
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::Entry;
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    fn view(objects: usize) -> View {
        let mut view = View::new("emulator");
        let names = (0..objects).map(|object| format!("object{object}")).collect();
        view.take(&Entry::Model { objects: names, length: 9_000, checksum: 7 });
        for number in 0..30_u32 {
            let posteriors = (0..objects).map(|object| if object == 3 { 0.75 } else { 0.01 }).collect();
            view.take(&Entry::Touch {
                times: [Some(0), None, Some(1_000 * number)],
                verdict: if number < 29 { "undecided".into() } else { "object3".into() },
                best: "object3".into(),
                touches: number + 1,
                posteriors: Some(posteriors),
                at: f64::from(number) / 10.0,
            });
        }
        view.take(&Entry::Link { resent: 5, garbled: 6, missed: 7 });
        view
    }

    fn text(view: &View, width: u16, height: u16) -> Vec<String> {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| draw(view, frame)).unwrap();
        let buffer = terminal.backend().buffer().clone();
        let row = |y| (0..width).map(|x| buffer[(x, y)].symbol()).collect::<String>();
        (0..height).map(row).collect()
    }

    #[test]
    fn eighty_by_twenty_four_holds_ten_objects_touches_and_the_link() {
        let rows = text(&view(10), 80, 24);
        assert!(rows[0].contains("recognized object3"), "{rows:#?}");
        assert!(rows[5].contains("object3") && rows[5].contains("75.00 %") && rows[5].contains("████"), "{rows:#?}");
        assert!(rows[14].contains("30") && rows[14].contains("29.000 ms") && rows[14].contains("object3"), "{rows:#?}");
        assert!(rows[23].starts_with("30 touches, 10/s  link: 5 resent, 6 garbled, 7 missed  q quits"), "{rows:#?}");
    }

    #[test]
    fn many_objects_show_the_likeliest() {
        let rows = text(&view(100), 80, 24);
        assert!(rows[1].contains("83 more objects hidden"), "{rows:#?}");
        assert!(rows[2].contains("object3 "), "{rows:#?}");
    }

    #[test]
    fn no_size_makes_it_panic() {
        for (width, height) in [(1, 1), (2, 50), (200, 2), (10, 5), (300, 100)] {
            text(&view(10), width, height);
            text(&View::new("nothing yet"), width, height);
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
}
