"""Captures over a cluster: the bytes of one machine's, even if workers die on the way."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import cloudpickle
import distributed
import numpy as np
import palpate
import palpate.distributed
import pandas
import pytest

# Dask warns of much that is its own affair, such as ports and unclosed sockets of processes that were killed.
pytestmark = pytest.mark.filterwarnings("default")

ENVIRONMENT = {
    **os.environ,
    "DASK_DISTRIBUTED__SCHEDULER__WORKER_SATURATION": "1.0",
    # A death is told to the client at once.
    "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0",
}
OBJECTS = ["bowl", "mouse"]


class Cluster:
    """A scheduler and three workers, each a process of its own."""

    def __init__(self) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.processes: list[subprocess.Popen[bytes]] = []
        self.start()

    def start(self) -> None:
        quiet = ["--no-dashboard"]
        scheduler = ["scheduler", "--host", "127.0.0.1", "--port", str(self.port), *quiet]
        worker = ["worker", self.address, "--nthreads", "1", "--no-nanny", *quiet]
        for arguments in (scheduler, worker, worker, worker):
            self.add(arguments)

    def add(self, arguments: list[str]) -> None:
        command = [sys.executable, "-m", "dask", *arguments]
        out = subprocess.DEVNULL
        self.processes.append(subprocess.Popen(command, env=ENVIRONMENT, stdout=out, stderr=out))

    def kill(self) -> None:
        for process in self.processes:
            process.kill()
        for process in self.processes:
            process.wait()
        self.processes = []


@contextmanager
def started() -> Iterator[tuple[distributed.Client, Cluster]]:
    cluster = Cluster()
    try:
        with distributed.Client(cluster.address, timeout=60) as client:
            client.wait_for_workers(3, timeout=120)
            yield client, cluster
    finally:
        cluster.kill()


@pytest.fixture(scope="module")
def client() -> Iterator[distributed.Client]:
    with started() as (client, _):
        yield client


@pytest.fixture
def mortal() -> Iterator[tuple[distributed.Client, Cluster]]:
    """Yields a cluster of its own, for tests that kill some of it."""
    with started() as both:
        yield both


def files(directory: Path) -> dict[str, bytes]:
    """What the directory holds of a data set."""
    return {path.name: path.read_bytes() for path in sorted(directory.iterdir()) if path.suffix in (".txt", ".json")}


def once(act: Callable[[], None], after: int) -> palpate.Progress:
    """Acts when this many shards are done."""
    acted = False

    def progress(stage: str, done: int, total: int | None) -> None:
        nonlocal acted
        if stage == "touching" and done >= after and not acted:
            acted = True
            act()

    return progress


@pytest.mark.parametrize("format", ["text", "parquet"])
def test_the_result_is_that_of_one_machine(
    client: distributed.Client, tmp_path: Path, format: palpate.distributed.Format
) -> None:
    one = {"seed": 3, "approaches": True, "pose": True, "probe": palpate.Probe(spacing=1.25)}
    data = palpate.capture(OBJECTS, touches=500, out=tmp_path / "one", **one)
    options = {**one, "format": format}
    out = tmp_path / "many"
    summary = palpate.distributed.capture(client, OBJECTS, 500, out, touches_per_shard=250, **options)
    assert files(out) == files(tmp_path / "one")
    if format == "parquet":
        tables = [pandas.read_parquet(out / f"{name}.parquet") for name in OBJECTS]
        read = palpate.DataSet.from_pandas(pandas.concat(tables), probe=one["probe"], approaches=True)
        for name in ("times", "objects", "direction", "alignment"):
            np.testing.assert_array_equal(getattr(read, name), getattr(data, name))
    assert (summary.objects, summary.done, summary.kept, summary.refused) == (2, 4, 0, [])
    # Once more: only a part that was damaged is done again.
    (out / "parts" / "bowl" / "2-of-2.txt").write_bytes(b"0 0 0\n")
    again = palpate.distributed.capture(client, OBJECTS, 500, out, touches_per_shard=250, **options)
    assert (again.done, again.kept) == (1, 3) and files(out) == files(tmp_path / "one")
    other = palpate.distributed.capture(client, OBJECTS, 500, out, touches_per_shard=250, **{**options, "seed": 4})
    assert other.done == 4 and files(out) != files(tmp_path / "one")


def test_a_worker_that_is_killed_costs_nothing_but_time(
    mortal: tuple[distributed.Client, Cluster], tmp_path: Path
) -> None:
    client, cluster = mortal
    palpate.capture(OBJECTS, touches=2400, out=tmp_path / "one")
    out = tmp_path / "many"
    progress = once(cluster.processes[1].kill, after=3)
    summary = palpate.distributed.capture(client, OBJECTS, 2400, out, touches_per_shard=300, progress=progress)
    assert cluster.processes[1].wait() == -signal.SIGKILL
    assert summary.refused == [] and summary.done == 16
    assert files(out) == files(tmp_path / "one")


def test_a_scheduler_that_is_restarted_costs_nothing_but_time(
    mortal: tuple[distributed.Client, Cluster], tmp_path: Path
) -> None:
    client, cluster = mortal
    palpate.capture(OBJECTS, touches=2400, out=tmp_path / "one")
    out = tmp_path / "many"

    def restart() -> None:
        cluster.kill()
        cluster.start()

    progress = once(restart, after=3)
    summary = palpate.distributed.capture(client, OBJECTS, 2400, out, touches_per_shard=300, progress=progress)
    assert summary.refused == [] and summary.resubmitted > 0
    assert files(out) == files(tmp_path / "one")


class Deadly(distributed.WorkerPlugin):
    """Ends every worker that begins a shard of one object."""

    def __init__(self, key: str) -> None:
        self.key = key

    def setup(self, worker: object) -> None:
        pass

    def transition(self, key: object, start: str, finish: str, **_: object) -> None:
        if finish == "executing" and isinstance(key, tuple) and key[0] == self.key:
            os.kill(os.getpid(), signal.SIGKILL)


def test_a_shard_that_kills_its_worker_each_time_is_named_and_the_others_finish(tmp_path: Path) -> None:
    cloudpickle.register_pickle_by_value(sys.modules[__name__])
    out = tmp_path / "many"
    options = {"seed": 1, "probe": None, "approaches": False, "aim": "box", "length": 10.0, "millimeters": None}
    everything = {"touches": 900, "pose": False, **options}
    ((_, _, _, digest),) = palpate.distributed._objects(["fork"], everything, str(out), 3)
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        cluster.scheduler.allowed_failures = 0
        # All shards wait at the one worker, so that its death takes every one of them with it.
        cluster.scheduler.WORKER_SATURATION = float("inf")
        client.register_plugin(Deadly(f"capture-{digest}"))
        summary = palpate.distributed.capture(
            client, ["fork", *OBJECTS], 900, out, touches_per_shard=300
        )
    assert {(lost.object, lost.shard) for lost in summary.refused} == {("fork", f"{part}/3") for part in (1, 2, 3)}
    assert all("its worker died in each of 3 attempts" in lost.reason for lost in summary.refused)
    assert summary.objects == 2 and set(files(out)) == {"bowl.txt", "mouse.txt"}
    assert summary.resubmitted > 2 * len(summary.refused), "shards of other objects lost their worker too"


def test_a_mesh_that_is_refused_is_named_and_the_others_finish(client: distributed.Client, tmp_path: Path) -> None:
    (tmp_path / "broken.obj").write_text("v 0 0 0\nf 1 2 3\n")
    summary = palpate.distributed.capture(
        client, ["bowl", str(tmp_path / "broken.obj")], 100, tmp_path / "out"
    )
    assert [lost.object for lost in summary.refused] == ["broken"] and "broken.obj" in summary.refused[0].reason
    assert set(files(tmp_path / "out")) == {"bowl.txt"}


def test_a_buffer_beside_a_gltf_that_was_changed_is_captured_again(client: distributed.Client, tmp_path: Path) -> None:
    import struct

    def write(height: float) -> None:
        corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, height)]
        faces = [0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3]
        data = b"".join(struct.pack("<3f", *corner) for corner in corners) + struct.pack("<12I", *faces)
        (tmp_path / "wedge.bin").write_bytes(data)
        document = {
            "asset": {"version": "2.0"},
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                {"bufferView": 1, "componentType": 5125, "count": 12, "type": "SCALAR"},
            ],
            "bufferViews": [
                {"buffer": 0, "byteLength": 48},
                {"buffer": 0, "byteOffset": 48, "byteLength": 48},
            ],
            "buffers": [{"uri": "wedge.bin", "byteLength": 96}],
        }
        (tmp_path / "wedge.gltf").write_text(json.dumps(document))

    def captured() -> tuple[int, int]:
        meshes = ["bowl", str(tmp_path / "wedge.gltf")]
        summary = palpate.distributed.capture(client, meshes, 100, tmp_path / "out")
        return summary.done, summary.kept

    write(1.0)
    assert (captured(), captured()) == ((2, 0), (0, 2))
    write(0.5)
    assert captured() == (1, 1)


def test_xgboost_trains_over_the_cluster_and_its_model_is_imported(client: distributed.Client, tmp_path: Path) -> None:
    palpate.distributed.capture(client, OBJECTS, 3000, tmp_path / "data", format="parquet", touches_per_shard=1500)
    ensemble = palpate.distributed.train(client, tmp_path / "data", rounds=8)
    assert ensemble.objects == OBJECTS and ensemble.descriptor == "curvature" and ensemble.trees == 16
    unseen = palpate.capture(OBJECTS, touches=300, seed=2)
    found = palpate.evaluate(palpate.compile(ensemble), unseen, groups=200)
    assert found.accuracy[10] > 0.9


def test_the_program_captures_on_this_machine(tmp_path: Path) -> None:
    palpate.capture(OBJECTS, touches=200, out=tmp_path / "one")
    command = [sys.executable, "-m", "palpate.distributed"]
    out = ["-o", str(tmp_path / "many"), "--touches", "200", "--workers", "2"]
    done = subprocess.run([*command, *OBJECTS, *out], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("2 objects are complete; 2 shards were captured, 0 were there")
    assert files(tmp_path / "many") == files(tmp_path / "one")
    assert subprocess.run([*command, *OBJECTS, *out, "--touches", "0"], capture_output=True).returncode == 2
    assert subprocess.run([*command, "mug", *out], capture_output=True).returncode == 1
    assert "Examples:" in subprocess.run([*command, "--help"], capture_output=True, text=True, check=True).stdout
