use palpate::Error;
use palpate::Result;
use palpate::compile::CompiledFile;
use palpate::output;
use palpate::touches::parse_touch;
use palpate_onboard::{Model, Recognizer, Refused, Stopping, Verdict};
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// Recognize objects from a stream of touches.
#[derive(clap::Args)]
#[command(after_help = "\
One touch a line in (three contact times in seconds, and the pose if the model needs it), one verdict a line out as it
arrives: undecided, recognized, or unknown once the limit of touches is reached. After a verdict the next touch is the
first of another object.

Examples:
  palpate recognize model.palpate data/fork.txt
  probe | palpate recognize model.palpate
  palpate recognize model.palpate - --json < data/fork.txt")]
pub(crate) struct Arguments {
    /// Model that `palpate export` wrote
    model: PathBuf,
    /// File with touches; - is standard input
    #[arg(default_value = "-")]
    file: PathBuf,
    /// Stop at this error rate instead of the model's
    #[arg(long, value_name = "RATE")]
    error_rate: Option<f64>,
    /// Give up after this many touches instead of the model's limit
    #[arg(long, value_name = "N")]
    max_touches: Option<u32>,
    /// Print a JSON object a line
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct Line<'a> {
    touch: u32,
    verdict: &'static str,
    object: &'a str,
    posterior: f64,
    /// Why the touch was not counted.
    #[serde(skip_serializing_if = "Option::is_none")]
    refused: Option<String>,
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    let file = CompiledFile::read(&arguments.model)?;
    let model = file.model()?;
    let stopping = stopping(&arguments, &model)?;
    let mut recognizer = Recognizer::<256>::new(&model, stopping)
        .map_err(|error| Error::file(&arguments.model, error.to_string(), "Use a model of at most 256 objects."))?;
    let path = &arguments.file;
    if path.as_os_str() == "-" {
        return stream(&mut recognizer, &model, std::io::stdin().lock(), Path::new("standard input"), arguments.json);
    }
    let touches = File::open(path).map_err(|source| Error::io(path, "read the touches", source))?;
    stream(&mut recognizer, &model, touches, path, arguments.json)
}

fn stopping(arguments: &Arguments, model: &Model<'_>) -> Result<Stopping> {
    let own = Stopping::from_model(model);
    let max_touches = arguments.max_touches.unwrap_or(own.max_touches());
    let Some(rate) = arguments.error_rate else {
        return Ok(own.with_max_touches(max_touches));
    };
    Stopping::new(rate, max_touches).ok_or_else(|| {
        Error::argument(
            format!("an error rate of {rate} after at most {max_touches} touches"),
            "Give an error rate between 1e-15 and 0.5, and at least one touch.",
        )
    })
}

/// A verdict for each line, printed before the next line is waited for.
fn stream(
    recognizer: &mut Recognizer<'_, 256>,
    model: &Model<'_>,
    touches: impl Read,
    path: &Path,
    json: bool,
) -> Result<()> {
    let mut reader = BufReader::new(touches);
    let mut bytes = Vec::new();
    for number in 1.. {
        bytes.clear();
        let read = reader.read_until(b'\n', &mut bytes);
        if read.map_err(|source| Error::io(path, "read the touches", source))? == 0 {
            break;
        }
        let wrong = |what: String| Error::line(path, number, what, "Correct the line.");
        let line = std::str::from_utf8(&bytes).map_err(|_| wrong("not text (no UTF-8)".to_owned()))?.trim();
        if line.is_empty() {
            continue;
        }
        let touch = parse_touch(line).map_err(wrong)?;
        let verdict = recognizer.push(&touch);
        print(recognizer, model, verdict, json)?;
        if recognizer.verdict() != Verdict::Undecided {
            recognizer.reset();
        }
    }
    Ok(())
}

fn print(
    recognizer: &Recognizer<'_, 256>,
    model: &Model<'_>,
    verdict: std::result::Result<Verdict, Refused>,
    json: bool,
) -> Result<()> {
    let best = recognizer.best();
    let line = Line {
        touch: recognizer.touches(),
        verdict: match recognizer.verdict() {
            Verdict::Undecided => "undecided",
            Verdict::Recognized { .. } => "recognized",
            Verdict::Unknown => "unknown",
        },
        // Before the first touch that counts, no object is more likely than another for a reason to be named.
        object: if recognizer.touches() == 0 { "" } else { model.object_name(best) },
        posterior: recognizer.posterior(best).to_f64(),
        refused: verdict.err().map(|refused| refused.to_string()),
    };
    if json {
        let text = serde_json::to_string(&line)
            .map_err(|e| Error::data(format!("cannot write the verdict as JSON: {e}"), "Report this as a bug."))?;
        return output::print(&format!("{text}\n"));
    }
    if let Some(refused) = line.refused {
        return output::print(&format!("{:4}  not counted: {refused}\n", line.touch));
    }
    output::print(&format!("{:4}  {:10}  {} {:.4}\n", line.touch, line.verdict, line.object, line.posterior))
}
