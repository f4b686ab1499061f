//! Texts of keys with values, such as `rounds=100,depth=6`, and errors that name the nearest key.

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

/// The choice of this name; an error names all.
pub(super) fn one_of<T>(name: &str, choices: impl IntoIterator<Item = (&'static str, T)>) -> Result<T, String> {
    let mut names = Vec::new();
    for (own, choice) in choices {
        if own == name {
            return Ok(choice);
        }
        names.push(own);
    }
    Err(format!("use one of {}", names.join(", ")))
}

/// The key that may have been meant, as an addition to an error; empty where none is near.
pub(super) fn nearest(word: &str, keys: &[&str]) -> String {
    let near = |key: &&&str| strsim::jaro(word, key) > 0.7;
    let closest = |a: &&&str, b: &&&str| strsim::jaro(word, a).total_cmp(&strsim::jaro(word, b));
    keys.iter().filter(near).max_by(closest).map_or_else(String::new, |key| format!(". Did you mean {key}?"))
}

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
