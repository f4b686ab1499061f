#!/usr/bin/env python3
"""48 faults, kept as patches beside this script, each against the tests of its crate: do they still catch what they caught?

    mutants.py select TREE               the mutants that SEED selects, from a checkout of BASE
    mutants.py apply COMMIT TREE         a new worktree at TREE with all patches, each behind a number in PALPATE_MUTANT
    mutants.py run TREE LOG              the tests without a mutant and with one after the other; goes on where LOG ends
    mutants.py compare BEFORE AFTER      every mutant that was caught before and is not now

Python 3.11 or newer and git; `select` takes cargo-mutants 27.1.0.
"""

import argparse
import json
import os
import queue
import random
import re
import resource
import signal
import subprocess
import sys
import tempfile
import threading
import time
import tomllib
from pathlib import Path

HERE = Path(__file__).resolve().parent
PATCHES = sorted(HERE.glob("*-*-*.patch"), key=lambda patch: int(patch.name.split("-")[1]))
BASE = "6230c8d1"
SEED = "palpate"
EACH = 8
# Rooms, the package and the files that the mutants of each are in.
ROOMS = {
    "shared": ("palpate-shared", r"^shared/src/"),
    "onboard": ("palpate-onboard", r"^onboard/src/"),
    "trees": ("palpate-trees", r"^host/trees/src/"),
    "evidence": ("palpate", r"^host/src/(evidence|calibrate)/|^host/src/evaluate/promise\.rs"),
    "capture": ("palpate", r"^host/src/(capture|touches)/"),
    "simulator": ("palpate-simulator", r"^host/simulator/src/"),
}
# Not mutated in BASE, by file and function: tests, and what was about to be deleted then.
LEFT_OUT = [
    r"(^|/)tests?(/|\.rs)|_tests\.rs",
    r"^shared/src/format/(evidence|strangers|signature)\.rs",
    r"OddsByObject|Events|TrainedCapture|Progress::|Counted::patterns|Signed",
    r"^onboard/src/decide/(events|forgetting|snapshot|strangers|ongoing)\.rs",
    r"^onboard/src/layouts/(complete|grid|patterns|built_in)\.rs",
    r"^onboard/src/station/(record|signed)\.rs",
    r"^onboard/src/station/flash\.rs.* (FlashStorage<F, RECORD>::|.*::(sector|record_length|newest|store) )",
    r"complete|forgotten|::event |patterns|grid|restore|snapshot|[Cc]ell|sum_without",
    r"^host/trees/src/compile/(table|cells|layout|cost|budget|groups)\.rs",
    r"^host/trees/src/prove/(tables|span)",
    r"vectors",
    r"^host/trees/src/verify/candidate",
    r"shared_leaves",
    r"^host/src/capture/(admission|store)\.rs",
    r"resume|shard|checkpoint",
    r"^host/src/touches/(captured|checksum|shard|save|format|no_mcap|files)",
    r"^host/simulator/src/mesh/(builtin/|no_builtin|facts/mod|facts/gaps)",
    r"/sweep/budget",
    r"Cloud|instances|complaints|::verdict.*mesh|guess",
]
# Mutants that the seed has chosen as well, and why the next one takes their place.
PASSED_OVER = {
    "replace > with >= in follow": "no difference: zero of zero is not a number, which the minimum skips",
    "replace += with *= in learned_and_tested": "of promises per name, which may be deleted",
    "replace <impl Supplier<F> for Given<'g, I>>::step -> Result<Option<Option<&F::Step>>, Infallible> with Ok(Some(None))":
        "does not end",
    "replace -= with /= in binomial_tail": "does not end",
    "replace match guard error.kind() == ErrorKind::Interrupted with true in read": "does not end",
    "replace ended -> Error with Default::default()": "does not compile",
    "replace > with >= in pieces": "of remarks on meshes, which are about to be deleted",
    "replace <impl BufRead for Counted<'_, R>>::consume with ()": "does not end",
    "replace match guard !*met with true in Scene<'_>::mesh": "does not end, and takes all memory",
}

