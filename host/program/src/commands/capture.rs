use super::keys::one_of;
use super::numbers;
use super::probe::{SizeArguments, refuse_unstated};
use super::progress::{Bar, cancel_when_interrupted};
use super::scene::{SceneArguments, described};
use super::{Global, remark};
use palpate::capture::{self, Settings, Summary};
use palpate::error::Kind;
use palpate::mesh::facts::Facts;
use palpate::mesh::{BACKGROUND, Object};
use palpate::output;
use palpate::probe::approach::Aim;
use palpate::results::{Results, Value};
use palpate::touches::{Origin, Samples};
use palpate::wording::{decimal, percent};
use palpate::{Error, Result, row, with};
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
The directory gets NAME.txt for each object, or NAME/1.txt, NAME/2.txt and so on for each of its instances or placements, one line per touch: three contact times in seconds after the first contact, `-` for a finger that never touched; dataset.json says how they were made. The directory appears when all is done; one that holds anything else is refused.

Examples:
  palpate capture builtin -o data                  21,000 touches per object
  palpate capture cup.stl bowls/ builtin -o data   your meshes beside them
  palpate capture meshes/ -o data --approaches 60000
                                                   also those that miss
  palpate capture meshes/ -o data --true-size mm --probe probe.toml
                                                   as large as they are
  palpate capture meshes/ -o data --instances      a directory for each object
  palpate capture meshes/ -o data --scene table    as they lie, from above
  palpate capture meshes/ -o part2 --samples 7000..14000
                                                   the second of three parts")]
pub(crate) struct Arguments {
    /// Objects: `builtin` or built-in objects' names, meshes (OBJ, STL, PLY, glTF, COLLADA), directories of them
    #[arg(value_name = "SOURCE", required = true)]
    sources: Vec<String>,
    /// Output; a directory for the touches
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Touches of each object; with all three fingers [default: 21000]
    #[arg(long, value_name = "N", value_parser = numbers::count, conflicts_with = "approaches")]
    touches: Option<u64>,
    /// Approaches to each object; all of them kept, also those that miss, instead of full touches
    #[arg(long, value_name = "N", value_parser = numbers::count)]
    approaches: Option<u64>,
    /// The longest side of each object's bounding box, in units [default: 10]
    #[arg(long, value_name = "UNITS", conflicts_with = "true_size")]
    length: Option<f64>,
    #[command(flatten)]
    size: SizeArguments,
    #[command(flatten)]
    scene: SceneArguments,
    /// Aim of approaches: box (the bounding box), middle or mass [default: box]
    #[arg(long, value_name = "WHERE", value_parser = aim)]
    aim: Option<Aim>,
    /// With the probe's direction and alignment
    #[arg(long)]
    pose: bool,
    /// Capture only these of each object's touches or approaches; the files of all parts, one after the other, are the whole's
    #[arg(long, value_name = "A..B", value_parser = parsed::<Samples>)]
    samples: Option<Samples>,
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    output::refuse_stdout(&arguments.output)?;
    let settings = with!(
        Settings::default(),
        origin = arguments.origin(global.seed)?,
        force = global.force,
        threads = global.threads
    );
    settings.check()?;
    let mut objects = arguments.size.objects(&arguments.sources, settings.origin.seed)?;
    arguments.scene.weights.weigh(&mut objects)?;
    let objects = arguments.size.touchable(objects, &settings.origin)?;
    // Shapes of the background are as they are meant to be.
    let has_background =
        arguments.sources.iter().any(|source| source == BACKGROUND) && !std::path::Path::new(BACKGROUND).exists();
    objects.iter().filter(|object| !has_background || object.name != BACKGROUND).for_each(complain);
    cancel_when_interrupted();
    let summary = capture::capture(&objects, &settings, &arguments.output, &Bar::new())?;
    if global.json {
        return output::print_json(&summary);
    }
    let text = table(&summary, settings.origin.approaches);
    let placements = if settings.origin.scene.is_floating() { String::new() } else { described(&objects)? };
    output::print(&(text + &unreached(&summary, &settings.origin) + &placements))
}

/// Says to stderr what is wrong with an object's meshes.
pub(super) fn complain(object: &Object) {
    for instance in object.instances() {
        let complaints = Facts::of(&instance.mesh).complaints(object.millimeters);
        if !complaints.is_empty() {
            let name = if instance.name == object.name { String::new() } else { format!(", {}", instance.name) };
            remark(&format!("{}{name}: {}", object.name, complaints.join(" ")));
        }
    }
}

