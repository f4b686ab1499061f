//! Names that commands and options had before version 0.3, and what they are called now.

use clap::error::{ContextKind, ContextValue, ErrorKind};

/// A command or an option that has another name now.
struct Renamed {
    /// The command that had the option, `*` for all of them; the old path for a command.
    command: &'static str,
    /// The option with its dashes; empty for a command.
    option: &'static str,
    /// Name to write instead.
    now: &'static str,
}

const fn command(command: &'static str, now: &'static str) -> Renamed {
    Renamed { command, option: "", now }
}

const fn option(command: &'static str, option: &'static str, now: &'static str) -> Renamed {
    Renamed { command, option, now }
}

/// Every name that is gone. docs/reference/renamed.md has the same table.
const RENAMED: &[Renamed] = &[
    command("objects", "palpate data objects"),
    command("cast", "palpate data cast"),
    command("data compare", "palpate data check RECORDED SIMULATED"),
    command("play", "palpate view --play"),
    command("plan", "palpate calibrate MODEL DIR -o FILE --plan ROLLS"),
    command("parity", "palpate verify MODEL ENSEMBLE DIR, the model first"),
    command("watch", "palpate link PORT --watch"),
    option("*", "--noise", "--real noise=0..5ms"),
    option("*", "--timer", "--real timer=1ms"),
    option("*", "--debounce", "--real debounce=2ms"),
    option("*", "--missed", "--real missed=2%"),
    option("*", "--bent", "--real bent=3ms/0ms/0ms, a value for each finger"),
    option("*", "--speed-error", "--real speed_error=5%"),
    option("*", "--speed-bias", "--real speed_bias=5%"),
    option("*", "--pose-noise", "--real pose_noise=5deg"),
    option("*", "--pose-bias", "--real pose_bias=5deg"),
    option("*", "--unit", "--true-size mm, which takes the unit itself"),
    option("run", "--out", "--output"),
    option("data objects", "--only", "palpate data objects NAME -o DIR: objects are arguments"),
    option("capture", "--radius", "--probe FILE: a probe file states radius, spacing, speed and tilt"),
    option("capture", "--spacing", "--probe FILE: a probe file states radius, spacing, speed and tilt"),
    option("capture", "--speed", "--probe FILE: a probe file states radius, spacing, speed and tilt"),
    option("capture", "--tilt", "--probe FILE: a probe file states radius, spacing, speed and tilt"),
    option("view", "--radius", "--probe FILE: a probe file states radius, spacing, speed and tilt"),
    option("view", "--spacing", "--probe FILE: a probe file states radius, spacing, speed and tilt"),
    option("view", "--length", "--probe FILE with smaller or larger fingers"),
    option("train", "--touches", "--evidence full, contacts or all"),
    option("train", "--leaves", "--trees leaves=each or leaves=one"),
    option("train", "--rounds", "--trees rounds=30"),
    option("train", "--depth", "--trees depth=6"),
    option("train", "--eta", "--trees eta=0.3"),
    option("train", "--min-child-weight", "--trees min_child_weight=30"),
    option("train", "--bins", "--trees bins=256, or bins=64/16 for each feature"),
    option("train", "--leaf-bits", "--trees leaf_bits=16"),
    option("train", "--different-leaves", "--trees different_leaves=128"),
    option("train", "--threshold-cost", "--trees different_leaves=128,threshold_cost=2e-5"),
    option("train", "--trainer", "--trees trainer=palpate or trainer=xgboost"),
    option("export", "--for", "--layout balanced, speed, size, m4f or m0+"),
    option("export", "--fit-scales", "--scale ROWS.csv"),
    option("evaluate", "--strangers", "--unknown DIR"),
    option("evaluate", "--groups", "--sequences"),
    option("tune", "--groups", "--sequences"),
    option("probe design", "--spacing", "--search spacing=1..2"),
    option("probe design", "--radius", "--search radius=0.1..0.3"),
    option("probe design", "--tilt", "--search tilt=0..20"),
    option("probe design", "--aim", "--search aim=box+middle+mass"),
    option("probe design", "--speed", "--search speed=10"),
    option("probe design", "--touches", "--evidence full, contacts or all"),
    option("link", "--record", "palpate data record PORT -o DIR --object NAME"),
    option("link", "--object", "palpate data record PORT -o DIR --object NAME"),
    option("link", "--probe", "palpate data record PORT -o DIR --object NAME --probe FILE"),
    option("link", "--pose", "palpate data record PORT -o DIR --object NAME --pose"),
    option("link", "--model", "--against FILE"),
    option("link", "--sequence", "--per-object"),
    option("link", "--touches", "--stop-after"),
];

/// Options that take a value now, and did not: what the value is.
const WITH_VALUE: &[(&str, &str)] = &[
    ("--approaches", "their number, such as --approaches 60000, which --touches is not given beside"),
    ("--true-size", "a unit such as --true-size mm, or --true-size stated where all meshes state theirs"),
];

