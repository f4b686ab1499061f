//! Whose results a directory holds, so that a run never replaces another one's unasked.

use crate::bug;
use palpate::error::{Error, Place, Result, problem};
use serde::Serialize;
use serde_json::Value;
use std::path::Path;

/// The file that states what results were made from.
const SUMMARY: &str = "summary.json";
/// Its field for that.
const MADE_FROM: &str = "made_from";

/// Refuses a directory with results that this run would replace though it did not make them. The same run again may
/// replace its own: `summary.json` then states the same `made_from`. If there is no summary, only the file or directory
/// `trace`, an earlier run was interrupted, and its files may be replaced too; any other of `files` is somebody's.
///
/// # Errors
/// Names the file that is of other results; [`Kind::Io`](palpate::error::Kind::Io).
pub fn refuse_others(directory: &Path, made_from: &Value, files: &[&str], trace: Option<&str>) -> Result<()> {
    let summary = directory.join(SUMMARY);
    let refused = |path: &Path, found: String| {
        let others = problem!("the directory holds results of another run: {found}");
        Err(others.fix("Choose another directory, or force the replacement.").at(Place::file(path)))
    };
    match std::fs::read(&summary) {
        Ok(bytes) => {
            let stated =
                serde_json::from_slice::<Value>(&bytes).ok().and_then(|summary| Some(summary.get(MADE_FROM)?.clone()));
            match stated {
                Some(stated) if stated == *made_from => Ok(()),
                Some(stated) => refused(&summary, difference(&stated, made_from)),
                None => refused(&summary, format!("it does not state {MADE_FROM}")),
            }
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            match files.iter().map(|file| directory.join(file)).find(|path| path.exists()) {
                Some(path) if !trace.is_some_and(|trace| directory.join(trace).exists()) => {
                    refused(&path, format!("there is no {SUMMARY} that states what it was made from"))
                }
                _ => Ok(()),
            }
        }
        Err(error) => Err(Error::io(&summary, "read the summary of earlier results", error)),
    }
}

/// The first field in which two statements differ.
fn difference(stated: &Value, wanted: &Value) -> String {
    let fields = wanted.as_object().into_iter().flatten();
    for (name, value) in fields {
        match (stated.get(name), value.is_object()) {
            (Some(stated), _) if stated == value => {}
            (Some(stated), true) => return format!("{name}: {}", difference(stated, value)),
            (Some(stated), false) => return format!("{name} was {stated}, and is {value} now"),
            (None, _) => return format!("{name} is not stated"),
        }
    }
    "it was made with settings that this version does not know".into()
}

/// A value as JSON.
///
/// # Errors
/// A value that JSON has no form for.
pub fn json(what: &'static str, value: &impl Serialize) -> Result<Value> {
    serde_json::to_value(value).map_err(|error| bug(format!("cannot write the {what} as JSON: {error}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::small::assert_says;
    use serde_json::json;

    #[test]
    fn results_of_another_run_are_refused_and_those_of_the_same_run_or_an_interrupted_one_are_not() {
        let directory = tempfile::tempdir().unwrap();
        let place = directory.path();
        let check = |made_from: &Value| refuse_others(place, made_from, &["model.palpate"], Some("data"));
        let own = json!({"job": "run", "sources": ["builtin"], "settings": {"seed": 1, "touches": 100}});
        check(&own).unwrap();

        // A file of somebody's; beside the trace of an interrupted run it is a run's own.
        std::fs::write(place.join("model.palpate"), "").unwrap();
        let error = check(&own).unwrap_err();
        assert_says(error, &["model.palpate: the directory holds results of another run"]);
        std::fs::create_dir(place.join("data")).unwrap();
        check(&own).unwrap();

        std::fs::write(place.join(SUMMARY), json!({"made_from": own, "seconds": 3}).to_string()).unwrap();
        check(&own).unwrap();
        let other = json!({"job": "run", "sources": ["builtin"], "settings": {"seed": 1, "touches": 200}});
        assert_says(check(&other).unwrap_err(), &["summary.json", "settings: touches was 100, and is 200 now"]);
        assert!(check(&json!({"job": "report"})).is_err());
        for summary in ["{}", "no JSON"] {
            std::fs::write(place.join(SUMMARY), summary).unwrap();
            assert!(check(&own).unwrap_err().to_string().contains("does not state"), "{summary}");
        }
    }
}
