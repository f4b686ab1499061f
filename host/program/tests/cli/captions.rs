//! Captions and messages hold no number and no relation that was typed, since it would be wrong for another probe, another size
//! or a quick report. A number in a text of the report, or in a text that says results, is a parameter that is computed, or it
//! is listed here with the reason why it cannot change. Relations are treated alike.

use std::path::{Path, PathBuf};

/// Phrases with numbers that no setting and no result changes.
const NUMBERS: &[(&str, &str)] = &[
    ("{} (from 0)", "columns count from it"),
    ("figure 5", "of the paper"),
    ("figure 6", "of the paper"),
    ("figure 8a", "of the paper"),
    ("figure 8b", "of the paper"),
    ("figure 9", "of the paper"),
    ("figure 10", "of the paper"),
    ("figure 11", "of the paper"),
    ("figure 12", "of the paper"),
    ("figure 13", "of the paper"),
    ("ten ShapeNet models", "of the paper"),
    ("on the three contact times", "the method's features"),
    ("three contact times", "a touch has three"),
    ("three independent ones", "a touch has three"),
    ("three fingers", "a probe has three"),
    ("Three fingers", "a probe has three"),
    ("t₁ − 2·t₂ + t₃", "the definition of curvature"),
    ("(t₁ − t₂) − (t₂ − t₃)", "the paper's definition of curvature"),
    ("t1 − 2·t2 + t3", "the definition of curvature"),
    ("95 %", "of intervals: what statistics::z95 stands for"),
    ("posterior of 90 %, nine in ten", "an example of a definition"),
    ("1 − rate", "the definition of a threshold"),
    ("1 − threshold", "the definition of a threshold"),
    ("50 %", "chance level of two classes"),
    ("distinguish the two", "recorded and simulated"),
    ("after ten touches", "the measure: Method::at_10, CONFUSED_AT"),
    ("After ten touches", "the measure: Method::at_10"),
    ("after 10 touches", "the measure: Method::at_10"),
    ("after 30 touches", "the measure: Method::at_30"),
    ("after 60 touches", "the measure: Method::at_60"),
    ("after 10, noise of 5 ms", "the measure: Method::at_10_with_5_ms"),
    ("accuracy at 10", "the measure: Member::at_10"),
    ("accuracy at 30", "the measure: Member::at_30"),
    ("behind the limit at 10", "the measure: Limit::gap_at_10"),
    ("touches to 1 %", "the measure: Member::to_1_percent"),
    ("half a percent", "what heat_map rounds to nothing"),
    ("half an error", "what stream::shown draws"),
    ("half the capture", "what limit::half takes"),
    ("The first two", "the methods, in the order of the table"),
    ("the third was trained", "the method, in the order of METHODS"),
    ("of the two (or", "the candidates: ensemble and density"),
    ("the two features", "of the curvature descriptor"),
    ("features, not two", "density estimation takes two"),
    ("these two", "the signs of curvature"),
    ("the middle half", "a quartile is a quarter"),
    ("outer tenth", "the percentiles of the data: 5 and 95"),
    ("box of half its sides", "a definition: Aim::Middle"),
    ("half the sides", "a definition: Aim::Middle"),
    ("a box of a quarter", "a definition: Aim::Mass"),
    ("twice as many approaches", "what the curve extrapolates to: Curve::with_twice"),
    ("Cortex-M4F", "a name"),
    ("Cortex-M0+", "a name"),
    ("M4F", "a name"),
    ("M0+", "a name"),
    ("f32", "a name"),
    ("contact is 0", "times count from it"),
    ("at least two objects", "a report compares"),
    ("at most 256 objects", "a model has at most so many"),
    ("a 65,536th", "of play::pack, which rounds to 16 bits"),
    ("two fingers", "of a hand on a screen"),
    ("1 = fully", "the scale of a separation"),
    ("contacts of finger 1", "the number of a finger"),
    ("of finger 2", "the number of a finger"),
    ("of finger 3", "the number of a finger"),
    ("third finger", "the number of a finger"),
    ("with three contacts, {} with two", "the fingers that touched"),
    ("right to 15 %", "what the tests of the estimates allow"),
    ("1300 of them start-up", "of every image that compile::Memory measures"),
    ("such as 16384 or 16K", "an example of what to write"),
    ("a number above 0, such as 48", "an example of what to write"),
    ("1mm or 2mm", "the sizes of cells"),
    ("such as 30mm", "an example of what to write"),
    ("such as 0.5mm", "an example of what to write"),
    ("such as 2%", "an example of what to write"),
    ("such as 1mm", "an example of what to write"),
    ("such as 1mm/1deg", "an example of what to write"),
    ("such as 3mm/5deg", "an example of what to write"),
    ("version 151", "of a browser"),
    ("Chrome from 148", "of a browser"),
    ("half a minute", "what link.js waits"),
    ("from 300 on", "what the page's field takes"),
    ("\\u201c", "a quotation mark"),
    ("\\u201d", "a quotation mark"),
    ("\\u2192", "an arrow"),
    ("initial-scale=1", "no text"),
    ("1/ms", "a unit"),
    ("Finger 1", "the number of a finger"),
    ("Finger 2", "the number of a finger"),
    ("Finger 3", "the number of a finger"),
    ("half of the sequences within", "a median"),
    ("half within {} mm", "a median"),
    ("more than one sequence of a hundred", "strangers::USED_UP"),
];

