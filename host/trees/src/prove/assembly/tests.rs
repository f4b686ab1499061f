//! Assembly of random trees of every kind, and of other libraries' models, is proved; changed lines are refused.

use super::{Code, Stated, read};
use crate::compile::code::Chip;
use crate::compile::code::tests::{CASES, Case, Numbers};
use crate::ensemble::Ensemble;
use crate::prove::boxes::{Rows, Tree, Values};
use crate::prove::{check_code, format, prove_code};

const FILE: &[u8] = b"an ensemble";

/// The code as it is read, and all rows.
fn meaning(bytes: &[u8], text: &str) -> Option<(Code, Vec<Values>)> {
    let plain = format::read(bytes).unwrap();
    let stated = Stated {
        objects: plain.names.len(),
        known: plain.names.len(),
        features: plain.features,
        keys: &plain.keys,
        checksum: crate::prove::checksum_of(bytes),
        sentinel: plain.sentinel,
    };
    read(text, &stated).ok().map(|code| (code, plain.keys.all(plain.features)))
}

/// True if two files add the same for every row.
fn is_same(one: &Code, other: &Code, rows: &mut [Values]) -> bool {
    let mut trees = one.trees.iter().zip(&other.trees);
    let same = |(one, other): (&Tree, &Tree)| {
        let equal = |leaf: &[f64], rows: &mut Rows| {
            other.leaves(rows, &mut |own, _| if own == leaf { Ok(()) } else { Err(()) })
        };
        one.object == other.object && one.leaves(rows, &mut |leaf, rows| equal(leaf, rows)).is_ok()
    };
    one.base == other.base && one.trees.len() == other.trees.len() && trees.all(same)
}

/// Each kind of code, with its case.
fn all() -> impl Iterator<Item = (&'static Case, Chip, bool)> {
    [(Chip::M0Plus, false), (Chip::M4F, false), (Chip::M0Plus, true), (Chip::M4F, true)]
        .into_iter()
        .flat_map(|(chip, early_exit)| CASES.iter().map(move |case| (case, chip, early_exit)))
}

#[test]
fn assembly_is_proved_and_its_certificate_holds() {
    let (mut proved, mut with_exits, mut failed) = (0, 0, Vec::new());
    for (case, chip, early_exit) in all() {
        if early_exit && !case.has_classes() {
            continue;
        }
        let (bytes, text) = case.assembly(chip, early_exit);
        let found = prove_code(&bytes, &text, &case.ensemble, FILE);
        if case.has_packed_leaves() {
            let error = found.unwrap_err().to_string();
            assert!(error.contains("of the assembly"), "{}: {error}", case.name);
            continue;
        }
        let (proof, certificate) = match found {
            Ok(found) => found,
            Err(error) => {
                failed.push(format!("{} {chip:?} {early_exit}: {error}", case.name));
                continue;
            }
        };
        assert!(proof.trees == certificate.trees.len());
        check_code(&certificate, &bytes, &text, &case.ensemble, FILE)
            .unwrap_or_else(|error| panic!("{} {chip:?} {early_exit}: {error}", case.name));
        proved += 1;
        with_exits += usize::from(text.contains("m_early"));
    }
    println!("{proved} files proved, {with_exits} with early exit");
    assert!(failed.is_empty(), "{failed:#?}");
    assert!(proved > 150 && with_exits > 50, "{proved} {with_exits}");
}

/// A line with another number, condition, register or label.
fn changed(text: &str, random: &mut Numbers) -> Option<String> {
    let lines: Vec<&str> = text.lines().collect();
    let at = random.below(lines.len() as u64) as usize;
    let line = lines[at];
    if !line.starts_with('\t') || line.starts_with("\t.s") || line.starts_with("\t.t") || line.starts_with("\t.g") {
        return None;
    }
    let pick = |all: &[&str], random: &mut Numbers| all[random.below(all.len() as u64) as usize].to_owned();
    let changed = match random.below(4) {
        0 => {
            let (head, number) = line.split_once('#')?;
            let length = number.find(|own: char| !own.is_ascii_digit()).unwrap_or(number.len());
            let value: i64 = number[..length].parse().ok()?;
            let other = (value + [1, -1, 2, 7][random.below(4) as usize]).max(0);
            format!("{head}#{other}{}", &number[length..])
        }
        1 => {
            let conditions = ["hi", "ls", "eq", "ne", "gt", "lt", "ge", "le"];
            let own = conditions.into_iter().find(|own| line.starts_with(&format!("\tb{own}")))?;
            line.replacen(own, &pick(&conditions, random), 1)
        }
        2 => {
            let (head, label) = line.split_once(".L")?;
            let labels: Vec<&str> = lines.iter().filter_map(|line| line.strip_suffix(':')).collect();
            let other = pick(&labels, random);
            if label.contains(',') { return None } else { format!("{head}{other}") }
        }
        _ => {
            let registers = ["r0", "r1", "r2", "r3", "r4", "r5", "r6", "r7"];
            let own = registers.into_iter().find(|own| line.contains(own))?;
            line.replacen(own, &pick(&registers, random), 1)
        }
    };
    if changed == line {
        return None;
    }
    let mut lines: Vec<&str> = lines;
    lines[at] = &changed;
    Some(lines.join("\n"))
}

