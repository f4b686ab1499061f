//! The test vectors of the model format: the chip's recognizer gives what they say. `c_header` holds the C header to the
//! recognizer on all of their models.

use palpate_onboard::{Model, Recognizer, Refused, RowsSeen, Stopping, Verdict, exp2_negative};
use palpate_shared::format::{HEADER_LENGTH, MUST_UNDERSTAND, Temperature, checksum, f32_key};
use palpate_tests::abuse;
use palpate_tests::vectors::{Cut, bytes, numbers, read_numbers, read_touch, refusal};
use std::collections::BTreeSet;

const VECTORS: &str = include_str!("../../../shared/vectors/vectors.txt");
const FORMAT: &str = include_str!("../../../shared/FORMAT.md");

/// A recognizer with its last answers.
struct Known<'m> {
    model: Model<'m>,
    recognizer: Recognizer<'m, 256>,
    features: Vec<i32>,
    refused: Option<&'static str>,
    seen: RowsSeen<256>,
    guarded: Option<usize>,
}

impl<'m> Known<'m> {
    fn new(bytes: &'m [u8]) -> Self {
        let model = Model::new(bytes).unwrap();
        let recognizer = Recognizer::new(&model, Stopping::from_model(&model)).unwrap();
        Self { model, recognizer, features: Vec::new(), refused: None, seen: RowsSeen::new(), guarded: None }
    }

    fn touch(&mut self, words: &str) {
        let touch = read_touch(words);
        let descriptor = self.model.descriptor();
        if descriptor.is_some() {
            assert_eq!(self.recognizer.push_features(&[1, 2]), Err(Refused::NeedsTouches));
        }
        let before = (self.recognizer.evidence().to_vec(), self.recognizer.touches());
        let accepted = self.model.accepts(&touch);
        self.refused = self.recognizer.push(&touch).err().map(refusal);
        assert_eq!(accepted.err().map(refusal), self.refused);
        match descriptor {
            Some(descriptor) if accepted.is_ok() => self.features = descriptor.features(&touch).as_slice().to_vec(),
            _ => assert_eq!((self.recognizer.evidence().to_vec(), self.recognizer.touches()), before),
        }
    }

    fn row(&mut self, words: &str) {
        self.features = read_numbers(words);
        self.recognizer.push_features(&self.features).unwrap();
    }

    fn next(&mut self, words: &str) {
        let measured = read_numbers(words);
        let features = self.seen.clone().next(&self.model, &measured);
        let pushed = self.recognizer.push_seen(&measured, &mut self.seen);
        assert_eq!(pushed.err(), features.err());
        self.guarded = None;
        match features {
            Ok(features) => self.features = features[..self.model.feature_count()].to_vec(),
            Err(Refused::Guarded(feature, _)) => self.guarded = Some(feature.into()),
            Err(refused) => panic!("{refused}"),
        }
    }

    /// Cuts a part of the model at every length, and returns how many there are.
    fn cut(&self, words: &str) -> usize {
        let cut = Cut::read(words);
        for length in 0..cut.length {
            let bytes = cut.model(self.model.bytes(), length);
            let found =
                Model::new(&bytes).map(|_| ()).map_err(|error| (abuse::kind(&error).to_owned(), error.offset()));
            let expected = cut.expected(length).map_or(Ok(()), |(kind, place)| Err((kind.to_owned(), place)));
            assert_eq!(found, expected, "cut {words}: length {length}");
        }
        cut.length
    }

    fn check(&self, word: &str, words: &str) {
        match word {
            "name" => {
                let (object, name) = words.split_once(' ').unwrap();
                assert_eq!(self.model.object_name(object.parse().unwrap()), name);
            }
            "refused" => assert_eq!(self.refused, Some(words)),
            "guarded" => assert_eq!(self.guarded, Some(words.parse().unwrap())),
            "features" => assert_eq!(numbers(&self.features), words),
            "sums" => {
                let mut sums = vec![0.0; self.model.object_count()];
                assert!(self.model.f32_margins_of(&self.features, &mut sums));
                let expected: Vec<u32> = words.split(' ').map(|bits| u32::from_str_radix(bits, 16).unwrap()).collect();
                assert_eq!(sums.iter().map(|sum| sum.to_bits()).collect::<Vec<_>>(), expected);
            }
            "margins" => {
                let mut margins = vec![0; self.model.object_count()];
                assert!(self.model.margins_of(&self.features, &mut margins));
                assert_eq!(margins, read_numbers(words));
            }
            "evidence" => {
                let evidence: Vec<i64> = words.split(' ').map(|number| number.parse().unwrap()).collect();
                assert_eq!(self.recognizer.evidence(), evidence);
            }
            "verdict" => assert_eq!(said(self.recognizer.verdict()), words),
            "posterior" => {
                let (object, posterior) = words.split_once(' ').unwrap();
                let (object, posterior): (usize, u64) = (object.parse().unwrap(), posterior.parse().unwrap());
                assert_eq!(self.recognizer.posterior(object).q56(), posterior);
                if let Verdict::Recognized { object: recognized, rivals, .. } = self.recognizer.verdict()
                    && usize::from(recognized) == object
                    && self.model.temperature() == Temperature::ONE
                {
                    assert_eq!(rivals.posterior().q56(), posterior);
                }
            }
            "together" => {
                let numbers: Vec<u64> = words.split(' ').map(|number| number.parse().unwrap()).collect();
                let [output, posterior, share] = numbers[..] else { panic!("three numbers") };
                let found = self.recognizer.posterior_together(output as usize);
                assert_eq!((found.0.q56(), found.1.q56()), (posterior, share));
            }
            _ => panic!("an unknown word"),
        }
    }
}

