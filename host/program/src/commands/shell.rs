//! Commands as a shell reads them.

/// The command that the user typed, for pages to state: `palpate` and its arguments.
pub(crate) fn typed() -> String {
    let words = std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned());
    command(std::iter::once("palpate".to_owned()).chain(words))
}

/// The words as one line of a POSIX shell: words with special characters are quoted.
fn command(words: impl IntoIterator<Item = impl AsRef<str>>) -> String {
    words.into_iter().map(|word| quoted(word.as_ref())).collect::<Vec<_>>().join(" ")
}

fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "_-./:=+,@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) { word.into() } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_keeps_its_quotes() {
        assert_eq!(command(["palpate", "run", "meshes/cup.obj"]), "palpate run meshes/cup.obj");
        assert_eq!(
            command(["palpate", "run", "my meshes", "it's", "", "größe"]),
            "palpate run 'my meshes' 'it'\\''s' '' größe"
        );
        assert_eq!(command(["a$b", "*.obj", "x;y"]), "'a$b' '*.obj' 'x;y'");
    }
}
