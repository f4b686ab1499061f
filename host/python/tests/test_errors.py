"""Errors are exceptions with the program's text; long calls can be watched and stopped."""

from __future__ import annotations

import _thread
import pickle
import signal
import threading
import time
from pathlib import Path

import numpy as np
import palpate
import pytest


def test_errors_say_where_what_and_what_to_do(tmp_path: Path) -> None:
    (tmp_path / "cup.txt").write_text("0 0 0\n0 x 0\n")
    with pytest.raises(palpate.InputError) as caught:
        palpate.DataSet.read(tmp_path)
    assert str(caught.value).startswith(f"{tmp_path}/cup.txt:2: ") and '"x" is not a number' in str(caught.value)
    assert (caught.value.path, caught.value.line) == (tmp_path / "cup.txt", 2)
    assert isinstance(caught.value, ValueError)
    again = pickle.loads(pickle.dumps(caught.value))
    assert type(again) is palpate.InputError and str(again) == str(caught.value) and again.line == 2
    with pytest.raises(OSError, match="cannot read the model"):
        palpate.Model.load(tmp_path / "none.palpate")
    with pytest.raises(palpate.FileError):
        palpate.Ensemble.load(tmp_path / "none.json")
    with pytest.raises(palpate.InputError, match="nothing.obj"):
        palpate.capture(tmp_path / "nothing.obj")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"touches": 0}, "touches is 0. Use 1 or more."),
        ({"aim": "top"}, "aim is top. Use box, middle or mass."),
        ({"probe": palpate.Probe(tilt=90.0)}, "tilt is 90"),
        ({"millimeters": 1.0}, "probe is not given"),
        ({"threads": 0}, "threads is 0"),
        ({"approaches": 0}, "approaches is 0. Use 1 or more."),
    ],
)
def test_settings_out_of_range_name_the_setting(options: dict[str, object], message: str) -> None:
    with pytest.raises(palpate.SettingError) as caught:
        palpate.capture("bowl", **options)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize("meshes", [[], {}, ()])
def test_no_meshes_at_all_are_an_error(meshes: object) -> None:
    with pytest.raises(palpate.SettingError, match="meshes is empty. Use at least one"):
        palpate.capture(meshes)  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", [palpate.Probe, palpate.Real])
@pytest.mark.parametrize("value", ["probe.toml", None, True, [1.0]])
def test_values_of_a_probe_and_of_noise_are_numbers(kind: type, value: object) -> None:
    with pytest.raises(palpate.SettingError, match=r"(radius|height) is .*\. Use a number"):
        kind(value)
    kind(np.float32(0.5))


def test_bytes_that_are_no_model_are_refused() -> None:
    for content in (b"", b"PLPT", bytes(1000)):
        with pytest.raises(palpate.InputError):
            palpate.Model(content)


def test_progress_is_told_from_the_callers_thread() -> None:
    calls: list[tuple[str, int, int | None]] = []
    threads = set()

    def progress(stage: str, done: int, total: int | None) -> None:
        threads.add(threading.get_ident())
        calls.append((stage, done, total))

    palpate.capture(["bowl", "mouse"], touches=200, progress=progress)
    assert calls[-1] == ("touching", 400, 400) and threads == {threading.get_ident()}
    data = palpate.capture(["bowl", "mouse"], touches=200)
    palpate.train(data, rounds=7, progress=progress)
    assert calls[-1] == ("training", 7, 7)


class Stop(Exception):
    pass


def test_what_a_callback_raises_stops_the_call(tmp_path: Path) -> None:
    def progress(stage: str, done: int, total: int | None) -> None:
        raise Stop

    with pytest.raises(Stop):
        palpate.capture("bowl", touches=10**9, out=tmp_path / "data", progress=progress)
    assert list(tmp_path.iterdir()) == []


def test_control_c_stops_a_long_call_and_other_threads_run_meanwhile() -> None:
    counted = 0
    running = True

    def count() -> None:
        nonlocal counted
        while running:
            counted += 1
            time.sleep(0.001)

    counter = threading.Thread(target=count)
    counter.start()
    # A program in the background of a shell ignores Ctrl-C, and hands that on.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        threading.Timer(0.3, _thread.interrupt_main).start()
        with pytest.raises(KeyboardInterrupt):
            palpate.capture("bowl", touches=10**9)
    finally:
        signal.signal(signal.SIGINT, before)
        running = False
        counter.join()
    assert counted > 1


def test_the_package_states_its_version() -> None:
    assert palpate.__version__.count(".") == 2