#[test]
fn a_changed_number_condition_register_or_label_is_refused_unless_the_trees_stay_the_same() {
    let mut random = Numbers(3);
    let (mut refused, mut same) = (0, 0);
    for (number, (case, chip, early_exit)) in all().enumerate() {
        if number % 5 != 0 || early_exit && !case.has_classes() || case.has_packed_leaves() {
            continue;
        }
        let (bytes, text) = case.assembly(chip, early_exit);
        if text.len() > 60_000 {
            continue;
        }
        let (own, mut rows) = meaning(&bytes, &text).unwrap();
        for _ in 0..60 {
            let Some(changed) = changed(&text, &mut random) else { continue };
            match meaning(&bytes, &changed) {
                None => refused += 1,
                Some((other, _)) if is_same(&own, &other, &mut rows) => {
                    // Other bounds may hold as well.
                    let is_other = own.exits != other.exits;
                    let proved = !is_other || is_proved(&bytes, &changed, &case.ensemble);
                    if proved { same += 1 } else { refused += 1 }
                }
                Some(_) => {
                    let proved = is_proved(&bytes, &changed, &case.ensemble);
                    let lines = text.lines().zip(changed.lines()).find(|(a, b)| a != b);
                    assert!(!proved, "{} {chip:?}: a changed line is proved: {lines:?}", case.name);
                    refused += 1;
                }
            }
        }
    }
    println!("{refused} changed files are refused, {same} mean the same");
    assert!(refused > 500 && 8 * same < refused, "{refused} {same}");
}

fn is_proved(bytes: &[u8], text: &str, ensemble: &Ensemble) -> bool {
    prove_code(bytes, text, ensemble, FILE).is_ok()
}

#[test]
fn assembly_that_begins_again_without_end_is_refused_in_little_time_and_memory() {
    let mut refused = 0;
    for (case, chip, early_exit) in all().step_by(7) {
        if early_exit && !case.has_classes() {
            continue;
        }
        let (bytes, text) = case.assembly(chip, early_exit);
        let again = format!("\tb.n m_margins_{:08x}", crate::prove::checksum_of(&bytes));
        for (number, line) in text.lines().enumerate().filter(|line| line.1.starts_with("\tb.n .L")).take(3) {
            let lines = text.lines().enumerate().map(|own| if own.0 == number { &again[..] } else { own.1 });
            let changed = lines.collect::<Vec<_>>().join("\n");
            match meaning(&bytes, &changed) {
                None => refused += 1,
                // A branch that no row takes.
                Some((changed, mut rows)) => {
                    let (own, _) = meaning(&bytes, &text).unwrap();
                    assert!(is_same(&own, &changed, &mut rows), "{} {chip:?}: {line}", case.name);
                }
            }
        }
    }
    assert!(refused > 30, "{refused}");
}

#[test]
fn assembly_of_another_export_is_refused_by_its_checksum_and_without_one_it_is_read() {
    let case = &CASES[0];
    let (bytes, text) = case.assembly(Chip::M0Plus, false);
    let own = format!("{:08x}", crate::prove::checksum_of(&bytes));
    assert!(is_proved(&bytes, &text, &case.ensemble));
    let error = prove_code(&bytes, &text.replace(&own, "0badcafe"), &case.ensemble, FILE).unwrap_err().to_string();
    assert!(error.contains("model 0badcafe") && error.contains(&own), "{error}");
    // As earlier releases wrote it.
    assert!(is_proved(&bytes, &text.replace(&format!("_{own}"), ""), &case.ensemble));
}
