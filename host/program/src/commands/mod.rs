//! One file per command: its arguments, its help, and the call into the library.

/// Declares the enum that clap parses and the dispatch, from one list.
macro_rules! commands {
    ($($(#[$meta:meta])* $name:ident => $module:ident,)*) => {
        #[derive(clap::Subcommand)]
        enum Command {
            $($(#[$meta])* $name(Box<$module::Arguments>),)*
        }

        impl Command {
            fn run(self, global: &$crate::commands::Global) -> palpate::Result<()> {
                match self {
                    $(Self::$name(arguments) => $module::run(*arguments, global),)*
                }
            }
        }
    };
}

/// Declares a command that holds others, from their list.
macro_rules! group {
    ($($list:tt)*) => {
        commands! { $($list)* }

        #[derive(clap::Args)]
        #[command(arg_required_else_help = true, subcommand_required = true)]
        pub(crate) struct Arguments {
            #[command(subcommand)]
            command: Command,
        }

        pub(crate) fn run(arguments: Arguments, global: &$crate::commands::Global) -> palpate::Result<()> {
            arguments.command.run(global)
        }
    };
}

mod calibrate;
mod capture;
mod chips;
mod completions;
mod data;
mod evaluate;
mod expected;
mod export;
mod figures;
mod fit;
mod inspect;
mod keys;
mod kinds;
mod link;
mod maps;
mod measure;
mod numbers;
mod plan;
mod play;
mod probe;
mod progress;
mod prove;
mod real;
mod recognize;
mod recognize_lines;
mod report;
mod rows;
mod run;
mod scene;
mod shape;
mod shell;
mod strangers;
mod table;
mod teach;
mod thresholds;
mod train;
mod trees;
mod unstated;
mod verify;
mod view;
mod watch;

use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, FromArgMatches, Parser};
use palpate::error::{Kind, Place, problem};
use palpate::touches::{Dataset, Finding, Listing, Log};
use palpate::{Error, Result, output};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

commands! {
    /// Do all of it: capture, train, export, recognize, report
    Run => run,
    /// Touch objects with the virtual probe
    Capture => capture,
    /// Train an ensemble on captured touches
    Train => train,
    /// Compile an ensemble to the bytes that the chip reads
    Export => export,
    /// Set thresholds that keep an error rate
    Calibrate => calibrate,
    /// Add a plan of approaches to a model
    Plan => plan,
    /// Measure how often a model is right, and after how many touches
    Evaluate => evaluate,
    /// Compare a compiled model with what it was exported from
    Verify => verify,
    /// Recognize objects from a stream of touches
    Recognize => recognize,
    /// Calibrate, evaluate and recognize on rows of features
    Rows => rows,
    /// Find objects on a table: train, calibrate, recognize, ...
    Maps => maps,
    /// Say what is in a compiled model, and what it costs on a chip
    Inspect => inspect,
    /// Remake the whole evaluation, with every figure
    Report => report,
    /// Recognize on a chip at the end of a line
    Link => link,
    /// Make a page that shows a chip at a serial port
    Watch => watch,
    /// Show an object on a page
    View => view,
    /// Make a page on which objects are touched and recognized
    Play => play,
    /// Check and record data sets of touches; write built-in objects
    Data => data,
    /// Measure how your probe differs from the ideal
    Probe => measure,
    /// Print a script that completes this program's commands and options in a shell
    #[command(hide = true)]
    Completions => completions,
}

/// Recognize objects by touch: virtual touches, boosted trees, a compiled model for a microcontroller.
#[derive(Parser)]
#[command(
    name = "palpate",
    version,
    about,
    max_term_width = 120,
    arg_required_else_help = true,
    subcommand_required = true,
    help_template = "{about-with-newline}\n{usage-heading} {usage}{after-help}"
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    global: Global,
}

/// Options that every command takes.
#[derive(clap::Args, Clone, Debug, Default)]
#[command(next_help_heading = "Global options")]
pub(crate) struct Global {
    /// Print the result, or the error, as JSON
    #[arg(long, global = true)]
    json: bool,
    /// Threads [default: all]; results do not depend on them
    #[arg(long, global = true, value_name = "N", value_parser = threads)]
    threads: Option<usize>,
    /// Seed of all that is random [default: 1]
    #[arg(long, global = true, value_name = "N", value_parser = numbers::count)]
    seed: Option<u64>,
    /// Print neither progress nor remarks
    #[arg(long, global = true)]
    quiet: bool,
    /// Replace what a directory holds
    #[arg(long, global = true)]
    force: bool,
}

impl Global {
    /// The seed, or 1.
    fn seed(&self) -> u64 {
        self.seed.unwrap_or(1)
    }

    /// Prints a result as JSON or as text.
    fn print(&self, result: &impl serde::Serialize, text: impl FnOnce() -> String) -> Result<()> {
        if self.json { output::print_json(result) } else { output::print(&text()) }
    }

    /// Prints a result and what was written to `path`, as [`output::print_about`].
    fn print_about(&self, path: &Path, result: &impl serde::Serialize, text: impl FnOnce() -> String) -> Result<()> {
        if self.json { output::print_json_about(path, result) } else { output::print_about(path, &text()) }
    }

    /// Writes a page, and prints where it is.
    fn write_page(&self, path: &Path, html: &str) -> Result<()> {
        output::write_bytes(path, html.as_bytes())?;
        let text = || format!("{}: open it in a browser\n", path.display());
        self.print_about(path, &serde_json::json!({ "page": path }), text)
    }

    /// Makes the options count that concern the whole process.
    fn apply(&self) -> Result<()> {
        QUIET.store(self.quiet, Ordering::Relaxed);
        // More are of no use, and cost memory.
        let Some(asked) = self.threads.map(|asked| asked.min(MOST_THREADS)) else { return Ok(()) };
        let built = rayon::ThreadPoolBuilder::new().num_threads(asked).build_global();
        built.map_err(|error| {
            problem!("the system started only 0 of {asked} threads ({error})").fix("Use fewer threads. See --threads.")
        })
    }
}

/// The most threads that are started.
const MOST_THREADS: usize = 256;

fn threads(text: &str) -> Result<usize, String> {
    match numbers::count(text)? {
        0 => Err("give 1 or more".to_owned()),
        count => usize::try_from(count).map_err(|_| "give fewer".to_owned()),
    }
}

/// True if `--quiet` is given.
static QUIET: AtomicBool = AtomicBool::new(false);

/// True if neither progress nor remarks are printed.
fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Prints a line of JSON.
fn print_line(line: &impl serde::Serialize) -> Result<()> {
    // Numbers and strings are always JSON.
    output::print(&format!("{}\n", serde_json::to_string(line).unwrap_or_default()))
}

/// Prints a remark to stderr, unless `--quiet` is given.
fn remark(text: &str) {
    if !is_quiet() {
        eprintln!("{text}");
    }
}

/// The commands as the program's help lists them.
const GROUPS: [(&str, &[&str]); 6] = [
    ("Everything at once", &["run", "report"]),
    ("Step by step", &["capture", "train", "export", "calibrate", "plan", "evaluate", "recognize"]),
    ("A real probe", &["probe fit", "data record", "data check", "link", "watch"]),
    ("Objects on a table", &["maps"]),
    ("Models from elsewhere", &["export", "verify", "rows"]),
    ("Look", &["inspect", "view", "play", "data objects"]),
];

/// The command of this path, such as `data check`.
fn at<'c>(cli: &'c clap::Command, path: &str) -> Option<&'c clap::Command> {
    path.split(' ').try_fold(cli, |command, name| command.find_subcommand(name))
}

