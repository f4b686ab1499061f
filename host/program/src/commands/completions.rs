//! `palpate completions`: the parser's scripts, which also complete keys and values of options.

use super::{Global, maps, trees};
use clap_complete::Shell;
use palpate::Result;
use palpate::compile::{Language, Layout, Leaf};
use palpate::mesh::builtin;
use palpate::output::print;
use palpate::probe::noise::PartialNoise;
use palpate_shared::Descriptor;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate completions bash > ~/.local/share/bash-completion/completions/palpate
  palpate completions zsh > \"${fpath[1]}/_palpate\"
  palpate completions fish > ~/.config/fish/completions/palpate.fish")]
pub(crate) struct Arguments {
    /// The shell that will read the script
    shell: Shell,
}

pub(crate) fn run(arguments: Arguments, _: &Global) -> Result<()> {
    let mut script = Vec::new();
    let mut cli = super::cli();
    clap_complete::generate(arguments.shell, &mut cli, "palpate", &mut script);
    let script = String::from_utf8_lossy(&script);
    let script = completed(&script, arguments.shell);
    if arguments.shell != Shell::Fish {
        return print(&script);
    }
    // For fish the generator also offers what help does not list.
    let hidden: Vec<String> = hidden(&cli).iter().map(|name| format!("-a \"{name}\"")).collect();
    let lines = script.lines().filter(|line| !hidden.iter().any(|name| line.contains(name)));
    print(&lines.map(|line| format!("{line}\n")).collect::<String>())
}

/// The names of the commands that help does not list.
fn hidden(command: &clap::Command) -> Vec<&str> {
    let own = command.get_subcommands().filter(|own| own.is_hide_set()).map(clap::Command::get_name);
    own.chain(command.get_subcommands().flat_map(hidden)).collect()
}

/// The options, and the words of each: values, and keys with their `=`.
fn options() -> Vec<(&'static str, Vec<String>)> {
    let keys = |keys: Vec<&str>| keys.iter().map(|key| format!("{key}=")).collect();
    let values = |values: Vec<&str>| values.into_iter().map(String::from).collect();
    let goals = ["balanced", "speed", "size", "m4f", "m0+"];
    let sources = Language::ALL.map(Language::name).into_iter().chain(["c-code", "rust-code"]);
    vec![
        ("maps", keys(maps::keys().collect())),
        ("real", keys(PartialNoise::KEYS.into())),
        ("trees", keys(trees::keys().collect())),
        ("layout", values(Layout::ALL.iter().map(|layout| layout.name()).chain(goals).collect())),
        ("leaf", values(Leaf::ALL.iter().map(|leaf| leaf.name()).collect())),
        ("descriptor", values(Descriptor::ALL.iter().map(|descriptor| descriptor.name()).collect())),
        ("emit", values(sources.chain(["json"]).collect())),
    ]
}

/// Commands that touch or show objects.
const TOUCH: &str = "run report capture view fit objects";

/// Names of objects that need no file.
fn objects() -> String {
    ["builtin"].into_iter().chain(builtin::names()).collect::<Vec<_>>().join(" ")
}

/// The script of a shell that also completes keys and values, after a comma too.
fn completed(script: &str, shell: Shell) -> String {
    let options = options();
    match shell {
        Shell::Bash => {
            let case = |(option, words): &(&str, Vec<String>)| {
                format!("        --{option}) keys=\"{}\" ;;\n", words.join(" "))
            };
            let cases = options.iter().map(case).collect::<String>();
            script.to_owned() + &BASH.replace("CASES", &cases).replace("OBJECTS", &objects()).replace("COMMANDS", TOUCH)
        }
        Shell::Zsh => {
            let function = |(option, words): &(&str, Vec<String>)| {
                let word = |word: &String| match word.strip_suffix('=') {
                    Some(key) => format!(" '{key}:value: '"),
                    None => format!(" '{word}'"),
                };
                let keys: String = words.iter().map(word).collect();
                let files = if *option == "real" { "    _files -g '*.toml'\n" } else { "" };
                format!("_palpate_{option}() {{\n    _values -s , key{keys}\n{files}}}\n\n")
            };
            let objects = format!(
                "_palpate_objects() {{\n    _alternative 'files:file:_files' 'objects:object:({})'\n}}\n\n",
                objects()
            );
            let functions: String = options.iter().map(function).collect::<String>() + &objects;
            let line = |line: &str| match options.iter().find(|(option, _)| line.starts_with(&format!("'--{option}=[")))
            {
                Some((option, _)) => line.replace(":_default'", &format!(":_palpate_{option}'")) + "\n",
                None if line.starts_with("if [ \"$funcstack[1]\"") => format!("{functions}{line}\n"),
                None if line.starts_with("'*::sources") => line.replace(":_default'", ":_palpate_objects'") + "\n",
                None => format!("{line}\n"),
            };
            script.lines().map(line).collect()
        }
        Shell::Fish => {
            let line = |line: &str| match options.iter().find(|(option, _)| line.contains(&format!(" -l {option} "))) {
                Some((option, words)) => {
                    let only = if *option == "real" { "r" } else { "x" };
                    let end = format!(" -{only} -a '(__palpate_keys {})'", words.join(" "));
                    line.strip_suffix(" -r").unwrap_or(line).to_owned() + &end + "\n"
                }
                None => format!("{line}\n"),
            };
            let objects = format!("complete -c palpate -n '__fish_seen_subcommand_from {TOUCH}' -a '{}'\n", objects());
            script.lines().map(line).collect::<String>() + FISH + &objects
        }
        _ => script.into(),
    }
}

/// Bash breaks words at `=`: the word is taken from the line, and what is replaced of it is `$2`.
const BASH: &str = r#"
_palpate_keys() {
    local line="${COMP_LINE:0:COMP_POINT}" word option keys
    word="${line##* }"
    option="${line% *}"
    option="${option##* }"
    [[ "$word" == --*=* ]] && option="${word%%=*}" word="${word#*=}"
    case "$option" in
CASES        *)
            _palpate "$@"
            read -r _ option keys _ <<< "$line"
            [[ "$word" != -* && " COMMANDS " =~ " $option "|" $keys " ]] &&
                COMPREPLY+=($(compgen -W "OBJECTS" -- "$word") $(compgen -f -- "$word"))
            return ;;
    esac
    COMPREPLY=()
    word="${word##*,}"
    [[ "$word" == *=* ]] && return
    compopt -o nospace 2>/dev/null
    COMPREPLY=($(compgen -P "${2%"$word"}" -W "$keys" -- "$word"))
}

complete -F _palpate_keys -o bashdefault -o default palpate
"#;

const FISH: &str = r"
function __palpate_keys
    set -l given (commandline -ct | string replace -r '^--[a-z]+=' '' | string replace -r '[^,]*$' '')
    printf '%s\n' $given$argv
end
";