/// Phrases that compare, of what was set, or of what the words before or after them say was computed.
const RELATIONS: &[(&str, &str)] = &[
    ("no fewer names are wrong where", "computed: Switched::helps"),
    ("so small a decrease in wrong names", "computed: Switched::helps"),
    ("for {} rows by more than the rounding", "computed: library_values_differ"),
    ("More than promised of: {}", "computed: the objects above the rate"),
    ("more frequently if you can", "advice"),
    ("the trees' largest differences", "the definition of the bound"),
    ("The smaller one that the model states", "computed: margin_error above stated"),
    ("at most {}", "a bound that was set, or measured"),
    ("at most the threshold at all", "computed: above_thresholds"),
    ("above the threshold at {}", "computed: above_thresholds"),
    ("at or below {} of", "computed: uncalibrated"),
    ("took more touches than a promise at {}", "computed: uncalibrated"),
    ("more for each object", "computed: training_cost"),
    ("no more for any object", "computed: training_cost"),
    ("more, except for {}", "computed: training_cost"),
    ("no more errors", "the definition of the fixed number"),
    ("makes as few errors", "the definition of the fixed number"),
    ("aims better and avoids", "what fewer_misses does"),
    ("of one that aims better", "what fewer_misses does"),
    ("above it the model is underconfident, below it", "sides of a line of a chart"),
    ("; above it, the promise is broken", "a side of a line of a chart"),
    ("above it, but no more than chance", "computed: Finding"),
    ("Shares below half a percent", "what heat_map rounds to nothing"),
    ("at most 256", "a model has at most so many"),
    ("approached them {} times more", "the second capture of a run"),
    ("a number above 0", "what an option takes"),
    ("with a lower probability", "what dependence does"),
    ("* the best that fits", "the outcome of the search"),
    ("in the best pose", "the definition of a plan's separation"),
    ("by more than chance", "computed: Finding"),
    ("the best accuracy up to", "the definition of a frontier"),
    ("best object", "the definition of a verdict"),
    ("best probe", "the outcome of the search"),
    ("the best accuracy that any", "the definition of the limit"),
    ("the best possible", "the definition of the limit"),
    ("the best that any classifier", "the definition of the limit"),
    ("The limit is the better", "the definition of the limit"),
    ("if it is better than both", "the definition of the limit"),
    ("table below", "a place on the page"),
    ("matrices above", "a place on the page"),
    ("fewer than {}", "a bound that was set"),
    ("more than {}", "a bound that was set, or measured"),
    ("more than one sequence of a hundred", "strangers::USED_UP"),
    ("More than {}", "a bound that was set"),
    ("Fewer approaches make weaker models", "advice"),
    ("A sequence with fewer rows", "a case"),
    ("too few", "the reason for a dash"),
    ("mistaken most often", "the definition of a promise per object"),
    ("class that most of as many rows", "the definition of a vote"),
    ("class with the most evidence", "the definition of a verdict"),
    ("more approaches", "the title of a section, or what a curve extrapolates to"),
    ("would hardly help", "computed: more_approaches"),
    ("or more", "a bound that was computed"),
    ("any more", "an idiom"),
    ("more columns", "what hint.js measures"),
    ("narrower intervals", "what more groups give"),
    ("stopping early needs {}", "computed: instead"),
    ("less than a point", "computed: cost"),
    ("is right less often", "advice"),
    ("wrong most often", "computed: the largest"),
    ("above what is promised", "computed: Finding"),
    ("above the promised", "computed: Finding"),
    ("as few wrong", "the definition of the comparison"),
    ("smaller for later rows", "the definition of the weights"),
    ("fit their objects worse", "computed: OnRecordings::before"),
    ("is no better than the given one", "computed: Adjusted::is_better"),
    ("model is better, and was saved", "computed: Adjusted::is_better"),
    ("mostly stays undecided", "computed: hidden"),
    ("least one", "a definition"),
    ("record more", "advice"),
    ("capture more", "advice"),
    ("No more than ${}", "a bound that was set"),
    ("tells most", "the choice of locate::choose"),
];