/// The commands in their groups, the global options and examples.
fn overview(cli: &clap::Command) -> String {
    let mut text = String::new();
    for (title, paths) in GROUPS {
        text += &format!("\n{title}:\n");
        for path in paths {
            let about = at(cli, path).and_then(clap::Command::get_about).map(ToString::to_string).unwrap_or_default();
            text += &format!("  {path:14}{about}\n");
        }
    }
    text.trim_start().to_owned()
        + "
Global options:
  --json         Print the result, or the error, as JSON
  --threads <N>  Threads; results do not depend on them
  --seed <N>     Seed of all that is random
  --quiet        Print neither progress nor remarks
  --force        Replace what a directory holds
  --help         Print help; `palpate help capture`, with examples
  --version      Print the version

Examples:
  palpate run                 capture, train and recognize built-in objects
  palpate run meshes/ -o out  the same for your own meshes

More:
  docs/reference/words.md    the words of the output
  docs/reference/options.md  what options take, and how commands work"
}

/// True if a command, or one below it, has an option.
fn has_option(command: &str, option: &str) -> bool {
    cli().find_subcommand(command).is_some_and(|command| {
        let all = std::iter::once(command).chain(command.get_subcommands());
        all.flat_map(clap::Command::get_arguments).any(|argument| argument.get_long() == Some(option))
    })
}

