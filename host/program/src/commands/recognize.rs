use super::Global;
use super::expected::ExpectedArguments;
use super::numbers::error_rate;
use super::recognize_lines::{Event, Line, each_of};
use super::recognize_maps::{self, Asked};
use super::recognize_rows::reset;
use palpate::Result;
use palpate::chip::Entry;
use palpate::compile::{self, CompiledModel};
use palpate::error::{Error, Place};
use palpate::evaluate::{no_plan, raw_features, too_many_objects};
use palpate::locate::MapsFile;
use palpate::touches::Longest;
use palpate_onboard::{Model, Recognizer, Stopping, Verdict};
use palpate_shared::Touch;
use palpate_shared::format::Counted;
use palpate_shared::link::ApproachMessage;
use std::path::PathBuf;

/// Recognize objects from a stream of touches.
#[derive(clap::Args)]
#[command(after_help = "\
Each line in is a touch: three contact times in seconds, - for a finger that did not touch, and six numbers of the probe's direction and alignment if the model needs them. Each line out is the verdict so far: undecided, recognized, unknown or gave-up. After a verdict, and after an empty line, the next touch is the first of another object. FILE may be a robot's log (MCAP) as well. A model of maps takes touches with a position: twelve columns. With --next, the first approach to each object is at x = y = 0, with the row in any direction.

With --features each line in is a row of features for a model of another library: CSV with the features' names in the header; out is the class of each row, or a regression's value. With --add-up out is the verdict so far. With --sequence-column evidence begins where a sequence does, and nothing more is said of one after its verdict; without it the row after a verdict is the first of another object, and a promise is for the first verdict alone.

Examples:
  palpate recognize model.palpate data/fork.txt
  probe | palpate recognize model.palpate
  palpate recognize model.palpate data/fork.txt --error-rate 5% --max-touches 30
  palpate recognize model.palpate data/fork.txt --only fork,spoon,bowl
  palpate recognize model.palpate data/fork.txt --prior fork=0.3,spoon=0.3
  probe | palpate recognize planned.palpate --active
  robot | palpate recognize maps.palpate --next
  robot | palpate recognize hand.toml --explore=2mm/50%
  palpate recognize model.palpate monday.mcap
  palpate recognize model.palpate rows.csv --features --json
  palpate recognize a.palpate a.csv --features --add-up --sequence-column id")]
pub(crate) struct Arguments {
    /// Model that `palpate export` wrote
    model: PathBuf,
    /// File with touches, or a robot's log (MCAP); - is standard input
    #[arg(default_value = "-")]
    file: PathBuf,
    /// The file has rows of features, not touches
    #[arg(long)]
    features: bool,
    /// Add up the evidence of rows, like that of touches, until there is a verdict
    #[arg(long, requires = "features")]
    add_up: bool,
    /// Column that says which rows are one sequence
    #[arg(long, value_name = "COL", requires = "add_up")]
    sequence_column: Option<String>,
    /// The share of wrong names to accept, such as 1%; stops there [default: the model's own thresholds]
    #[arg(long, value_name = "RATE", value_parser = error_rate)]
    error_rate: Option<f64>,
    /// Give up after this many touches [default: the model's own limit]
    #[arg(long, value_name = "N")]
    max_touches: Option<u32>,
    /// With a model of maps: print each touch's verdict, place and next approach as JSON
    #[arg(long, conflicts_with_all = ["features", "active"])]
    next: bool,
    /// Map an object that stands still: prints as JSON where to touch next, until the heights of this share of its cells are known to this many millimeters
    #[arg(long, value_name = "MM/SHARE", num_args = 0..=1, require_equals = true, default_missing_value = "2mm/50%")]
    #[arg(conflicts_with_all = ["next", "features", "active"])]
    explore: Option<super::shape::Known>,
    /// Proposed approaches send the middle finger at most so far from the table's origin in x and y [default: twice the maps' range; 60 with --explore]
    #[arg(long, value_name = "MM")]
    workspace: Option<f64>,
    /// Follow the model's plan of approaches; says after each touch where to touch next
    #[arg(long)]
    active: bool,
    #[command(flatten)]
    expected: ExpectedArguments,
}