fn said(verdict: Verdict) -> String {
    match verdict {
        Verdict::Recognized { object, touches, .. } => format!("recognized {object} {touches}"),
        other => other.name().into(),
    }
}

/// Lines that stand for themselves.
fn check_function(word: &str, words: &str) -> bool {
    let two = || words.split_once(' ').unwrap();
    match word {
        "crc" => assert_eq!(format!("{:08x}", checksum(&bytes(two().0))), two().1),
        "exp2" => {
            assert_eq!(exp2_negative(two().0.parse().unwrap()), two().1.parse::<u64>().unwrap());
        }
        "key" => {
            let value = f32::from_bits(u32::from_str_radix(two().0, 16).unwrap());
            assert_eq!([f32_key(value)][..], read_numbers(two().1));
        }
        "refuse" => {
            let [digits, kind, offset, _] = words.splitn(4, ' ').collect::<Vec<_>>()[..] else { panic!("four words") };
            let error = Model::new(&bytes(digits)).map(|_| ()).unwrap_err();
            assert_eq!((abuse::kind(&error), error.offset()), (kind, offset.parse().unwrap()));
        }
        _ => return false,
    }
    true
}

/// The vectors' lines with the number of each, and the words after its first one.
fn lines() -> impl Iterator<Item = (usize, &'static str, &'static str)> {
    let lines = VECTORS.lines().enumerate().filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    lines.map(|(index, line)| {
        let (word, words) = line.split_once(' ').unwrap_or((line, ""));
        (index + 1, word, words)
    })
}

#[test]
fn the_recognizer_gives_what_the_vectors_say() {
    let mut known: Option<Known<'_>> = None;
    let mut counts = [0; 4];
    for (number, word, words) in lines() {
        let place = std::panic::AssertUnwindSafe(|| {
            if word == "vectors" {
                return assert_eq!(words, "1");
            }
            if word == "model" {
                counts[0] += 1;
                known = Some(Known::new(bytes(words.split(' ').next().unwrap()).leak()));
                return;
            }
            if check_function(word, words) {
                return;
            }
            let known = known.as_mut().expect("a model comes first");
            match word {
                "cut" => counts[3] += known.cut(words),
                "touch" => {
                    counts[1] += 1;
                    known.touch(words);
                }
                "row" => {
                    counts[1] += 1;
                    known.row(words);
                }
                "next" => {
                    counts[1] += 1;
                    known.next(words);
                }
                "reset" => {
                    known.recognizer.reset();
                    known.seen.reset();
                }
                _ => {
                    counts[2] += 1;
                    known.check(word, words);
                }
            }
        });
        if let Err(panic) = std::panic::catch_unwind(place) {
            eprintln!("in line {number} of vectors.txt: {word}");
            std::panic::resume_unwind(panic);
        }
    }
    println!("{} models, {} touches, {} results, {} lengths of parts", counts[0], counts[1], counts[2], counts[3]);
    assert!(counts[0] > 60 && counts[1] > 500 && counts[2] > 2_000 && counts[3] > 600, "{counts:?}");
}

