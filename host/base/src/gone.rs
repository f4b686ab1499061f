//! Commands, options, values and kinds of files that earlier versions had, with what to use instead.

/// One line for each word that went, as a user writes it: a command, an option (behind its command, if others still have it), an
/// option with a value, or the ending of a file name.
const GONE: &[(&str, &str)] = &[
    ("tune", "train with --preset small or --preset tiny, or loop over settings in Python (docs/guide/small.md)"),
    ("probe design", "compare probes with a loop in Python (docs/guide/real-probe.md)"),
    ("data cast", "run the simulator's example: cargo run --release -p palpate-simulator --example cast"),
    ("data check A B", "evaluate a model of one data set on the other: palpate evaluate MODEL DATA"),
    ("--layout", "there is one layout of data; --emit c-code writes code where speed counts"),
    ("--early-exit", "code of all trees is fast: --emit c-code"),
    ("--emit thumb", "use --emit c-code, which compilers turn into code that is about as fast"),
    ("--emit thumb-m4f", "use --emit c-code, which compilers turn into code that is about as fast"),
    ("--certificate", "run verify --prove again: the proof takes seconds"),
    ("--shared-leaves", "leaves are shared by themselves where that makes the model smaller"),
    ("--resume", "repeat the command: a folder appears whole or not at all"),
    ("--add", "capture all touches at once, or parts of them with --samples A..B"),
    ("--shard", "capture parts on several machines with --samples A..B"),
    ("--format", "data sets are text; DataSet.to_pandas() in Python leads to every other format"),
    ("--mcap", "verdicts are text; touches of logs are read"),
    ("--switch", "call reset() where another object begins"),
    ("--events", "begin again after each verdict (docs/guide/streams.md)"),
    ("--rows-per-second", "rates per hour went with --events; begin again after each verdict (docs/guide/streams.md)"),
    ("--false-per-hour", "rates per hour went with --events; begin again after each verdict (docs/guide/streams.md)"),
    ("--hold-off", "begin again after each verdict (docs/guide/streams.md)"),
    ("--grace", "begin again after each verdict (docs/guide/streams.md)"),
    ("--strangers", "use --detect-unknown"),
    ("--placement-prior", "use --per object: the rate then holds in each placement"),
    ("calibrate --label", "use palpate rows calibrate"),
    ("calibrate --guard", "use palpate rows calibrate"),
    ("calibrate --objects", "use palpate maps calibrate"),
    ("calibrate --plan", "use palpate plan"),
    ("evaluate --label", "use palpate rows evaluate"),
    ("evaluate --objects", "use palpate maps evaluate"),
    ("recognize --features", "use palpate rows recognize"),
    ("recognize --add-up", "use palpate rows recognize"),
    ("recognize --active", "use --next"),
    ("recognize --explore", "use palpate maps explore"),
    ("link --active", "use --next"),
    ("view --play", "use palpate play, or palpate maps play for a table"),
    ("view --port", "use palpate watch"),
    ("--varied", "capture objects of your own with --instances"),
    ("--picture", "draw objects with palpate view"),
    ("--trace", "Palpate's own tests compare the page with the program"),
    ("--watch", "palpate link PORT prints a line for each touch of the chip's own fingers; palpate watch makes a page"),
    ("--journal", "write the output of palpate link PORT to a file"),
    ("--against", "check a chip with --parity and --load"),
    ("--per-object", "check a chip with --parity and --load"),
    ("--bad-line", "faults of lines are simulated by Palpate's own tests"),
    ("--firmware", "connect to the chip or the emulator by its port"),
    ("--misses", "state the probability of a miss with --real missed=P"),
    ("--mhz", "divide the number of instructions by the clock rate"),
    ("--config", "state the settings as options"),
    ("--confusion", "palpate report draws the confusion of objects"),
    ("report --recorded", "evaluate a model on the recording: palpate evaluate MODEL RECORDED"),
    ("capture --position", "make maps of meshes with palpate maps train, without touches"),
    ("--within", "make maps of meshes with palpate maps train, without touches"),
    ("train --maps", "make maps with palpate maps train, which takes --maps"),
    (".parquet", "write text or CSV, for instance with pandas"),
    (".pcd", "make a mesh of the points first (docs/guide/scenes.md)"),
    (".xyz", "make a mesh of the points first (docs/guide/scenes.md)"),
    ("points", "make a mesh of the points first (docs/guide/scenes.md)"),
    ("depth image", "make a mesh of the depth images first (docs/guide/scenes.md)"),
];

/// Advice for a word that was removed: a command (`probe design`), an option (`--layout`, `view --play`), an option with a value
/// (`--emit thumb`), or the ending of a file name (`.pcd`). `None` for any other word.
pub fn instead(word: &str) -> Option<&'static str> {
    GONE.iter().find(|(gone, _)| *gone == word).map(|(_, instead)| *instead)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_word_that_went_has_one_line() {
        for (index, (word, line)) in GONE.iter().enumerate() {
            assert!(GONE[..index].iter().all(|(earlier, _)| earlier != word), "{word} twice");
            assert!(!line.contains('\n') && !line.ends_with('.') && instead(word) == Some(*line), "{word}");
        }
        assert_eq!(instead("--error-rate"), None);
    }
}
