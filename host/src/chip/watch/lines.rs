//! A journal's entries as lines for people.

use crate::chip::Entry;

/// An entry as a line, without an end of line.
pub fn line(entry: &Entry) -> String {
    match entry {
        Entry::Model { objects, length, checksum } => {
            format!("model of {length} bytes, checksum {checksum:08x}: {}", objects.join(", "))
        }
        Entry::Object { name: Some(name) } => format!("another object: {name}"),
        Entry::Object { name: None } => "another object".into(),
        Entry::Touch { times, verdict, best, touches, posteriors, .. } => {
            let times = times.map(|time| match time {
                Some(micros) => format!("{:9.3}", f64::from(micros) / 1e3),
                None => format!("{:>9}", "-"),
            });
            let posterior = posteriors.as_ref().and_then(|p| p.iter().copied().reduce(f64::max));
            let posterior = posterior.map(|p| format!(" {:.1} %", 100.0 * p)).unwrap_or_default();
            let said = if verdict == "undecided" { format!("perhaps {best}{posterior}") } else { verdict.clone() };
            format!("{touches:5} {} ms  {said}", times.join(" "))
        }
        Entry::Fault { what } => format!("fault: {what}"),
        Entry::Link { resent, garbled, missed } => {
            format!("link: {resent} frames sent again, {garbled} garbled, {missed} events missed")
        }
    }
}
