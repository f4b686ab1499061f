//! Commands as a shell reads them.

/// The words as one line of a POSIX shell: words with special characters are quoted.
pub(crate) fn command<'a>(words: impl IntoIterator<Item = &'a str>) -> String {
    words.into_iter().map(quoted).collect::<Vec<_>>().join(" ")
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