# Test binaries that a room's mutants run against: packages, and targets of palpate-tests that name the room. A target that
# does not exist is skipped. One of palpate-tests that is in no list, such as one binary of all tests, runs for every room.
TESTS = "palpate-tests"
MODELS = [
    "approach", "c", "compiled_margins", "evidence", "flash", "golden_model", "model_bytes", "optional_sections",
    "parity", "promise", "prove", "refused", "rows_at_once", "soak", "station", "strangers",
]  # fmt: skip
SETS = {
    "shared": (["palpate-shared"], [*MODELS, "arduino", "probe_station", "vectors"]),
    "onboard": (["palpate-onboard"], [*MODELS, "arduino", "probe_station", "vectors"]),
    "trees": (["palpate-trees"], MODELS),
    "evidence": (["palpate", "palpate-cli"], ["parity", "promise"]),
    "capture": (["palpate", "palpate-cli"], ["parity", "soak"]),
    "simulator": (["palpate-simulator"], ["parity"]),
}
# Others of palpate-tests, which no mutant runs against: they build firmware, or read sources.
OTHERS = ["comments", "firmware", "images", "rooms", "stated", TESTS.replace("-", "_")]
KNOWN = {*OTHERS, *(name for _, names in SETS.values() for name in names)}

# Crates whose patches ask for the switch, and whether they have no standard library of their own.
CRATES = {"shared": True, "onboard": True, "host/trees": False, "host": False, "host/simulator": False}
EXTERN = """
#[cfg(all(unix, not(test)))]
extern crate std;
"""
SWITCH = """
#[cfg(unix)]
#[inline]
pub(crate) fn mutant(number: u32) -> bool {
    static SWITCHED: std::sync::OnceLock<u32> = std::sync::OnceLock::new();
    let read = || std::env::var("PALPATE_MUTANT").ok().and_then(|number| number.parse().ok()).unwrap_or(0);
    *SWITCHED.get_or_init(read) == number
}

#[cfg(not(unix))]
pub(crate) const fn mutant(_: u32) -> bool {
    false
}
"""

# A run that takes more processor time than TIMES that of the run without a mutant plus MORE seconds, or more than this
# memory, has caught the mutant as well. Time on the clock only ends one that waits for itself: other programs may be running.
TIMES, MORE = 5, 20
WAITED, MORE_WAITED = 30, 300
MOST_BYTES = 6 << 30


def git(*arguments, folder=HERE):
    return subprocess.run(["git", *arguments], cwd=folder, check=True, capture_output=True, text=True).stdout


def select(tree):
    """Prints the mutants with their numbers: the first eight of each room in a random order, one in each file."""
    number = 0
    for room, (package, files) in ROOMS.items():
        command = ["cargo", "mutants", "--list", "--json", "--no-config", "-p", package]
        offline = os.environ | {"CARGO_NET_OFFLINE": "true"}
        listed = json.loads(subprocess.run(command, cwd=tree, check=True, capture_output=True, env=offline).stdout)
        mutants = [mutant for mutant in listed if mutant["function"] and re.search(files, mutant["file"])]
        mutants = [mutant for mutant in mutants if not is_left_out(mutant) and not is_const(tree, mutant)]
        mutants.sort(key=lambda mutant: mutant["name"])
        random.Random(f"{SEED}/{room}").shuffle(mutants)
        chosen, met = 0, set()
        for mutant in mutants:
            if mutant["file"] in met or chosen == EACH:
                continue
            met.add(mutant["file"])
            reason = PASSED_OVER.get(mutant["name"].split(": ", 1)[1])
            if reason:
                print(f"--  {room}  {mutant['name']}  ({reason})")
                continue
            chosen, number = chosen + 1, number + 1
            print(f"{number:02}  {room}  {mutant['name']}")


def is_left_out(mutant):
    place = f"{mutant['file']} {mutant['function']['function_name']} "
    return any(re.search(pattern, place) for pattern in LEFT_OUT)


def is_const(tree, mutant):
    start = mutant["function"]["span"]["start"]["line"] - 1
    lines = Path(tree, mutant["file"]).read_text().split("\n")
    return re.search(r"\bconst fn", " ".join(lines[start : start + 7]).split("{")[0])


def apply(commit, tree):
    """Makes a worktree, applies all patches, and adds the switch to each crate."""
    git("worktree", "add", "--detach", str(Path(tree).resolve()), commit)
    missed = []
    for patch in PATCHES:
        # By git first, then by patch, which takes a patch whose surroundings have changed.
        ways = [["git", "apply", str(patch)], ["patch", "-p1", "--fuzz=2", "--no-backup-if-mismatch", "-i", str(patch)]]
        if not any(subprocess.run(way, cwd=tree, capture_output=True).returncode == 0 for way in ways):
            missed.append(patch.name)
    for crate, has_no_std in CRATES.items():
        with Path(tree, crate, "src/lib.rs").open("a") as source:
            source.write(EXTERN * has_no_std + SWITCH)
    if missed:
        sys.exit("these do not apply any more, and have to be made again by hand: " + ", ".join(missed))


