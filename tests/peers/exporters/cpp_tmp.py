"""Exporters of tree ensembles on two emulated chips: bytes, instructions per row, and classes that differ from the library's.

    cargo build --release
    python3.11 tests/peers/exporters/compare.py target/release/palpate [wine digits synthetic touches paper forest forest30]

Makes an environment with the packages of requirements.txt beside itself (`venv`, not committed) and runs itself in it. Needs
gcc-arm-none-eabi with newlib and libstdc++, qemu-system-arm, and Rust's targets thumbv7em-none-eabihf and thumbv6m-none-eabi.
Prints a table in Markdown: about ten minutes.

*Bytes* are those of the whole image less one whose peer_class is empty: model, code, and what it calls of newlib and of the
compiler's routines (such as comparisons of floats on a chip without a float unit), all for size (-Os). The empty image is linked
without libraries, so that it holds no such routine. *Instructions* are of a row: class and all, f32 values in. *Wrong* are
classes that differ from the library's own among 200 plain rows, 200 whose values equal thresholds, 200 with missing values. No
row is of the training. *Seconds* are those that compiling and assembling an image's own files
take, of processor time, on both chips together.
"""

import resource
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]
CHIPS = [
    ("M4F", "thumbv7em-none-eabihf", "mps2-an386", ["-mcpu=cortex-m4", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"]),
    ("M0+", "thumbv6m-none-eabi", "mps2-an385", ["-mcpu=cortex-m0plus"]),
]


def enter_environment():
    python = HERE / "venv/bin/python"
    if Path(sys.prefix) == HERE / "venv":
        return
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", HERE / "venv"], check=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", "-r", HERE / "requirements.txt"], check=True)
    sys.exit(subprocess.run([python, *sys.argv]).returncode)


LIBRARIES = ["-lm", "-lc", "-lgcc"]


def image(chip, directory, source, libraries=LIBRARIES):
    """The program; its bytes in flash."""
    _, target, _, flags = chip
    common = ["-mthumb", *flags, "-Os", "-ffunction-sections", "-fdata-sections", "-DNDEBUG", "-w", *source.flags]
    common += ["-I", directory, "-I", ROOT / "onboard/c"]
    objects, seconds = [], []
    for path in [*source.files, HERE / "harness.c"]:
        objects.append(directory / f"{target}-{path.name}.o")
        is_cpp = path.suffix == ".cc"
        compiler = ["arm-none-eabi-g++", "-std=c++17", "-fno-exceptions", "-fno-rtti", "-fno-threadsafe-statics"]
        compiler = compiler if is_cpp else ["arm-none-eabi-gcc", "-std=gnu99", "-I", ROOT / "tests/c"]
        began = processor()
        subprocess.run([*compiler, *common, "-c", path, "-o", objects[-1]], check=True)
        if path.name != "harness.c":
            seconds.append(processor() - began)
    if source.library:
        objects.append(source.library(target))
    program = directory / f"{target}.elf"
    link = ["arm-none-eabi-gcc", "-mthumb", *flags, "-nostdlib", "-static", "-T", ROOT / "tests/c/mps2.ld"]
    link += ["-Wl,--gc-sections", "-Wl,--no-warn-rwx-segments", "-Wl,-z,noexecstack", *objects, *libraries, "-o", program]
    subprocess.run(link, check=True)
    size = subprocess.run(["arm-none-eabi-size", program], check=True, capture_output=True, text=True).stdout
    text, data = size.splitlines()[1].split()[:2]
    return program, int(text) + int(data), sum(seconds)


def on_risc_v(ensemble, directory, source):
    """Instructions of a row, and wrong classes, of our C on rv32imc."""
    program = directory / "rv32imc.elf"
    compiler = ["riscv64-unknown-elf-gcc", "-march=rv32imc_zicsr", "-mabi=ilp32", "-ffreestanding", "-nostdlib", "-static"]
    flags = ["-std=gnu99", "-Os", "-w", "-I", directory, "-I", ROOT / "onboard/c", "-I", ROOT / "tests/c"]
    flags += ["-T", ROOT / "tests/c/virt.ld", "-Wl,--no-warn-rwx-segments"]
    files = [*source.files, HERE / "harness.c"]
    subprocess.run([*compiler, *flags, *files, "-lgcc", "-o", program], check=True)
    command = ["qemu-system-riscv32", "-machine", "virt", "-bios", "none", "-nographic", "-icount", "shift=0"]
    command += ["-semihosting-config", "enable=on,target=native", "-kernel", program]
    done = subprocess.run(command, capture_output=True, text=True, timeout=900, stdin=subprocess.DEVNULL)
    instructions, *classes = [int(number, 16) for number in (done.stdout + done.stderr).split()]
    wrong = sum(found != expected for found, expected in zip(classes, ensemble.classes, strict=True))
    return f"rv32imc: {instructions // len(ensemble.kinds[0][1]):,} instructions, {wrong} of {len(classes)} classes wrong"


