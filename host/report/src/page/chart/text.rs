//! Text in a chart: how wide it is, where its lines break, and what of it is shown where there is no room.

/// The height of text, in shown pixels.
pub(super) const SIZE: f64 = 13.0;
/// Height of text above its baseline.
pub(super) const ASCENT: f64 = 0.93 * SIZE;
/// Depth of text below its baseline.
pub(super) const DESCENT: f64 = 0.24 * SIZE;
/// Distance from the middle of a line of text down to its baseline.
pub(super) const MIDDLE: f64 = 0.36 * SIZE;
/// The distance of the baselines of two lines.
pub(super) const LINE: f64 = 16.0;

/// Advances of the characters from the space to the tilde in DejaVu Sans, the widest of the usual sans-serif fonts: in
/// hundredths of the text's size, rounded up.
const ADVANCES: [u8; 95] = [
    32, 41, 46, 84, 64, 96, 78, 28, 40, 40, 50, 84, 32, 37, 32, 34, 64, 64, 64, 64, 64, 64, 64, 64, 64, 64, 34, 34, 84,
    84, 84, 54, 100, 69, 69, 70, 78, 64, 58, 78, 76, 30, 30, 66, 56, 87, 75, 79, 61, 79, 70, 64, 62, 74, 69, 99, 69,
    62, 69, 40, 34, 40, 84, 50, 50, 62, 64, 55, 64, 62, 36, 64, 64, 28, 28, 58, 28, 98, 64, 62, 64, 64, 42, 53, 40, 64,
    60, 82, 60, 60, 53, 64, 34, 64, 84,
];
/// Bold text compared with text that is not.
const BOLD: f64 = 1.16;

/// The width of a line of text in shown pixels: at least what any usual sans-serif font takes.
pub(super) fn width(text: &str, bold: bool) -> f64 {
    let advance = |c: char| {
        let known = u32::from(c).checked_sub(32).and_then(|place| ADVANCES.get(place as usize));
        // Accents, signs and Greek are no wider than this, and characters of other scripts are square.
        known.map_or(if c < '\u{2e80}' { 0.85 } else { 1.0 }, |&advance| f64::from(advance) / 100.0)
    };
    text.chars().map(advance).sum::<f64>() * SIZE * if bold { BOLD } else { 1.0 }
}

/// The text if it is no wider than `room`, or as much of its beginning as is, with an ellipsis.
pub(super) fn shortened(text: &str, room: f64, bold: bool) -> String {
    if width(text, bold) <= room {
        return text.to_owned();
    }
    let mut short = text.to_owned();
    while short.pop().is_some() {
        let with_ellipsis = format!("{}…", short.trim_end());
        if width(&with_ellipsis, bold) <= room {
            return with_ellipsis;
        }
    }
    "…".into()
}

/// The text in at most `most` lines of at most `room`, broken at spaces; what does not fit is [`shortened`].
pub(super) fn wrapped(text: &str, room: f64, bold: bool, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let is_last = lines.len() == most;
        match lines.last_mut() {
            Some(line) if is_last || width(&format!("{line} {word}"), bold) <= room => *line += &format!(" {word}"),
            _ => lines.push(word.to_owned()),
        }
    }
    lines.into_iter().map(|line| shortened(&line, room, bold)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_that_is_too_long_is_broken_at_spaces_and_then_shortened() {
        let name = "instructions per touch, Cortex-M4F (estimated)";
        assert_eq!(wrapped(name, 600.0, false, 2), [name]);
        let lines = wrapped(name, 200.0, false, 2);
        assert_eq!(lines, ["instructions per touch,", "Cortex-M4F (estimated)"]);
        assert!(lines.iter().all(|line| width(line, false) <= 200.0));
        let lines = wrapped(name, 120.0, false, 2);
        assert!(lines.len() == 2 && lines[1].ends_with('…'), "{lines:?}");
        assert!(lines.iter().all(|line| width(line, false) <= 120.0));
        assert!(wrapped("", 100.0, false, 2).is_empty());
        assert_eq!(shortened("paperclip", 1.0, true), "…");
        assert_eq!(shortened("paperclip", 100.0, true), "paperclip");
    }

    #[test]
    fn digits_are_as_wide_as_in_the_widest_usual_font() {
        // In DejaVu Sans a digit takes 0.63623 of the text's size.
        let width = width("1000", false) / SIZE;
        assert!((2.5449..2.6).contains(&width), "{width}");
    }
}