/// Addition to an error with which `command` ends: its options that help.
fn hint(error: &Error, command: &str) -> Option<String> {
    let has = |option: &str| has_option(command, option);
    let said = match error.kind() {
        Kind::Unread if has("skip-bad") => "--skip-bad continues without what cannot be read.",
        Kind::SameName { first, second }
            if has("instances") && first.parent() != second.parent() && first.file_stem() == second.file_stem() =>
        {
            "If each directory is one object, --instances takes it as such, called like the directory. If they hold two versions of \
             the same parts, such as visual and collision, give one of them."
        }
        _ => return capture::hint(error, &has),
    };
    Some(said.into())
}

/// The program's commands and arguments.
fn cli() -> clap::Command {
    let cli = Cli::command();
    let overview = overview(&cli);
    with_negative_numbers(with_unwrapped_help(cli)).after_help(overview)
}

/// A command whose values may begin with a minus sign: those that have to be above 0 are refused as what they are.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let allowed = |argument: clap::Arg| {
        let takes_values = argument.get_action().takes_values();
        argument.allow_negative_numbers(takes_values)
    };
    command.mut_args(allowed).mut_subcommands(with_negative_numbers)
}

/// A command whose help below the options is wrapped to the terminal's width, and that of the commands below it.
fn with_unwrapped_help(command: clap::Command) -> clap::Command {
    let command = command.mut_subcommands(with_unwrapped_help);
    match command.get_after_help().map(|text| unwrapped(&text.to_string())) {
        Some(text) => command.after_help(text),
        None => command,
    }
}

/// Joins the lines of each paragraph, so that they can be wrapped to the terminal's width. Indented lines stay as they are.
fn unwrapped(text: &str) -> String {
    let mut unwrapped = String::new();
    let mut joins = false;
    for line in text.lines() {
        let is_prose = !line.is_empty() && !line.starts_with(' ');
        if !unwrapped.is_empty() {
            unwrapped.push(if joins && is_prose { ' ' } else { '\n' });
        }
        unwrapped.push_str(line);
        joins = is_prose;
    }
    unwrapped
}

/// Runs the command that the arguments name, prints its error if it has one, and returns the exit code.
pub fn main() -> ExitCode {
    let matches = cli().try_get_matches().unwrap_or_else(|error| {
        let words: Vec<String> = std::env::args().skip(1).collect();
        let error = with_instead(without_trailing(without_help(&words).unwrap_or(error)), &words);
        if error.use_stderr() && words.iter().any(|word| word == "--json") {
            _ = output::print_json(&serde_json::json!({ "error": error.to_string().trim_end() }));
        }
        error.exit()
    });
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    match cli.global.apply().and_then(|()| cli.command.run(&cli.global)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            if !error.is(&Kind::Closed) {
                let command = matches.subcommand_name().unwrap_or_default();
                let text = message(&error, command);
                // Programs that read results find the error where those would be. If there are some, the exit code tells.
                if cli.global.json && !output::has_printed() {
                    _ = output::print_json(&serde_json::json!({ "error": text }));
                }
                eprintln!("palpate: {text}");
                if let Some(hint) = hint(&error, command) {
                    eprintln!("{hint}");
                }
            }
            ExitCode::from(error.exit_code())
        }
    }
}