def processor():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def clang(chip, directory, source):
    """Seconds that clang takes for the files."""
    _, target, _, flags = chip
    began = processor()
    for path in source.files:
        command = ["clang", f"--target={target}", *flags, "-Os", "-w", "-ffreestanding", "-I", directory, "-I", ROOT / "onboard/c"]
        subprocess.run([*command, "-c", path, "-o", directory / "clang.o"], check=True)
    return processor() - began


def run(chip, program):
    """Ticks of all plain rows, and the class of every row."""
    command = ["qemu-system-arm", "-machine", chip[2], "-nographic", "-icount", "shift=0"]
    command += ["-semihosting-config", "enable=on,target=native", "-kernel", program]
    done = subprocess.run(command, capture_output=True, text=True, timeout=900, stdin=subprocess.DEVNULL)
    numbers = [int(number, 16) for number in (done.stdout + done.stderr).split()]
    return numbers[0], numbers[1:]


def rows_header(directory, ensemble):
    values = ",".join("0.0f/0.0f" if value != value else f"{float(value)!r}f" for value in ensemble.rows.ravel())
    count, features = ensemble.rows.shape
    (directory / "rows.h").write_text(
        f"enum {{ ROWS = {count}, FEATURES = {features}, PLAIN = {len(ensemble.kinds[0][1])} }};\n"
        f"static const float rows[] = {{{values}}};\n"
    )


def measure(ensemble, name, exporter, scratch):
    from exporters import Refused, Source

    directory = scratch / ensemble.name / "".join(part for part in name if part.isalnum())
    directory.mkdir(parents=True)
    rows_header(directory, ensemble)
    try:
        source = exporter(ensemble, directory)
    except Refused as refused:
        return None if str(refused) == "see touches" else f"refused: {refused}"
    except Exception as error:  # any failure of an exporter is a result
        return f"fails: {type(error).__name__}: {str(error).splitlines()[0] if str(error) else ''}"
    cells, seconds = [], [0.0, 0.0]
    for chip in CHIPS:
        empty = image(chip, directory, Source([HERE / "nothing.c"]), libraries=[])[1]
        try:
            program, size, taken = image(chip, directory, source)
        except subprocess.CalledProcessError:
            return "its code does not compile"
        seconds[0] += taken
        seconds[1] += clang(chip, directory, source) if source.clang else 0.0
        ticks, classes = run(chip, program)
        instructions = ticks * 40 // len(ensemble.kinds[0][1])
        expected = ensemble.classes if source.expected is None else source.expected
        wrong, at = [], 0
        for _, rows in ensemble.kinds:
            part = range(at, at + len(rows))
            wrong.append(str(sum(classes[row] != expected[row] for row in part)))
            at += len(rows)
        cells += [f"{size - empty:,}", f"{instructions:,}"]
    others = []
    if source.clang and "(C)" in name and ensemble.name in ("wine", "digits"):
        others = [on_risc_v(ensemble, directory, source)]
    by_clang = f", clang {seconds[1]:.1f}" if source.clang else ""
    by_gcc = "–" if source.library else f"{seconds[0]:.1f}{by_clang}"
    all_wrong = " / ".join(wrong) if any(part != "0" for part in wrong) else "none"
    return " | ".join([*cells, all_wrong, "; ".join([by_gcc, *others])])


def main():
    import exporters
    from functools import partial
    from models import all_of

    palpate = Path(sys.argv[1]).resolve()
    wanted = sys.argv[2:]
    ours = {
        f"ours {leaf} ({language})": partial(function, palpate=palpate, leaf=leaf)
        for leaf in ["i16", "i8", "f32"]
        for language, function in [("Rust", exporters.ours_rust), ("C", exporters.ours_c)]
    }
    ours["ours i16, code (C)"] = partial(exporters.ours_code, palpate=palpate)
    peers = {
        "TL2cgen": partial(exporters.tl2cgen, quantize=False),
        "TL2cgen, quantized": partial(exporters.tl2cgen, quantize=True),
        "m2cgen": exporters.m2cgen,
        "micromlgen": exporters.micromlgen,
        "Timber": exporters.timber,
        "emlearn, loadable": partial(exporters.emlearn, method="loadable"),
        "emlearn, inline": partial(exporters.emlearn, method="inline"),
        "emlearn, inline, whole votes": partial(exporters.emlearn, method="inline", leaf_bits=0),
        "emlearn, inline, f32": partial(exporters.emlearn, method="inline", dtype="float"),
        "YDF (its own model)": exporters.ydf,
        "irithyll-core": exporters.irithyll,
    }
    print("| ensemble | exporter | bytes M4F | instructions | bytes M0+ | instructions | wrong: plain / tied / missing | seconds |")
    print("|---|---|---|---|---|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory() as scratch:
        scratch = Path(scratch)
        for ensemble in all_of(palpate, scratch, wanted):
            for name, exporter in {k: v for k, v in {**ours, **peers}.items() if "YDF" in k or "microml" in k}.items():
                row = measure(ensemble, name, exporter, scratch)
                if row is not None:
                    cells = row if " | " in row else f"{row} | | | | |"
                    print(f"| {ensemble.name} | {name} | {cells} |", flush=True)


if __name__ == "__main__":
    enter_environment()
    main()