#[test]
fn the_vectors_have_every_layout_leaf_descriptor_and_verdict() {
    let models: Vec<&[u8]> = lines()
        .filter(|line| line.1 == "model")
        .map(|line| &*bytes(line.2.split(' ').next().unwrap()).leak())
        .collect();
    let of = |at: usize| models.iter().map(|bytes| bytes[at]).collect::<BTreeSet<u8>>();
    assert_eq!(of(4), BTreeSet::from([3]));
    assert_eq!(of(6), (0..2).collect());
    assert_eq!(of(7), (0..3).collect());
    assert_eq!(of(12), (0..7).chain([255]).collect());
    assert_eq!(of(13), (0..2).collect());
    let of = |word: &str| lines().filter(|line| line.1 == word).map(|line| line.2).collect::<BTreeSet<_>>();
    let verdicts: BTreeSet<&str> = of("verdict").iter().map(|words| words.split(' ').next().unwrap()).collect();
    assert_eq!(verdicts, BTreeSet::from(["gave-up", "recognized", "undecided"]));
    assert_eq!(of("refused"), BTreeSet::from(["features", "pattern", "pose", "spread"]));
    let guarded: Vec<&str> = of("guarded").into_iter().collect();
    assert_eq!(guarded, ["1", "3", "4"]);
    assert!(VECTORS.len() < 545_000, "{} bytes", VECTORS.len());
}

#[test]
fn the_vectors_cut_every_optional_section_and_every_part_of_every_layout() {
    let (mut tags, mut fields, mut base) = (BTreeSet::new(), BTreeSet::new(), Vec::new());
    for (_, word, words) in lines() {
        match word {
            "model" => base = bytes(words.split(' ').next().unwrap()),
            "cut" => {
                let cut = Cut::read(words);
                if cut.field < HEADER_LENGTH {
                    fields.insert((base[6], cut.field));
                } else {
                    let tag = u16::from_le_bytes([base[cut.field - 4], base[cut.field - 3]]);
                    tags.insert(tag & !MUST_UNDERSTAND);
                }
            }
            _ => {}
        }
    }
    assert_eq!(tags, (1..=16).chain([18, 19, 21, 22]).collect());
    let of = |layout: u8, fields: &[usize]| fields.iter().map(|&field| (layout, field)).collect::<Vec<_>>();
    let expected = [of(0, &[16, 18, 68, 80, 84, 88]), of(1, &[18, 68, 80, 84, 88])];
    assert_eq!(fields, expected.concat().into_iter().collect());
}

#[test]
fn every_abuse_of_a_model_is_refused_at_its_place() {
    let cases = abuse::cases();
    let wrong = cases.iter().filter_map(|case| {
        let found = Model::new(&case.bytes).map(|_| ()).map_err(|error| (abuse::kind(&error), error.offset()));
        (found != Err((case.kind, case.offset))).then(|| format!("{}: {:?}, not {:?}", case.name, found, case.offset))
    });
    assert_eq!(wrong.collect::<Vec<_>>(), Vec::<String>::new());
    let names: BTreeSet<&str> = cases.iter().map(|case| case.name.as_str()).collect();
    assert_eq!(names.len(), cases.len());
    // Those of the vectors are the same, and the specification lists each.
    let written: BTreeSet<&str> =
        lines().filter(|line| line.1 == "refuse").map(|line| line.2.splitn(4, ' ').nth(3).unwrap()).collect();
    assert_eq!(written, names);
    for case in &cases {
        let row = format!("| {} | {} |", case.name, case.kind);
        assert!(FORMAT.contains(&row), "FORMAT.md has no row {row}");
    }
}

#[test]
fn maps_have_the_numbers_that_the_format_states() {
    use palpate_onboard::locate::{
        BEYOND, DISTANCES, LIKELIHOODS_LENGTH, MAPS_LENGTH, PLACEMENT_LENGTH, WIDTHS, WITHIN,
    };
    use palpate_shared::format::{MAPS_LAYOUT, Tag};
    let format = FORMAT.replace(',', "").split_whitespace().collect::<Vec<_>>().join(" ");
    let lengths = format!(
        "{MAPS_LENGTH} bytes a record of {PLACEMENT_LENGTH} bytes for each placement {LIKELIHOODS_LENGTH} bytes of likelihoods"
    );
    let stated = [
        format!("A model of layout {MAPS_LAYOUT} has maps"),
        format!("2 code {MAPS_LAYOUT} maps |"),
        format!("| {} | yes | maps in layout {MAPS_LAYOUT} alone", Tag::Maps.code()),
        format!("**Maps** tag {} must be understood: {lengths}", Tag::Maps.code()),
        format!("| {} | (near · {WIDTHS} + width) · {DISTANCES} + distance |", 2 * WIDTHS * DISTANCES),
        format!("| {WITHIN} | share |"),
        format!("| {BEYOND} | distance |"),
        format!("at most {} or {}.", DISTANCES - 1, BEYOND - 1),
    ];
    for stated in stated {
        assert!(format.contains(&stated), "{stated}");
    }
}