/// The error about a command that `palpate help` was asked for: the parser suggests similar names of commands that are to be
/// run alone.
fn without_help(words: &[String]) -> Option<clap::Error> {
    let (first, named) = words.split_first()?;
    let error = cli().try_get_matches_from(std::iter::once("palpate").chain(named.iter().map(String::as_str))).err()?;
    (first == "help" && error.kind() == clap::error::ErrorKind::InvalidSubcommand).then_some(error)
}

/// The error without the advice to give an option that does not exist as a value: no file or object begins with a dash.
fn without_trailing(mut error: clap::Error) -> clap::Error {
    if let Some(ContextValue::StyledStrs(advice)) = error.remove(ContextKind::Suggested) {
        let others: Vec<_> = advice.into_iter().filter(|advice| !advice.to_string().starts_with("to pass ")).collect();
        if !others.is_empty() {
            error.insert(ContextKind::Suggested, ContextValue::StyledStrs(others));
        }
    }
    error
}

/// The error with what to use instead, if it is about a command, an option or a value that an earlier version had.
fn with_instead(mut error: clap::Error, words: &[String]) -> clap::Error {
    let text = |kind| match error.get(kind) {
        // An option is followed by the name of its value.
        Some(ContextValue::String(text)) => Some(text.split([' ', '=']).next().unwrap_or_default()),
        _ => None,
    };
    let argument = text(ContextKind::InvalidArg);
    let mut gone = match (argument, text(ContextKind::InvalidValue), text(ContextKind::InvalidSubcommand)) {
        (Some(option), Some(value), _) => format!("{option} {value}"),
        (Some(option), ..) if option.starts_with('-') => option.into(),
        (Some(_), ..) if words.starts_with(&["data".into(), "check".into()]) => "data check A B".into(),
        (.., Some(command)) => {
            let above = words.iter().take_while(|word| *word != command).filter(|word| !word.starts_with('-'));
            above.map(String::as_str).chain([command]).collect::<Vec<_>>().join(" ")
        }
        _ => return error,
    };
    // An option that another command still has.
    let command = words.iter().find(|word| !word.starts_with('-')).map_or("", String::as_str);
    if palpate::gone::instead(&format!("{command} {gone}")).is_some() {
        gone = format!("{command} {gone}");
    }
    if let Some(instead) = palpate::gone::instead(&gone) {
        let advice = format!("`{gone}` was removed: {instead}").into();
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![advice]));
        // These suggest a similar name, which is another thing.
        for kind in [ContextKind::SuggestedArg, ContextKind::SuggestedSubcommand, ContextKind::SuggestedValue] {
            error.remove(kind);
        }
    }
    error
}

/// The error as the user of `command` understands it: where the library names a setting, this names the option.
fn message(error: &Error, command: &str) -> String {
    let Kind::Setting { name, value, .. } = error.kind() else {
        return error.to_string();
    };
    let option = option_of(name, command).replace('_', "-");
    let cli = cli();
    // The command's own options, those of the commands below it, and the global ones.
    let named = cli.find_subcommand(command).into_iter();
    let mut arguments = named
        .flat_map(|command| std::iter::once(command).chain(command.get_subcommands()))
        .chain([&cli])
        .flat_map(|command| command.get_arguments());
    if arguments.any(|argument| argument.get_long() == Some(&option)) {
        return format!("{}--{option} is {value}. {}", error.place(), error.remedy());
    }
    error.to_string()
}

