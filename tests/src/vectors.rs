//! The words of test vectors; `shared/vectors/README.md` describes them.

use palpate_onboard::Refused;
use palpate_shared::{ContactTime, MISSING_FEATURE, Pose, Touch};

/// Bytes as two digits each; none as `-`.
pub fn hex(bytes: &[u8]) -> String {
    if bytes.is_empty() { "-".into() } else { bytes.iter().map(|byte| format!("{byte:02x}")).collect() }
}

/// The bytes again.
///
/// # Panics
/// If they are none.
pub fn bytes(hex: &str) -> Vec<u8> {
    if hex == "-" {
        return Vec::new();
    }
    let digits = |at: usize| u8::from_str_radix(&hex[at..at + 2], 16).expect("two digits");
    (0..hex.len()).step_by(2).map(digits).collect()
}

/// Numbers, `-` for a missing one.
pub fn numbers(numbers: &[i32]) -> String {
    let word = |&number: &i32| if number == MISSING_FEATURE { "-".into() } else { number.to_string() };
    if numbers.is_empty() { ".".into() } else { numbers.iter().map(word).collect::<Vec<_>>().join(" ") }
}

/// The numbers again.
///
/// # Panics
/// If they are none.
pub fn read_numbers(words: &str) -> Vec<i32> {
    let number = |word: &str| if word == "-" { MISSING_FEATURE } else { word.parse().expect("a number") };
    if words == "." { Vec::new() } else { words.split(' ').map(number).collect() }
}

/// Three times, `-` for a missing one, and the pose, if there is one.
pub fn touch_words(touch: &Touch) -> String {
    let times = touch.times().map(|time| time.micros().map_or("-".into(), |micros| micros.to_string())).join(" ");
    let pose = touch
        .pose()
        .map_or([None; 6], |Pose { direction: [x, y, z], alignment: [u, v, w] }| [x, y, z, u, v, w].map(Some));
    pose.into_iter().flatten().fold(times, |words, part| format!("{words} {part}"))
}

/// The touch again.
///
/// # Panics
/// If it is none.
pub fn read_touch(words: &str) -> Touch {
    let words: Vec<&str> = words.split(' ').collect();
    let time = |word: &str| match word {
        "-" => ContactTime::MISSING,
        micros => ContactTime::from_micros(micros.parse().expect("a time")),
    };
    let touch = Touch::new([time(words[0]), time(words[1]), time(words[2])]);
    let part = |index: usize| words[index].parse().expect("a cosine");
    match words.len() {
        3 => touch,
        _ => touch.with_pose(Pose { direction: [3, 4, 5].map(part), alignment: [6, 7, 8].map(part) }),
    }
}

/// Reason why a touch was not counted.
pub const fn refusal(refused: Refused) -> &'static str {
    match refused {
        Refused::Pattern(_) => "pattern",
        Refused::Spread => "spread",
        Refused::NoPose => "pose",
        Refused::NeedsFeatures => "features",
        _ => "touches",
    }
}
