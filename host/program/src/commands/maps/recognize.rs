//! `palpate maps recognize`: objects with their place on a table.

use crate::commands::expected::ExpectedArguments;
use crate::commands::numbers::error_rate;
use crate::commands::recognize_lines::{Event, Line, each_of};
use crate::commands::{Global, kinds, print_line};
use palpate::error::Kind;
use palpate::locate::{self, Approach, Hand, Locating, Maps, POSE, Pose};
use palpate::{Error, Result, compile};
use palpate_onboard::Verdict;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Each line in is a touch with the hand's position, straight down: twelve columns. Each line out is the verdict so far; with --next it is a JSON object with the place and the next approach, so that a robot's program can close the loop. After a verdict, and after an empty line, the next touch is the first of another object. The first approach to each object is at x = y = 0, with the row in any direction. FILE may be a robot's log (MCAP) as well.

Examples:
  robot | palpate maps recognize maps.palpate --next
  palpate maps recognize maps.palpate touches.txt --only bowl,mug")]
pub(super) struct Arguments {
    /// Model of maps
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
    /// Keep the middle finger this close to the table's origin, in x and y [default: twice the maps' range]
    #[arg(long, value_name = "MM", requires = "next")]
    workspace: Option<f64>,
    #[command(flatten)]
    expected: ExpectedArguments,
}

/// Verdict and place after a touch.
#[derive(serde::Serialize)]
struct Located<'m> {
    #[serde(flatten)]
    line: Line<'m>,
    placement: &'m str,
    /// The most likely pose, if a touch was counted.
    pose: Option<Mode<'m>>,
    /// Others of this object.
    modes: Vec<Mode<'m>>,
    /// Next approach; none after a verdict.
    next: Option<Next>,
}

/// A pose, with half-widths of 95 % intervals. Lengths are in millimeters, angles in degrees.
#[derive(serde::Serialize)]
struct Mode<'m> {
    placement: &'m str,
    x: f64,
    y: f64,
    /// Null for a placement that looks the same from all sides.
    yaw: Option<f64>,
    x_within: f64,
    y_within: f64,
    yaw_within: Option<f64>,
    /// Share of the object's posterior.
    share: f64,
}

/// An approach straight down: the place of the middle finger in millimeters, and the row's angle from the x axis in degrees.
#[derive(serde::Serialize)]
pub(in crate::commands) struct Next {
    x: f64,
    y: f64,
    roll: f64,
}

fn millimeters(micrometers: i32) -> f64 {
    f64::from(micrometers) / 1e3
}

/// Degrees of 1/65,536 turns, in hundredths.
fn degrees(turn: u16) -> f64 {
    (f64::from(turn) / 65_536.0 * 36_000.0).round() / 100.0
}

impl<'m> Mode<'m> {
    fn of(placement: &'m str, pose: Pose) -> Self {
        let [x, y] = pose.position.map(millimeters);
        let [x_within, y_within] = pose.within.map(|within| f64::from(within) / 1e3);
        Self {
            placement,
            x,
            y,
            yaw: pose.yaw_within.map(|_| degrees(pose.yaw)),
            x_within,
            y_within,
            yaw_within: pose.yaw_within.map(degrees),
            share: (f64::from(pose.share) / 65.536).round() / 1e3,
        }
    }
}

impl From<Approach> for Next {
    fn from(Approach { x, y, roll }: Approach) -> Self {
        let degrees = f64::from(roll) / 256.0 * 360.0;
        Self { x: millimeters(x), y: millimeters(y), roll: (degrees * 100.0).round() / 100.0 }
    }
}

/// Prints verdict, place and next approach after a touch, of placements with these names.
pub(in crate::commands) fn print_located<'m>(
    line: Line<'m>,
    poses: Vec<Pose>,
    next: Option<Approach>,
    name: impl Fn(u8) -> &'m str,
) -> Result<()> {
    let mut modes = poses.into_iter().map(|pose| Mode::of(name(pose.placement), pose)).collect::<Vec<_>>().into_iter();
    let pose = modes.next();
    let placement = pose.as_ref().map_or("", |pose| pose.placement);
    let located = Located { line, placement, pose, modes: modes.collect(), next: next.map(Next::from) };
    print_line(&located)
}

pub(super) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let file = kinds::maps(&arguments.model, "recognize")?;
    let maps = file.maps();
    let own = maps.stopping();
    let max_touches = arguments.max_touches.unwrap_or(own.max_touches());
    if !(1..=locate::TOUCHES as u32).contains(&max_touches) {
        return Err(Error::setting("max_touches", max_touches, format!("1 to {}", locate::TOUCHES)));
    }
    let stopping = match arguments.error_rate {
        Some(rate) => compile::stopping(rate, max_touches)?,
        None => own.with_max_touches(max_touches),
    };
    let names = locate::names(&maps);
    let weights = arguments.expected.weights(&names, &vec![1.0; names.len()])?;
    let hand = Hand::of(&maps).ok_or_else(locate::no_hand)?;
    let within = locate::workspace(&maps, arguments.workspace)?;
    let mut stream = Stream {
        maps,
        hand,
        locating: locate::locating(maps, stopping, None),
        weights,
        within: arguments.next.then_some(within),
        json: global.json,
        seed: u32::try_from(global.seed()).unwrap_or(1),
        touches: 0,
    };
    stream.begin();
    each_of(&arguments.file, &mut |event| stream.take(event))
}

/// A stream of touches and what locates by them.
struct Stream<'m> {
    maps: Maps<'m>,
    hand: Hand,
    locating: Box<dyn Locating + 'm>,
    weights: Option<Vec<u32>>,
    /// Workspace of the next approach, where that is asked for.
    within: Option<u32>,
    json: bool,
    seed: u32,
    touches: u32,
}

impl Stream<'_> {
    /// Begins another object.
    fn begin(&mut self) {
        self.touches = 0;
        self.locating.begin(self.seed);
        if let Some(weights) = &self.weights {
            self.locating.begin_of(weights);
        }
    }

    fn take(&mut self, event: Event<'_>) -> Result<()> {
        let Event::Touch { touch, place } = event else {
            self.begin();
            return Ok(());
        };
        let refused = match locate::seen(&self.hand, touch) {
            Ok(seen) => {
                self.touches += 1;
                self.locating.push(seen);
                None
            }
            Err(aslant) if aslant.is(&Kind::NotDown) => Some(aslant.what().to_owned()),
            Err(error) => return Err(error.at(place)),
        };
        self.print(refused)?;
        if self.locating.verdict() != Verdict::Undecided {
            self.begin();
        }
        Ok(())
    }

    fn print(&mut self, refused: Option<String>) -> Result<()> {
        let best = self.locating.best();
        let verdict = self.locating.verdict();
        let posterior = self.locating.posteriors().get(best).copied().unwrap_or(0.0);
        let line = Line {
            touch: self.touches,
            verdict: verdict.name(),
            object: if self.touches == 0 { "" } else { self.maps.object_name(best) },
            posterior,
            refused,
            table_alone: matches!(verdict, Verdict::Unknown | Verdict::GaveUp) && self.locating.met_table_alone(),
            exhausted: self.locating.is_exhausted(),
            next: None,
        };
        let Some(within) = self.within else { return line.print(self.json) };
        let poses = if self.touches == 0 { Vec::new() } else { self.locating.poses(best) };
        let next = (verdict == Verdict::Undecided).then(|| self.locating.choose(&self.hand, within, POSE));
        print_located(line, poses, next, |placement| self.maps.placement_name(placement))
    }
}