/// The option of `command` for a setting that the library calls otherwise.
fn option_of<'s>(setting: &'s str, command: &str) -> &'s str {
    match (setting, command) {
        ("groups", _) => "sequences",
        ("max_touches", "rows") => "max_rows",
        ("scales", _) => "scale",
        (other, _) => other,
    }
}

/// Reads a data set; its warnings go to stderr.
fn dataset(directory: &Path) -> Result<Dataset> {
    Dataset::read(directory).map(checked)
}

/// True if the touches have positions, all of them or none.
fn is_located(dataset: &Dataset) -> bool {
    dataset.touches().next().is_some_and(|touch| touch.position().is_some())
}

/// Refuses touches with a position, for a model of trees.
fn refuse_located(dataset: &Dataset, directory: &Path) -> Result<()> {
    if is_located(dataset) { Err(located().at(Place::file(directory))) } else { Ok(()) }
}

/// The problem of touches with a position for a model of trees.
fn located() -> Error {
    problem!("touches with a position, which a model of trees does not use")
        .fix("Make maps of them (`palpate maps train --teach`), or leave the positions out.")
}

/// A data set whose warnings went to stderr.
fn checked(dataset: Dataset) -> Dataset {
    dataset.warnings.iter().for_each(say);
    dataset
}

/// Says to stderr what looks wrong, or what was skipped.
fn say(finding: &Finding) {
    match finding.fix.is_empty() {
        true => remark(&format!("palpate: {finding}")),
        false => remark(&format!("palpate: warning: {finding}")),
    }
}

/// Below this many touches, all of them full is unremarkable.
const MANY: usize = 30;

/// Warns where a model to which it is evidence which fingers touch gets full touches alone: those that were left out speak
/// for other objects.
fn warn_of_full(touches: usize, is_any_partial: bool) {
    if touches >= MANY && !is_any_partial {
        remark(&format!(
            "palpate: warning: all {touches} touches are full, and to this model it is evidence which fingers touch: if others were left out, its verdicts are wrong. Keep every approach (palpate capture --approaches N), or train for full touches (palpate train --evidence full)."
        ));
    }
}

