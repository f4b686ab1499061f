use super::Global;
use super::expected::ExpectedArguments;
use super::kinds::{self, ModelKind};
use super::numbers::error_rate;
use super::recognize_lines::{Event, Line, each_of};
use super::rows::reset;
use palpate::Result;
use palpate::chip::Entry;
use palpate::compile;
use palpate::error::{Error, Place};
use palpate::evaluate::{self, no_plan, too_many_objects};
use palpate::touches::Longest;
use palpate_onboard::{Model, Recognizer, Stopping, Verdict};
use palpate_shared::Touch;
use palpate_shared::format::Counted;
use palpate_shared::link::ApproachMessage;
use std::path::PathBuf;

/// Recognize objects from a stream of touches.
#[derive(clap::Args)]
#[command(after_help = "\
Each line in is a touch: three contact times in seconds, - for a finger that did not touch, and six numbers of the probe's direction and alignment if the model needs them. Each line out is the verdict so far: undecided, recognized, unknown or gave-up. After a verdict, and after an empty line, the next touch is the first of another object. FILE may be a robot's log (MCAP) as well. --next needs a model with a plan of approaches.

Examples:
  palpate recognize model.palpate data/fork.txt
  probe | palpate recognize model.palpate
  palpate recognize model.palpate data/fork.txt --error-rate 5% --max-touches 30
  palpate recognize model.palpate data/fork.txt --only fork,spoon,bowl
  palpate recognize model.palpate data/fork.txt --prior fork=0.3,spoon=0.3
  probe | palpate recognize planned.palpate --next
  palpate recognize model.palpate monday.mcap")]
pub(crate) struct Arguments {
    /// Model that `palpate export` wrote
    model: PathBuf,
    /// File with touches, or a robot's log (MCAP); - is standard input
    #[arg(default_value = "-")]
    file: PathBuf,
    /// The share of wrong names to accept, such as 1%; stops there [default: the model's own thresholds]
    #[arg(long, value_name = "RATE", value_parser = error_rate)]
    error_rate: Option<f64>,
    /// Give up after this many touches [default: the model's own limit]
    #[arg(long, value_name = "N")]
    max_touches: Option<u32>,
    /// Say after each touch where to touch next
    #[arg(long)]
    next: bool,
    #[command(flatten)]
    expected: ExpectedArguments,
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let compiled = kinds::compiled(&arguments.model, ModelKind::Touches, "recognize")?;
    let model = compiled.model();
    let stopping = stopping(&model, arguments.error_rate, arguments.max_touches)?;
    let of_model = |error: Error| error.at(Place::file(&arguments.model));
    let recognizer = Recognizer::<256>::new(&model, stopping).map_err(|error| of_model(too_many_objects(error)))?;
    let weights = arguments.expected.weights(&compiled.names(), &evaluate::own_weights(&model))?;
    if arguments.next && model.plan().is_none() {
        return Err(of_model(no_plan()));
    }
    let longest = compile::longest(&model);
    let (proposes, json) = (arguments.next, global.json);
    let mut stream =
        Stream { recognizer, model: &model, weights, longest, proposes, json, touches: 0, is_any_partial: false };
    stream.reset();
    each_of(&arguments.file, &mut |event| stream.take(event))?;
    if model.trained_touches().counted != Counted::Full {
        super::warn_of_full(stream.touches, stream.is_any_partial);
    }
    Ok(())
}

/// When to stop: by the model's own thresholds and limit, where no others are given.
pub(super) fn stopping(model: &Model<'_>, error_rate: Option<f64>, limit: Option<u32>) -> Result<Stopping> {
    let own = Stopping::from_model(model);
    let limit = limit.unwrap_or(own.max_touches());
    let stopping = compile::stopping(error_rate.unwrap_or(own.error_rate()), limit)?;
    // The model's own threshold stays as it is, to the last bit.
    Ok(if error_rate.is_none() { own.with_max_touches(limit) } else { stopping })
}

/// A stream of touches and what recognizes them.
struct Stream<'m> {
    recognizer: Recognizer<'m, 256>,
    model: &'m Model<'m>,
    /// Frequencies of the objects, if they are not the model's.
    weights: Option<Vec<u32>>,
    /// The longest time between contacts that makes sense.
    longest: Longest,
    /// The next approach is printed.
    proposes: bool,
    json: bool,
    /// Number of touches, and whether a finger was missing in any of them.
    touches: usize,
    is_any_partial: bool,
}

impl<'m> Stream<'m> {
    fn take(&mut self, event: Event<'_>) -> Result<()> {
        match event {
            Event::Begin => self.reset(),
            Event::Touch { touch, place } => {
                if touch.position().is_some() {
                    return Err(super::located().at(place));
                }
                self.longest.check(touch).map_err(|error| error.at(place))?;
                self.push(touch)?;
            }
        }
        Ok(())
    }

    /// Takes a touch.
    fn push(&mut self, touch: &Touch) -> Result<()> {
        self.touches += 1;
        self.is_any_partial |= !touch.is_full();
        // A little later than the stroke is missing, as on the chip.
        let touch = &palpate::evaluate::delivered(self.model, touch);
        let refused = self.recognizer.push(touch).err().map(|refused| refused.to_string());
        self.line(refused).print(self.json)?;
        if self.recognizer.verdict() != Verdict::Undecided {
            self.reset();
        }
        Ok(())
    }

    /// Begins another object.
    fn reset(&mut self) {
        reset(&mut self.recognizer, self.weights.as_deref());
    }

    /// Line to print after a touch.
    fn line(&self, refused: Option<String>) -> Line<'m> {
        let best = self.recognizer.best();
        Line {
            touch: self.recognizer.touches(),
            verdict: self.recognizer.verdict().name(),
            // Before the first counted touch no object is more likely than the others.
            object: if self.recognizer.touches() == 0 { "" } else { self.model.object_name(best) },
            posterior: self.recognizer.posterior(best).to_f64(),
            refused,
            table_alone: false,
            exhausted: false,
            next: self.next(),
        }
    }

    /// The approach that helps most, where that is asked for and nothing is decided.
    fn next(&self) -> Option<Entry> {
        let poses =
            self.model.plan().filter(|_| self.proposes && self.recognizer.verdict() == Verdict::Undecided)?.poses();
        let proposal = self.recognizer.next_approach(0..poses.count())?;
        Some(Entry::next(&ApproachMessage::new(proposal.pose, proposal.score, &poses.pose(proposal.pose)?)))
    }
}
