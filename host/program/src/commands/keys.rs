//! Options that take keys with values, such as `rounds=100,depth=6`: their keys, in errors and in completions.

use super::{design, trees};
use clap_complete::Shell;
use palpate::probe::noise::PartialNoise;

/// The options, and the keys of each.
fn options() -> [(&'static str, Vec<&'static str>); 3] {
    [("real", PartialNoise::KEYS.into()), ("search", design::KEYS.into()), ("trees", trees::keys().collect())]
}

/// Keys and values of a text such as `rounds=100,depth=6`, in its order. An error names `what` a key is not, and an
/// `example`.
pub(super) fn pairs<'t>(
    text: &'t str,
    keys: &[&'static str],
    what: &str,
    example: &str,
) -> Result<Vec<(&'static str, &'t str)>, String> {
    let mut pairs: Vec<(&str, &str)> = Vec::new();
    for part in text.split(',') {
        let (word, value) = part.split_once('=').unwrap_or((part, ""));
        let word = word.trim().replace('-', "_");
        let Some(&key) = keys.iter().find(|key| **key == word) else {
            return Err(format!(
                "{part:?} is not {what}; use {example} and the like: {}{}",
                keys.join(", "),
                nearest(&word, keys)
            ));
        };
        if pairs.iter().any(|pair| pair.0 == key) {
            return Err(format!("{key} is given twice; use each key once"));
        }
        pairs.push((key, value.trim()));
    }
    Ok(pairs)
}

/// The key that may have been meant, as an addition to an error; empty where none is near.
pub(super) fn nearest(word: &str, keys: &[&str]) -> String {
    let near = |key: &&&str| strsim::jaro(word, key) > 0.7;
    let closest = |a: &&&str, b: &&&str| strsim::jaro(word, a).total_cmp(&strsim::jaro(word, b));
    keys.iter().filter(near).max_by(closest).map_or_else(String::new, |key| format!(". Did you mean {key}?"))
}

/// The script of a shell that also completes keys, after a comma too.
pub(super) fn completed(script: &str, shell: Shell) -> String {
    let options = options();
    match shell {
        Shell::Bash => {
            let case =
                |(option, keys): &(&str, Vec<&str>)| format!("        --{option}) keys=\"{}=\" ;;\n", keys.join("= "));
            script.to_owned() + &BASH.replace("CASES", &options.iter().map(case).collect::<String>())
        }
        Shell::Zsh => {
            let function = |(option, keys): &(&str, Vec<&str>)| {
                let keys: String = keys.iter().map(|key| format!(" '{key}:value: '")).collect();
                let files = if *option == "real" { "    _files -g '*.toml'\n" } else { "" };
                format!("_palpate_{option}() {{\n    _values -s , key{keys}\n{files}}}\n\n")
            };
            let functions: String = options.iter().map(function).collect();
            let line = |line: &str| match options.iter().find(|(option, _)| line.starts_with(&format!("'--{option}=[")))
            {
                Some((option, _)) => line.replace(":_default'", &format!(":_palpate_{option}'")) + "\n",
                None if line.starts_with("if [ \"$funcstack[1]\"") => format!("{functions}{line}\n"),
                None => format!("{line}\n"),
            };
            script.lines().map(line).collect()
        }
        Shell::Fish => {
            let line = |line: &str| match options.iter().find(|(option, _)| line.contains(&format!(" -l {option} "))) {
                Some((option, keys)) => {
                    let only = if *option == "real" { "r" } else { "x" };
                    let end = format!(" -{only} -a '(__palpate_keys {}=)'", keys.join("= "));
                    line.strip_suffix(" -r").unwrap_or(line).to_owned() + &end + "\n"
                }
                None => format!("{line}\n"),
            };
            script.lines().map(line).collect::<String>() + FISH
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
CASES        *) _palpate "$@"; return ;;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_that_is_misspelled_is_answered_with_the_nearest() {
        let keys = ["rounds", "depth", "leaf_bits"];
        let error = |text| pairs(text, &keys, "a setting", "depth=6").unwrap_err();
        assert_eq!(
            error("depht=3"),
            "\"depht=3\" is not a setting; use depth=6 and the like: rounds, depth, leaf_bits. Did you mean depth?"
        );
        assert!(error("gamma=1").ends_with("leaf_bits") && error("leafbits=8").ends_with("Did you mean leaf_bits?"));
        assert!(error("depth=3,depth=4").starts_with("depth is given twice"));
        assert_eq!(pairs("rounds=3, leaf-bits = 8", &keys, "", ""), Ok(vec![("rounds", "3"), ("leaf_bits", "8")]));
    }
}