/// The files that a data set consists of, as far as they can be found: what a command that reads it must not write.
fn files_of(directory: &Path) -> Vec<PathBuf> {
    if directory.is_file() {
        return vec![directory.into()];
    }
    let is_touches = |path: &PathBuf| {
        let extension = path.extension().unwrap_or_default();
        path.file_name().is_some_and(|name| name == Listing::FILE) || extension == Log::EXTENSION || extension == "txt"
    };
    let entries = std::fs::read_dir(directory).into_iter().flatten().flatten();
    entries.map(|entry| entry.path()).filter(is_touches).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::{BTreeMap, BTreeSet};

    #[test]
    fn every_commands_arguments_are_consistent() {
        cli().debug_assert();
    }

    /// Every command that help lists, with its path: those that do something, not those that only hold others.
    fn listed() -> Vec<(String, clap::Command)> {
        fn below(command: &clap::Command, path: &str, found: &mut Vec<(String, clap::Command)>) {
            for own in command.get_subcommands().filter(|own| !own.is_hide_set() && own.get_name() != "help") {
                let path = format!("{path} {}", own.get_name()).trim_start().to_owned();
                if own.has_subcommands() { below(own, &path, found) } else { found.push((path, own.clone())) }
            }
        }
        let mut cli = cli();
        cli.build();
        let mut found = Vec::new();
        below(&cli, "", &mut found);
        found
    }

    /// The options of a command that its help shows, without `--help`.
    fn options(command: &clap::Command) -> impl Iterator<Item = &clap::Arg> {
        command.get_arguments().filter(|own| own.get_long().is_some_and(|name| name != "help") && !own.is_hide_set())
    }

    #[test]
    fn every_command_takes_the_global_options() {
        for (path, command) in listed() {
            let global: BTreeSet<&str> =
                options(&command).filter(|own| own.is_global_set()).filter_map(clap::Arg::get_long).collect();
            assert_eq!(global, BTreeSet::from(["force", "json", "quiet", "seed", "threads"]), "{path}");
        }
    }

    /// Meaning of an option: its name for values, its kind, and its help up to the first semicolon or bracket.
    fn meaning(option: &clap::Arg) -> String {
        let help = option.get_help().map(ToString::to_string).unwrap_or_default();
        let first = help.split(['[', ';']).next().unwrap_or_default().trim().to_owned();
        let names: Vec<&str> =
            option.get_value_names().unwrap_or_default().iter().map(clap::builder::Str::as_str).collect();
        format!("{} {:?} {:?}: {first}", names.join(" "), option.get_action(), option.get_num_args())
    }

    #[test]
    fn an_option_means_the_same_in_every_command() {
        let mut meanings: BTreeMap<String, BTreeMap<String, Vec<String>>> = BTreeMap::new();
        for (path, command) in listed() {
            for option in options(&command) {
                let name = option.get_long().unwrap_or_default().to_owned();
                meanings.entry(name).or_default().entry(meaning(option)).or_default().push(path.clone());
            }
        }
        let several: Vec<String> =
            meanings.iter().filter(|(_, own)| own.len() > 1).map(|(name, own)| format!("--{name}: {own:#?}")).collect();
        assert!(several.is_empty(), "{}", several.join("\n"));
    }

    #[test]
    fn the_groups_of_help_name_every_command_that_is_listed_or_the_one_that_holds_it() {
        let shown: BTreeSet<&str> = GROUPS.iter().flat_map(|(_, paths)| paths.iter().copied()).collect();
        let listed: Vec<String> = listed().into_iter().map(|(path, _)| path).collect();
        let is_shown = |path: &String| {
            shown.contains(path.as_str()) || path.split_once(' ').is_some_and(|(above, _)| shown.contains(above))
        };
        assert!(listed.iter().all(is_shown), "{listed:?}");
        assert!(shown.iter().all(|path| at(&cli(), path).is_some()));
        let overview = overview(&Cli::command());
        assert!(overview.lines().all(|line| line.chars().count() <= 80), "{overview}");
    }

    #[test]
    fn paragraphs_of_help_are_joined_and_lists_are_not() {
        let text = "One\ntwo.\n\nExamples:\n  palpate run\n  palpate view\n\nThree\nfour.";
        assert_eq!(unwrapped(text), "One two.\n\nExamples:\n  palpate run\n  palpate view\n\nThree four.");
    }

    #[test]
    fn an_unknown_option_is_not_said_to_be_a_value() {
        for words in [&["palpate", "report", "--touches", "5"][..], &["palpate", "view", "bowl", "--touch", "5"]] {
            let error = without_trailing(cli().try_get_matches_from(words).unwrap_err()).to_string();
            assert!(error.contains("unexpected argument") && !error.contains("-- --touch"), "{error}");
        }
        // The option that may have been meant is still named.
        let error = cli().try_get_matches_from(["palpate", "view", "bowl", "--touch", "5"]).unwrap_err();
        assert!(without_trailing(error).to_string().contains("--touches"));
    }

    #[test]
    fn a_setting_out_of_range_is_shown_with_its_options_name() {
        let error = Error::setting("max_touches", 0, "1 to 1000");
        assert_eq!(message(&error, "recognize"), "--max-touches is 0. Use 1 to 1000.");
        assert_eq!(error.exit_code(), 2);
        let error = Error::setting("approaches", 9, "more");
        assert_eq!(message(&error, "probe"), "--approaches is 9. Use more.");
        let error = Error::setting("max_touches", 0, "1 to 1000");
        // No option of this name, and no command: the setting's own name.
        assert_eq!(message(&error, "view"), "max_touches is 0. Use 1 to 1000.");
        assert_eq!(message(&error, ""), "max_touches is 0. Use 1 to 1000.");
        let error = Error::setting("seed", "x", "a number").in_file("probe.json");
        assert_eq!(message(&error, "run"), "probe.json: --seed is x. Use a number.");
    }
}