/// Files of texts that say results; all others hold help, and examples of what to write.
const OF_RESULTS: [&str; 20] = [
    "figures",
    "sequences",
    "strangers",
    "thresholds",
    "teach",
    "plan",
    "parity",
    "prove",
    "verify",
    "shown",
    "compare",
    "train",
    "calibrate",
    "capture",
    "evaluate",
    "fit",
    "inspect",
    "maps",
    "table",
    "tune",
];

/// The text of a file without comments and its own tests, as the string literals in it; each with its line.
fn literals(text: &str, quotes: &[char]) -> Vec<(usize, String)> {
    let end = text.find("#[cfg(test)]\nmod ").unwrap_or(text.len());
    let characters: Vec<char> = text[..end].chars().collect();
    let starts = |at: usize, with: &str| with.chars().enumerate().all(|(k, c)| characters.get(at + k) == Some(&c));
    let (mut at, mut line, mut found) = (0, 1, Vec::new());
    while let Some(&c) = characters.get(at) {
        line += usize::from(c == '\n');
        if starts(at, "//") {
            while characters.get(at).is_some_and(|c| *c != '\n') {
                at += 1;
            }
            continue;
        }
        // A character, but no lifetime.
        if c == '\'' && !quotes.contains(&'`') {
            let length = if characters.get(at + 1) == Some(&'\\') { 4 } else { 3 };
            at += if characters.get(at + length - 1) == Some(&'\'') { length } else { 1 };
            continue;
        }
        if !quotes.contains(&c) {
            at += 1;
            continue;
        }
        let (first, mut literal) = (line, String::new());
        at += 1;
        while let Some(&inner) = characters.get(at).filter(|inner| **inner != c) {
            line += usize::from(inner == '\n');
            if inner == '\\' && characters.get(at + 1) == Some(&'\n') {
                at += 1;
                while characters.get(at).is_some_and(|c| c.is_whitespace()) {
                    line += usize::from(characters[at] == '\n');
                    at += 1;
                }
                continue;
            }
            literal.push(inner);
            at += 1;
            if inner == '\\' {
                literal.extend(characters.get(at));
                at += 1;
            }
        }
        at += 1;
        found.push((first, literal));
    }
    found
}

/// A literal in which each parameter is `{}`.
fn without_parameters(literal: &str) -> String {
    let (mut text, mut depth) = (String::new(), 0);
    for c in literal.chars() {
        match c {
            '{' => {
                depth += 1;
                if depth == 1 {
                    text.push('{');
                }
            }
            '}' if depth > 0 => {
                depth -= 1;
                if depth == 0 {
                    text.push('}');
                }
            }
            _ if depth == 0 => text.push(c),
            _ => {}
        }
    }
    text
}

/// True of several words.
fn is_prose(text: &str) -> bool {
    // Help says what to write.
    if text.contains("Examples:") {
        return false;
    }
    let words: Vec<&str> =
        text.split(' ').filter(|word| word.chars().filter(char::is_ascii_alphabetic).count() > 1).collect();
    words.len() > 1 && !text.starts_with('<')
}