def binaries(tree, target):
    """Builds all tests, and asks cargo where they are."""
    target = Path(target or tree / "target").resolve()
    # Cargo takes what another checkout built there after these sources were written as built from them.
    built_for = target / "mutants-of"
    if not built_for.exists() or built_for.read_text() != str(tree):
        for crate in CRATES:
            (tree / crate / "src/lib.rs").touch()
        target.mkdir(parents=True, exist_ok=True)
        built_for.write_text(str(tree))
    command = ["cargo", "test", "--release", "--workspace", "--locked", "--no-run", "--message-format", "json"]
    command += ["--target-dir", str(target)]
    settings = os.environ | {"CARGO_INCREMENTAL": "0"}
    built = subprocess.run(command, cwd=tree, stdout=subprocess.PIPE, check=True, env=settings).stdout
    found = []
    for message in map(json.loads, built.splitlines()):
        if message["reason"] != "compiler-artifact" or not message["profile"]["test"] or not message["executable"]:
            continue
        folder = Path(message["manifest_path"]).parent
        package = tomllib.loads((folder / "Cargo.toml").read_text())["package"]["name"]
        name, kind = message["target"]["name"], message["target"]["kind"][0]
        label = f"{package}/{name}" if kind == "test" else f"{package}/{name} ({kind})"
        path = message["executable"]
        found.append({"label": label, "package": package, "name": name, "path": path, "folder": folder})
    return found


def is_in(room, binary):
    packages, names = SETS[room]
    if binary["package"] == TESTS:
        return binary["name"] in names or binary["name"] not in KNOWN
    return binary["package"] in packages


class Ended:
    """Result of a test binary: failed tests in the order of time, or another end."""

    def __init__(self, why, failed, tests, wall, usage):
        self.why, self.failed, self.tests = why, failed, tests
        self.wall, self.user, self.system = round(wall, 1), round(usage.ru_utime, 1), round(usage.ru_stime, 1)


def execute(tree, binary, mutant, skipped=(), control=None):
    """Runs a test binary as cargo does. Where it is compared with a run without a mutant, its first failure ends it."""
    settings = tomllib.loads(Path(tree, ".cargo/config.toml").read_text()).get("env", {})
    variables = {name: value if isinstance(value, str) else value["value"] for name, value in settings.items()}
    variables |= {
        "CARGO_MANIFEST_DIR": str(binary["folder"]),
        "PALPATE_MUTANT": str(mutant),
        "PALPATE_SHARED": os.environ.get("PALPATE_SHARED", str(HERE.parents[2] / "shared")),
        "PROPTEST_RNG_SEED": "1",
        # Mutants must not teach cases to later ones.
        "PROPTEST_DISABLE_FAILURE_PERSISTENCE": "true",
    }
    command = [binary["path"]]
    if skipped:
        command += ["--exact", *(part for name in skipped for part in ("--skip", name))]
    began = polled = time.monotonic()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as scratch:
        process = subprocess.Popen(
            command, cwd=binary["folder"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL,
            start_new_session=True, env=os.environ | variables | {"TMPDIR": scratch},
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CORE, (0, 0)),
        )  # fmt: skip
        lines = queue.Queue()
        threading.Thread(target=read, args=(process.stdout, lines), daemon=True).start()
        failed, tests, why = [], 0, None
        while why is None:
            try:
                line = lines.get(timeout=1)
            except queue.Empty:
                line = ""
            if line is None:
                break
            ended = re.search(r"^test (\S+).* \.\.\. (ok|FAILED)", line)
            tests += ended is not None
            if ended and ended[2] == "FAILED":
                failed.append(ended[1])
                why = "failed" if control else None
            elif control and time.monotonic() - polled > 1:
                polled = time.monotonic()
                seconds, bytes_taken = taken(process.pid)
                if seconds > TIMES * (control["user"] + control["system"]) + MORE:
                    why = "timeout"
                elif polled - began > WAITED * control["wall"] + MORE_WAITED:
                    why = "waits"
                elif bytes_taken > MOST_BYTES:
                    why = "memory"
        if why:
            os.killpg(process.pid, signal.SIGKILL)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = code = os.waitstatus_to_exitcode(status)
    if why is None and code != 0:
        why = "failed" if failed else f"ended with {code}"
    return Ended(why, failed, tests, time.monotonic() - began, usage)