/// Contacts that are missing because the hand had stopped, by finger, and why.
fn unreached(summary: &Summary, origin: &Origin) -> String {
    let approaches: u64 = summary.objects.iter().map(|object| object.approaches).sum();
    let share = |count: u64| percent(count as f64 / approaches.max(1) as f64, 1);
    let mut text = String::new();
    if let Some((stroke, window)) = origin.probe.stroke.zip(origin.probe.window()) {
        let [first, second, third] =
            [0, 1, 2].map(|finger: usize| share(summary.objects.iter().map(|object| object.late[finger]).sum()));
        text += &format!(
            "Missing since they came later than the stroke of {stroke} ({} s after the first contact): contacts of finger 1 in {first} \
             of the approaches, of finger 2 in {second}, of finger 3 in {third}.\n",
            decimal(f64::from(window) / 1e6, 3),
        );
    }
    if let Some(travel) = origin.probe.travel {
        text += &format!(
            "Missing since the object was farther away than the travel of {travel}: all contacts in {} of the approaches.\n",
            share(summary.objects.iter().map(|object| object.turned_back).sum())
        );
    }
    text
}

impl Arguments {
    /// Settings from the options; where they are open, the defaults.
    fn origin(&self, seed: Option<u64>) -> Result<Origin> {
        let base = self.size.origin(Origin::default())?;
        refuse_unstated(&self.size)?;
        Ok(Origin {
            touches: self.approaches.or(self.touches).unwrap_or(base.touches),
            seed: seed.unwrap_or(base.seed),
            length: self.length.unwrap_or(base.length),
            aim: self.aim.unwrap_or(base.aim),
            scene: self.scene.scene(base.scene)?,
            pose: self.pose,
            approaches: self.approaches.is_some(),
            samples: self.samples,
            real: self.size.probe.read()?.map_or(base.real, |file| file.real),
            ..base
        })
    }
}

pub(super) fn aim(name: &str) -> Result<Aim, String> {
    one_of(name, Aim::ALL.map(|aim| (aim.name(), aim)))
}

/// An option's value; what is wrong with it, with what to do.
fn parsed<T: std::str::FromStr<Err = Error>>(text: &str) -> Result<T, String> {
    text.parse().map_err(|error: Error| error.to_string())
}

/// Options that help where a capture is refused, of those that the command has.
pub(super) fn hint(error: &Error, has: &dyn Fn(&str) -> bool) -> Option<String> {
    match *error.kind() {
        Kind::Exists => Some("--force replaces the data set that is there; other files stay.".into()),
        Kind::Untouchable { is_true_size, .. } => {
            let size = if is_true_size { "--true-size" } else { "--length" };
            let options = [
                (has("approaches") && has("samples")).then_some("--approaches N keeps every approach."),
                has("skip-bad").then_some("--skip-bad leaves such objects out."),
            ];
            let options: String = options.into_iter().flatten().map(|option| format!("{option} ")).collect();
            Some(format!("{options}See also --probe and {size}."))
        }
        _ => None,
    }
}

/// Counts of a capture; where every approach was kept, those that touched anything are counted.
fn table(summary: &Summary, keeps_all: bool) -> String {
    let counted = if keeps_all { "touching" } else { "touches" };
    let mut rows = Results::new(["object", counted, "approaches", "share", "approaches/s"]);
    let mut push = |name: &str, touches: u64, approaches: u64, seconds: f64| {
        let share = Value::Percent(touches as f64 / approaches.max(1) as f64, 1);
        rows.push(row![name, touches, approaches, share, Value::Number(approaches as f64 / seconds, 0)]);
    };
    let touches = |object: &capture::ObjectSummary| if keeps_all { object.touching } else { object.touches };
    for object in &summary.objects {
        push(&object.name, touches(object), object.approaches, object.seconds);
    }
    push("all", summary.objects.iter().map(touches).sum(), summary.approaches(), summary.seconds);
    match keeps_all {
        true => {
            rows.text()
                + "Every approach was kept, also those that touched nothing: `palpate data check` counts which fingers touched.\n"
        }
        false => rows.text(),
    }
}