/// Answer to an error that comes from an old name; nothing for any other.
pub(super) fn said(words: &[String], error: &clap::Error) -> Option<String> {
    let context = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.clone()),
        _ => None,
    };
    let path = path(words);
    match error.kind() {
        ErrorKind::InvalidSubcommand => {
            let name = context(ContextKind::InvalidSubcommand)?;
            let old = if path.is_empty() { name } else { format!("{path} {name}") };
            let found = RENAMED.iter().find(|renamed| renamed.option.is_empty() && renamed.command == old)?;
            Some(format!("palpate {old} has another name now. Use {}.", found.now))
        }
        ErrorKind::UnknownArgument => {
            let given = context(ContextKind::InvalidArg)?;
            let name = given.split([' ', '=']).next()?;
            let is_it = |renamed: &&Renamed| renamed.option == name && [path.as_str(), "*"].contains(&renamed.command);
            let found = RENAMED.iter().find(is_it)?;
            Some(format!("palpate {path} {name} has another name now. Use {}.", found.now))
        }
        ErrorKind::InvalidValue => {
            let is_missing = context(ContextKind::InvalidValue).is_none_or(|value| value.is_empty());
            let given = context(ContextKind::InvalidArg)?;
            let name = given.split([' ', '=']).next()?;
            let (name, value) = WITH_VALUE.iter().find(|(option, _)| *option == name).filter(|_| is_missing)?;
            Some(format!("palpate {path} {name} takes a value now: {value}."))
        }
        _ => None,
    }
}

/// The path of the command that words name, such as `data check`.
fn path(words: &[String]) -> String {
    let cli = super::cli();
    let (mut command, mut path) = (&cli, Vec::new());
    let mut words = words.iter();
    while let Some(word) = words.next() {
        if word.starts_with('-') {
            // Global options may stand before the command; two of them have values.
            if ["--seed", "--threads"].contains(&word.as_str()) {
                words.next();
            }
            continue;
        }
        let Some(found) = command.find_subcommand(word) else { break };
        path.push(word.as_str());
        command = found;
    }
    path.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::commands::{at, cli};

    fn said_to(words: &[&str]) -> Option<String> {
        let error = cli().try_get_matches_from([&["palpate"], words].concat()).err()?;
        said(&words.iter().map(ToString::to_string).collect::<Vec<_>>(), &error)
    }

    #[test]
    fn every_old_name_is_answered_with_the_new_one() {
        for Renamed { command, option, now } in RENAMED {
            let command = if *command == "*" { "evaluate" } else { command };
            let mut words: Vec<&str> = command.split(' ').collect();
            if !option.is_empty() {
                words.extend([*option, "5"]);
            }
            let said = said_to(&words).unwrap_or_else(|| panic!("{words:?}"));
            assert!(said.ends_with(&format!("Use {now}.")), "{said}");
        }
        for (words, expected) in [
            (&["capture", "bowl", "-o", "data", "--approaches", "--touches", "500"][..], "--approaches 60000"),
            (&["capture", "bowl", "-o", "data", "--approaches"], "--approaches 60000"),
            (&["run", "--true-size", "--unit", "mm"], "--true-size mm"),
            (&["evaluate", "m", "d", "--noise=5ms"], "--real noise="),
            (&["parity", "e.json", "m.palpate", "data"], "palpate verify"),
            (&["--seed", "3", "data", "compare", "a", "b"], "palpate data check"),
        ] {
            let said = said_to(words).unwrap_or_else(|| panic!("{words:?}"));
            assert!(said.contains(expected), "{said}");
        }
    }

    #[test]
    fn no_old_name_exists_and_every_new_one_does() {
        let cli = cli();
        for Renamed { command, option, now } in RENAMED {
            let old = at(&cli, command);
            if option.is_empty() {
                assert!(old.is_none(), "{command}");
            } else if let Some(old) = old {
                assert!(
                    old.get_arguments().all(|own| own.get_long() != option.strip_prefix("--")),
                    "{command} {option}"
                );
            }
            // A path of commands, where the new name is one; else the same command.
            let path: Vec<&str> = match now.strip_prefix("palpate ") {
                Some(words) => {
                    words.split(' ').take_while(|word| word.chars().all(|c| c.is_ascii_lowercase())).collect()
                }
                None if *command == "*" => vec!["evaluate"],
                None => command.split(' ').collect(),
            };
            let path = if now.contains("--true-size") { vec!["run"] } else { path };
            let new = at(&cli, &path.join(" ")).unwrap_or_else(|| panic!("{now}: {path:?}"));
            for word in now.split([' ', ':', ',']).filter(|word| word.starts_with("--")) {
                let name = word.strip_prefix("--");
                assert!(new.get_arguments().any(|own| own.get_long() == name), "{now}: {word}");
            }
        }
    }

    #[test]
    fn the_table_in_the_documentation_has_every_old_name() {
        let table = include_str!("../../../../docs/reference/renamed.md");
        for Renamed { command, option, .. } in RENAMED {
            let old = match (*command, *option) {
                (command, "") => format!("palpate {command}"),
                ("*", option) => option.to_owned(),
                (command, option) => format!("{command} {option}"),
            };
            assert!(table.contains(&format!("| `{old}` |")), "{old}");
        }
    }

    #[test]
    fn what_was_never_a_name_is_left_to_the_parser() {
        assert_eq!(said_to(&["evaluate", "m", "d", "--frobnicate"]), None);
        assert_eq!(said_to(&["frobnicate"]), None);
        assert_eq!(said_to(&["capture", "bowl", "-o", "d", "--touches", "many"]), None);
    }
}