def read(stream, lines):
    for line in stream:
        lines.put(line.decode(errors="replace"))
    lines.put(None)


def taken(session):
    """Processor time that a session has taken so far, and the bytes that it has in memory."""
    ticks = pages = 0
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            stated = (folder / "stat").read_text().rsplit(")", 1)[1].split()
            if int(stated[3]) == session:
                ticks += sum(map(int, stated[11:15]))
                pages += int((folder / "statm").read_text().split()[1])
        except (OSError, ValueError, IndexError):
            # It has ended.
            continue
    return ticks / os.sysconf("SC_CLK_TCK"), pages * os.sysconf("SC_PAGE_SIZE")


def entries(log):
    return [json.loads(line) for line in Path(log).read_text().splitlines()] if Path(log).exists() else []


def run(tree, log, target, only):
    found = binaries(tree, target)
    controls = {entry["control"]: entry for entry in entries(log) if "control" in entry}
    done = {entry["mutant"] for entry in entries(log) if "mutant" in entry}

    def write(entry):
        line = json.dumps(entry)
        print(line, flush=True)
        with Path(log).open("a") as file:
            file.write(line + "\n")

    def check(binary):
        """Runs a test binary without a mutant, once."""
        label = binary["label"]
        if label not in controls:
            load = os.getloadavg()[0]
            end = execute(tree, binary, 0)
            controls[label] = {
                "control": label, "tests": end.tests, "wall": end.wall, "user": end.user, "system": end.system,
                "failed": end.failed, "end": end.why, "load": [round(load, 1), round(os.getloadavg()[0], 1)],
            }  # fmt: skip
            write(controls[label])
        return controls[label]

    for patch in PATCHES:
        room, number, _ = patch.name.split("-")
        number = int(number)
        if number in done or only and number not in only:
            continue
        tests = [binary for binary in found if is_in(room, binary) and check(binary)["tests"]]
        began, by, why = time.monotonic(), None, None
        for binary in sorted(tests, key=lambda binary: (binary["package"] == TESTS, check(binary)["wall"])):
            end = execute(tree, binary, number, check(binary)["failed"], check(binary))
            if end.why:
                by, why = f"{binary['label']}: {end.failed[0] if end.failed else end.why}", end.why
                break
        write({
            "mutant": number, "patch": patch.name, "caught": by is not None, "by": by, "why": why,
            "seconds": round(time.monotonic() - began, 1),
        })  # fmt: skip
    if not only:
        for binary in found:
            check(binary)


def compare(before, after):
    caught = {entry["patch"]: entry for entry in entries(before) if entry.get("caught")}
    now = {entry["patch"]: entry for entry in entries(after) if "mutant" in entry}
    lost = [name for name in caught if not now.get(name, {}).get("caught")]
    for name in lost:
        print(f"{name}: before by {caught[name]['by']}, now {'not run' if name not in now else 'by no test'}")
    print(f"{len(caught)} were caught before, {len(lost)} of them are not now")
    sys.exit(bool(lost))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("select").add_argument("tree")
    applies = commands.add_parser("apply")
    applies.add_argument("commit")
    applies.add_argument("tree")
    runs = commands.add_parser("run")
    runs.add_argument("tree")
    runs.add_argument("log")
    runs.add_argument("--target-dir", help="a folder of its own, or a copy of another target: its dependencies are not built again")
    runs.add_argument("--only", metavar="N,N", help="these mutants")
    runs.add_argument("--caught", metavar="LOG", help="those that this log says were caught")
    compares = commands.add_parser("compare")
    compares.add_argument("before")
    compares.add_argument("after")
    given = parser.parse_args()
    if given.command == "select":
        select(given.tree)
    elif given.command == "apply":
        apply(given.commit, given.tree)
    elif given.command == "run":
        only = {int(number) for number in given.only.split(",")} if given.only else set()
        if given.caught:
            only |= {entry["mutant"] for entry in entries(given.caught) if entry.get("caught")}
        run(Path(given.tree).resolve(), given.log, given.target_dir, only)
    else:
        compare(given.before, given.after)


if __name__ == "__main__":
    main()