const NUMBER_WORDS: [&str; 17] = [
    "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve", "hundred", "thousand",
    "half", "third", "quarter", "twice",
];
const RELATION_WORDS: [&str; 17] = [
    "more", "fewer", "less", "above", "below", "better", "worse", "faster", "slower", "larger", "smaller", "higher",
    "lower", "most", "hardly", "rarely", "best",
];

fn has_number(text: &str) -> bool {
    has_word(text, &NUMBER_WORDS) || text.chars().any(|c| c.is_ascii_digit())
}

fn has_word(text: &str, words: &[&str]) -> bool {
    text.split(|c: char| !c.is_alphanumeric()).any(|word| words.contains(&word.to_lowercase().as_str()))
}

fn files(directory: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        match path.extension().and_then(|extension| extension.to_str()) {
            None => files(&path, found),
            Some("rs" | "js") if !["tests", "small"].contains(&stem.as_str()) => found.push(path),
            Some(_) => {}
        }
    }
}

#[test]
fn texts_of_results_hold_no_number_and_no_relation_that_was_typed() {
    let host = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let (mut paths, mut own) = (Vec::new(), Vec::new());
    files(&host.join("report/src"), &mut paths);
    files(&host.join("program/src"), &mut own);
    own.retain(|path| OF_RESULTS.contains(&path.file_stem().unwrap().to_string_lossy().as_ref()));
    assert!(paths.len() > 40 && own.len() >= OF_RESULTS.len(), "{paths:?} {own:?}");
    let mut used = vec![false; NUMBERS.len() + RELATIONS.len()];
    let mut faults = Vec::new();
    for path in paths.iter().chain(&own) {
        let text = std::fs::read_to_string(path).unwrap();
        let is_script = path.extension().is_some_and(|extension| extension == "js");
        let quotes: &[char] = if is_script { &['"', '`'] } else { &['"'] };
        for (line, literal) in literals(&text, quotes) {
            let literal = without_parameters(&literal);
            if !is_prose(&literal) {
                continue;
            }
            let mut without = |phrases: &[(&str, &str)], from: usize| {
                // The longest first: a phrase may hold another one.
                let mut order: Vec<usize> = (0..phrases.len()).collect();
                order.sort_by_key(|&index| std::cmp::Reverse(phrases[index].0.len()));
                order.into_iter().fold(literal.clone(), |text, index| {
                    used[from + index] |= text.contains(phrases[index].0);
                    text.replace(phrases[index].0, " ")
                })
            };
            let (numbers, relations) = (without(NUMBERS, 0), without(RELATIONS, NUMBERS.len()));
            let mut fault = |what: &str| faults.push(format!("{}:{line}: {what}: {literal}", path.display()));
            if has_number(&numbers) {
                fault("a number");
            }
            if has_word(&relations, &RELATION_WORDS) {
                fault("a relation");
            }
        }
    }
    let all = NUMBERS.iter().chain(RELATIONS);
    let unused: Vec<&str> = all.zip(&used).filter(|(_, used)| !**used).map(|(phrase, _)| phrase.0).collect();
    assert!(
        faults.is_empty(),
        "compute it from settings or results, or list it with its reason:\n{}",
        faults.join("\n")
    );
    assert!(unused.is_empty(), "no text holds these any more: {unused:?}");
}

#[test]
fn literals_are_found_whole_and_parameters_are_not_part_of_them() {
    let text = "let a = \"one {b:.1} \\\n     two\"; // \"no\"\nlet c = '\"'; let d: &'static str = \"{x}\\\"\";\n#[cfg(test)]\nmod tests { \"no\" }";
    let found: Vec<(usize, String)> =
        literals(text, &['"']).into_iter().map(|(line, literal)| (line, without_parameters(&literal))).collect();
    assert_eq!(found, [(1, "one {} two".to_owned()), (3, "{}\\\"".to_owned())]);
    assert!(has_number("ten touches") && has_number("at 10") && !has_number("often"));
    assert!(has_word("More errors", &RELATION_WORDS) && !has_word("almost", &RELATION_WORDS));
}