impl Arguments {
    /// Refuses options of a verdict where an object is mapped.
    fn check_exploring(&self) -> Result<()> {
        let rate = self.error_rate.map(|_| "error_rate");
        let given = rate.or(self.max_touches.map(|_| "max_touches")).or(self.expected.given());
        match given {
            Some(option) => Err(Error::setting(option, "given", "it without --explore, which names no object")),
            None => Ok(()),
        }
    }
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    if let Some(goal) = arguments.explore {
        arguments.check_exploring()?;
        return super::shape::explore(goal, &arguments.model, &arguments.file, arguments.workspace);
    }
    if arguments.workspace.is_some() && !arguments.next {
        return Err(Error::setting("workspace", "given", "it with --next or --explore"));
    }
    if let Some(maps) = MapsFile::read(&arguments.model)? {
        let Arguments { features, active, error_rate, max_touches, next, workspace, .. } = arguments;
        let of_trees = [("features", features), ("active", active)];
        if let Some((option, _)) = of_trees.iter().find(|(_, is_given)| *is_given) {
            let allowed = "it with a model of trees; a model of maps says with --next where to touch next";
            return Err(Error::setting(option, "given", allowed));
        }
        let asked = Asked { error_rate, max_touches, expected: &arguments.expected, next, workspace };
        return recognize_maps::run(&maps, &arguments.file, &asked, global);
    }
    let compiled = CompiledModel::read(&arguments.model)?;
    let model = compiled.model();
    let own = Stopping::from_model(&model);
    let max_touches = arguments.max_touches.unwrap_or(own.max_touches());
    let stopping = compile::stopping(arguments.error_rate.unwrap_or(own.error_rate()), max_touches)?;
    // The model's own threshold stays as it is, to the last bit.
    let stopping = if arguments.error_rate.is_none() { own.with_max_touches(max_touches) } else { stopping };
    let of_model = |error: Error| error.at(Place::file(&arguments.model));
    let recognizer = Recognizer::<256>::new(&model, stopping).map_err(|error| of_model(too_many_objects(error)))?;
    let weights = arguments.expected.weights(&compiled.names(), &palpate::evaluate::own_weights(&model))?;
    if arguments.features {
        if arguments.expected.is_given() && !arguments.add_up {
            return Err(Error::setting("features", "each row alone", "--only and --prior with --add-up only"));
        }
        let sequence = arguments.sequence_column.as_deref();
        let rows = super::recognize_rows::Asked { adds_up: arguments.add_up, sequence, json: global.json, weights };
        return super::recognize_rows::run(recognizer, &arguments.file, &rows)
            .map_err(|error| error.in_file(&arguments.model));
    }
    if model.descriptor().is_none() {
        return Err(of_model(raw_features()));
    }
    if arguments.next {
        let allowed = "it with a model of maps (palpate maps train); for a model with a plan, use --active";
        return Err(Error::setting("next", "given", allowed));
    }
    if arguments.active && model.plan().is_none() {
        return Err(of_model(no_plan()));
    }
    let longest = compile::longest(&model);
    let (active, json) = (arguments.active, global.json);
    let mut stream =
        Stream { recognizer, model: &model, weights, longest, active, json, touches: 0, is_any_partial: false };
    stream.reset();
    each_of(&arguments.file, &mut |event| stream.take(event))?;
    if model.trained_touches().counted != Counted::Full {
        super::warn_of_full(stream.touches, stream.is_any_partial);
    }
    Ok(())
}

/// A stream of touches and what recognizes them.
struct Stream<'m> {
    recognizer: Recognizer<'m, 256>,
    model: &'m Model<'m>,
    /// Frequencies of the objects, if they are not the model's.
    weights: Option<Vec<u32>>,
    /// The longest time between contacts that makes sense.
    longest: Longest,
    active: bool,
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
            self.model.plan().filter(|_| self.active && self.recognizer.verdict() == Verdict::Undecided)?.poses();
        let proposal = self.recognizer.next_approach(0..poses.count())?;
        Some(Entry::next(&ApproachMessage::new(proposal.pose, proposal.score, &poses.pose(proposal.pose)?)))
    }
}
