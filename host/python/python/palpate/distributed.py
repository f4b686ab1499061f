"""Captures and training over more than one machine, by Dask.

    python -m palpate.distributed --help

The caller makes the cluster: `LocalCluster`, SSH, dask-jobqueue for Slurm, dask-kubernetes. Workers should have one thread
each, and the scheduler `distributed.scheduler.worker-saturation` 1.0, so that shards are not queued at workers:

    dask.config.set({"distributed.scheduler.worker-saturation": 1.0})   # before the cluster is made
    client = distributed.Client(distributed.LocalCluster(n_workers=8, threads_per_worker=1))
    summary = palpate.distributed.capture(client, "meshes/", 21_000, "out/")

Meshes are read by the workers, so their paths must be the same there. Results are those of `palpate capture` on one
machine, byte for byte.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import json
import logging
import os
import sys
import tempfile
import uuid
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from . import _native
from ._errors import InputError, PalpateError, SettingError
from ._native import DataSet, Ensemble
from ._types import Mesh, Meshes, Probe, Progress

if TYPE_CHECKING:
    import distributed

logger = logging.getLogger(__name__)

ATTEMPTS = 3
"""The largest number of times that a shard is submitted."""

Format = Literal["text", "parquet"]
"""Parquet is written beside the text."""


@dataclass(frozen=True)
class Refused:
    """A shard that was not captured."""

    object: str
    shard: str
    """K/N: the K-th of N parts."""
    reason: str


@dataclass(frozen=True)
class Summary:
    """The result of a capture."""

    objects: int
    """Objects whose touches are all there."""
    done: int
    """Shards that were captured now."""
    kept: int
    """Shards that were there already."""
    resubmitted: int
    """The number of times that a shard was submitted again because its worker died or the scheduler was restarted."""
    refused: list[Refused] = field(default_factory=list)
    """Shards that were not captured, with reasons."""


@dataclass(frozen=True)
class _Job:
    """The input of a worker that captures one shard."""

    name: str
    mesh: str | Mesh = field(compare=False)
    checksums: list[str] = field(compare=False)
    """Checksums of the mesh as the caller read it; empty if it could not be read."""
    digest: str
    """Checksum of mesh, settings, version and target, by which jobs are compared."""
    options: dict[str, Any] = field(compare=False)
    part: int
    parts: int
    target: str

    @property
    def shard(self) -> str:
        return f"{self.part}/{self.parts}"

    @property
    def samples(self) -> tuple[int, int]:
        """The first of its touches, and the one after its last."""
        touches: int = self.options["touches"]
        return touches * (self.part - 1) // self.parts, touches * self.part // self.parts

    @property
    def path(self) -> str:
        """The path of the part."""
        return f"parts/{self.name}/{self.part}-of-{self.parts}.txt"

    def key(self, attempt: int) -> tuple[str, str, int]:
        """A tuple: string keys that begin alike are sent to one worker. Each attempt has its own, since a key that failed stays
        failed."""
        return (f"capture-{self.digest}", self.shard, attempt)


class _Store:
    """A directory of any store that fsspec knows, in which files appear whole or not at all."""

    def __init__(self, url: str) -> None:
        import fsspec

        self.files, self.root = fsspec.core.url_to_fs(url)

    def path(self, name: str) -> str:
        return f"{self.root}/{name}"

    def write(self, name: str, content: bytes) -> None:
        """Under another name first, which is unlike that of any other attempt; then renamed."""
        path = self.path(name)
        self.files.makedirs(os.path.dirname(path), exist_ok=True)
        unfinished = f"{path}.{uuid.uuid4().hex}.unfinished"
        with self.files.open(unfinished, "wb") as file:
            file.write(content)
            file.flush()
            with contextlib.suppress(AttributeError, OSError, ValueError):
                os.fsync(file.fileno())
        if "file" in self._protocols():
            os.replace(unfinished, path)
        else:
            self.files.mv(unfinished, path)

    def read(self, name: str) -> bytes | None:
        """A file's content; `None` if there is none."""
        try:
            return bytes(self.files.cat_file(self.path(name)))
        except FileNotFoundError:
            return None

    def size(self, name: str) -> int | None:
        try:
            return int(self.files.info(self.path(name))["size"])
        except FileNotFoundError:
            return None

    def remove(self, name: str) -> None:
        with contextlib.suppress(FileNotFoundError):
            self.files.rm(self.path(name), recursive=True)

    def _protocols(self) -> tuple[str, ...]:
        protocol = self.files.protocol
        return (protocol,) if isinstance(protocol, str) else tuple(protocol)


def capture(
    client: distributed.Client,
    meshes: Meshes,
    touches: int,
    out: str | os.PathLike[str],
    *,
    seed: int = 1,
    probe: Probe | None = None,
    approaches: bool = False,
    pose: bool = False,
    aim: str = "box",
    length: float = 10.0,
    millimeters: float | None = None,
    format: Format = "text",
    touches_per_shard: int = 100_000,
    progress: Progress | None = None,
) -> Summary:
    """Captures `touches` of each mesh over a cluster, into the directory `out` of any store that fsspec knows.

    Each mesh is divided into shards of at most `touches_per_shard`. A shard that is there already, of the same mesh, settings
    and version, is not captured again: a capture that was interrupted is repeated with the same call. Shards of workers that
    die, and all unfinished ones if the scheduler is restarted, are submitted again, at most three times in all. The last time
    a shard runs alone, so that no other shard of this capture can kill its worker. One that kills its worker each time, or whose mesh is
    refused, is named in the summary, and the others finish.

    The other arguments are those of `palpate.capture`. Afterwards `out` holds what `palpate capture` would have written:
    `<object>.txt` for each object and, if none was refused, `dataset.json`. The format "parquet" adds `<object>.parquet`, the
    table of `DataSet.to_pandas`, for `train` and others; it needs pandas and pyarrow here and on the workers.
    """
    import distributed

    if touches < 1:
        raise SettingError(f"touches is {touches}. Use 1 or more.")
    if touches_per_shard < 1:
        raise SettingError(f"touches_per_shard is {touches_per_shard}. Use 1 or more.")
    url = os.fspath(out)
    options = {
        "touches": touches,
        "seed": seed,
        "probe": probe,
        "approaches": approaches,
        "pose": pose,
        "aim": aim,
        "length": length,
        "millimeters": millimeters,
    }
    parts = -(-touches // touches_per_shard)
    store = _Store(url)
    objects = {
        name: [_Job(name, mesh, checksums, digest, options, part, parts, url) for part in range(1, parts + 1)]
        for name, mesh, checksums, digest in _objects(meshes, options, url, parts)
    }
    jobs = [job for shards in objects.values() for job in shards]
    kept = {job for job in jobs if _record(store, job) is not None} if store.files.exists(store.path("parts")) else set()
    logger.info("%d objects in %d shards, %d of them there already", len(objects), len(jobs), len(kept))
    finished, resubmitted, refused = len(kept), 0, list[Refused]()
    todo: dict[distributed.Future[None], tuple[_Job, int]] = {}
    completed = distributed.as_completed()

    def submit(job: _Job, attempt: int) -> None:
        future = client.submit(_capture, job, key=job.key(attempt), pure=False)
        todo[future] = (job, attempt)
        completed.add(future)

    for job in jobs:
        if job not in kept:
            submit(job, 1)
    # Shards before their last attempt: each waits until no other shard runs.
    suspects = list[_Job]()
    for future in completed:
        job, attempt = todo.pop(future)
        if progress is not None:
            progress("touching", finished, len(jobs))
        try:
            future.result()
        except (distributed.KilledWorker, distributed.client.FutureCancelledError) as error:
            if _record(store, job) is not None:
                finished += 1
            elif attempt < ATTEMPTS:
                logger.warning("%s, shard %s, attempt %d: %s", job.name, job.shard, attempt, _said(error))
                resubmitted += 1
                if attempt + 1 == ATTEMPTS:
                    suspects.append(job)
                else:
                    submit(job, attempt + 1)
            else:
                reason = f"its worker died in each of {ATTEMPTS} attempts. Capture it alone, with more memory."
                refused.append(Refused(job.name, job.shard, reason))
        except PalpateError as error:
            refused.append(Refused(job.name, job.shard, str(error)))
        else:
            finished += 1
        if suspects and not todo:
            submit(suspects.pop(), ATTEMPTS)
        if progress is not None:
            progress("touching", finished, len(jobs))
    for lost in refused:
        logger.error("%s, shard %s: %s", lost.object, lost.shard, lost.reason)
    lacking = {lost.object for lost in refused}
    whole = [shards for name, shards in objects.items() if name not in lacking]
    entries = _join(client, whole, format, progress)
    if not lacking:
        settings = json.loads(entries[0]["settings"])
        del settings["samples"]
        listing = {
            "palpate": entries[0]["palpate"],
            "settings": settings,
            "objects": [json.loads(entry["entry"]) for entry in entries],
        }
        store.write("dataset.json", json.dumps(listing, indent=2, ensure_ascii=False).encode() + b"\n")
    return Summary(len(whole), finished - len(kept), len(kept), resubmitted, refused)


def _said(error: BaseException) -> str:
    return str(error).partition("\n")[0]


def _objects(
    meshes: Meshes, options: dict[str, Any], url: str, parts: int
) -> Iterator[tuple[str, str | Mesh, list[str], str]]:
    """Names, meshes, their checksums, and a digest of all that decides about the touches and where they go.

    The meshes are digested as they are read: a file such as a glTF's buffer, which is beside the one that is named, counts.
    """
    target = url if "://" in url else str(Path(url).absolute())
    setting = [repr(sorted(options.items(), key=lambda item: item[0])), _version(), target, str(parts)]
    if isinstance(meshes, Mapping):
        import numpy

        named: list[tuple[str, str | Mesh]] = []
        for name, mesh in sorted(meshes.items()):
            if isinstance(mesh, (str, os.PathLike)):
                named.append((name, os.fspath(mesh)))
                continue
            vertices, faces = mesh if isinstance(mesh, tuple) else (mesh.vertices, mesh.faces)
            named.append((name, (numpy.ascontiguousarray(vertices, dtype="f8"), numpy.ascontiguousarray(faces, dtype="i8"))))
    else:
        given = [meshes] if isinstance(meshes, (str, os.PathLike)) else list(meshes)
        named = [(name, source) for name, source in _native.sources(given)]
    if not named:
        raise InputError("no meshes are given. Give a mesh at least.")
    for name, mesh in named:
        # One after the other: all meshes together may be more than fits the memory.
        try:
            ((_, checksums),) = _native.checksums({name: mesh})
        except PalpateError:
            # The worker says why.
            checksums = []
        digest = hashlib.blake2b(digest_size=16)
        for text in [name, *checksums, *setting]:
            digest.update(text.encode() + b"\0")
        yield name, mesh, checksums, digest.hexdigest()


def _version() -> str:
    from importlib.metadata import version

    return version("palpate")


def _record(store: _Store, job: _Job) -> dict[str, Any] | None:
    """The record beside a finished part; `None` if it is of another capture, or the part is not there as a whole."""
    content = store.read(f"{job.path}.json")
    if content is None:
        return None
    try:
        record: dict[str, Any] = json.loads(content)
    except ValueError:
        return None
    is_whole = record.get("digest") == job.digest and store.size(job.path) == record["bytes"]
    return record if is_whole else None


def _capture(job: _Job) -> None:
    """Captures one shard. Runs on a worker."""
    store = _Store(job.target)
    with tempfile.TemporaryDirectory() as directory:
        out = Path(directory) / "data"
        _native.capture({job.name: job.mesh}, **job.options, samples=job.samples, out=out, threads=1)
        listing = json.loads((out / "dataset.json").read_text(encoding="utf-8"))
        (entry,) = listing["objects"]
        if job.checksums and entry["meshes"] != job.checksums:
            raise InputError(f"{job.name}: its mesh was changed during the capture. Repeat the call.")
        content = (out / f"{job.name}.txt").read_bytes()
    record = {
        "digest": job.digest,
        "crc32": zlib.crc32(content),
        "bytes": len(content),
        "palpate": listing["palpate"],
        # Text, so that its numbers stay as they are.
        "settings": json.dumps(listing["settings"]),
        "entry": json.dumps(entry, ensure_ascii=False),
    }
    store.write(job.path, content)
    store.write(f"{job.path}.json", json.dumps(record).encode())


def _join(
    client: distributed.Client, objects: Sequence[Sequence[_Job]], format: Format, progress: Progress | None
) -> list[dict[str, str]]:
    """Puts the parts of each object together, on the workers."""
    import distributed

    entries: dict[int, dict[str, str]] = {}
    waiting = dict.fromkeys(range(len(objects)), 0)
    while waiting:
        futures = {}
        for number, attempt in waiting.items():
            shards = list(objects[number])
            key = (f"join-{shards[0].digest}", format, uuid.uuid4().hex, attempt)
            futures[client.submit(_put_together, shards, format, key=key, pure=False)] = number
        for future in distributed.as_completed(futures):
            number = futures[future]
            try:
                entries[number] = future.result()
            except (distributed.KilledWorker, distributed.client.FutureCancelledError):
                waiting[number] += 1
                if waiting[number] >= ATTEMPTS:
                    raise
            else:
                del waiting[number]
            if progress is not None:
                progress("joining", len(entries), len(objects))
    return [entries[number] for number in range(len(objects))]


def _put_together(shards: list[_Job], format: Format) -> dict[str, str]:
    """The file of one object from its parts; what `dataset.json` states about it. Runs on a worker."""
    store = _Store(shards[0].target)
    name = shards[0].name
    pieces, records = [], []
    for job in shards:
        record, piece = _record(store, job), store.read(job.path)
        if record is None or piece is None or zlib.crc32(piece) != record["crc32"]:
            store.remove(f"{job.path}.json")
            raise InputError(f"{store.path(job.path)}: damaged since it was captured. Repeat the call, which captures it again.")
        pieces.append(piece)
        records.append(record)
    content = b"".join(pieces)
    store.write(f"{name}.txt", content)
    if format == "parquet":
        with tempfile.TemporaryDirectory() as directory:
            (Path(directory) / f"{name}.txt").write_bytes(content)
            table = DataSet.read(directory).to_pandas().astype({"object": str})
        store.write(f"{name}.parquet", table.to_parquet(index=False))
    entry = json.loads(records[0]["entry"])
    entries = [json.loads(record["entry"]) for record in records]
    entry["approaches"] = sum(part["approaches"] for part in entries)
    # Each mesh is an object of one instance, and so of one file.
    entry["pools"] = [{"touches": sum(part["pools"][0]["touches"] for part in entries), "crc32": zlib.crc32(content)}]
    return {**records[0], "entry": json.dumps(entry, ensure_ascii=False)}


def train(
    client: distributed.Client,
    directory: str | os.PathLike[str],
    *,
    descriptor: str = "curvature",
    rounds: int = 30,
    parameters: Mapping[str, object] | None = None,
) -> Ensemble:
    """Trains XGBoost over the cluster on full touches that `capture` wrote as Parquet too, and imports its model.

    The settings are those of the published method unless `parameters` say otherwise, by XGBoost's names; every object is
    weighted equally. Trees depend on how XGBoost divides the data among workers: they may differ from those of one machine,
    and from one run to the next.
    """
    import dask.dataframe as dd
    import numpy as np
    import pandas as pd
    import xgboost.dask as xgb

    url = os.fspath(directory)
    listing = json.loads(_Store(url).read("dataset.json") or b"{}")
    if not listing:
        raise InputError(f"{url}: no data set. Capture it first.")
    names = [entry["name"] for entry in listing["objects"]]
    counts = {entry["name"]: sum(pool["touches"] for pool in entry["pools"]) for entry in listing["objects"]}
    weights = {name: 1.0 / count for name, count in counts.items()}
    mean = sum(counts.values()) / len(names)
    poses = [f"{vector}_{axis}" for vector in ("direction", "alignment") for axis in "xyz"]
    columns = ["t1", "t2", "t3", *(poses if listing["settings"]["pose"] else [])]
    count = len(_features(pd.DataFrame({name: [] for name in columns}), descriptor).columns)

    def rows(table: Any) -> Any:
        found = _features(table, descriptor)
        found["label"] = table["object"].map({name: number for number, name in enumerate(names)}).astype("int32")
        found["weight"] = (table["object"].map(weights).astype("float64") * mean).astype("float32")
        return found

    meta = pd.DataFrame({**{f"f{i}": np.zeros(0, "f4") for i in range(count)}, "label": np.zeros(0, "i4"),
                         "weight": np.zeros(0, "f4")})
    table = dd.read_parquet([f"{url}/{name}.parquet" for name in names], columns=["object", *columns])
    # Kept on the workers before columns are chosen: XGBoost refuses the partitions of three expressions.
    table = table.map_partitions(rows, meta=meta).persist()
    matrix = xgb.DaskDMatrix(client, table[[f"f{i}" for i in range(count)]], table["label"], weight=table["weight"])
    settings = {
        "objective": "multi:softprob",
        "num_class": len(names),
        "tree_method": "hist",
        "max_depth": 6,
        "eta": 0.3,
        "base_score": 0.5,
        **(parameters or {}),
    }
    booster = xgb.train(client, settings, matrix, num_boost_round=rounds)["booster"]
    booster.set_attr(palpate_descriptor=descriptor, palpate_objects=json.dumps(names))
    return Ensemble.from_bytes(bytes(booster.save_raw("json")))


def _features(table: Any, descriptor: str) -> Any:
    """The features of a table's touches, by the code that runs on the chip."""
    import pandas as pd

    if len(table) == 0:
        features = DataSet.from_arrays([[0.0, 0.0, 0.0]], [0], ["x"]).features(descriptor)[:0]
    else:
        # Rows of an object keep their order.
        features = DataSet.from_pandas(table.assign(object="x")).features(descriptor)
    return pd.DataFrame(features, columns=[f"f{i}" for i in range(features.shape[1])], index=table.index)


def main(arguments: Sequence[str] | None = None) -> int:
    """The program: exit code 0 if everything is done, 1 if something was refused, 2 for wrong arguments."""
    parser = argparse.ArgumentParser(
        prog="python -m palpate.distributed",
        description="Capture touches over a Dask cluster. Repeat the command to go on with what was interrupted.",
        epilog="Examples:\n"
        "  python -m palpate.distributed meshes/ -o out --workers 8\n"
        "  python -m palpate.distributed meshes/ -o s3://bucket/out --scheduler tcp://head:8786",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("meshes", nargs="+", help="mesh files, directories of them, or built-in objects")
    parser.add_argument("-o", "--output", required=True, help="a directory of any store that fsspec knows")
    parser.add_argument("--touches", type=int, default=21_000, help="touches of each object (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="the seed of all that is random (default: %(default)s)")
    parser.add_argument("--approaches", action="store_true", help="keep every approach, also those that miss")
    parser.add_argument("--pose", action="store_true", help="keep the probe's direction and alignment")
    parser.add_argument("--format", choices=["text", "parquet"], default="text", help="parquet: tables beside the text")
    parser.add_argument("--touches-per-shard", type=int, default=100_000, help="default: %(default)s")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--scheduler", metavar="ADDRESS", help="the scheduler of a cluster that runs")
    where.add_argument("--workers", type=int, help="processes on this machine (default: one per core)")
    given = parser.parse_args(arguments)
    try:
        import dask
        import distributed
    except ImportError:
        print("Dask is not installed. Install it with `pip install 'palpate[distributed]'`.", file=sys.stderr)
        return 2
    show = sys.stderr.isatty()

    def progress(stage: str, done: int, total: int | None) -> None:
        if show:
            print(f"\r{stage}: {done} of {total}", end="", file=sys.stderr, flush=True)

    logging.basicConfig(format="%(message)s")
    logger.setLevel(logging.INFO)
    dask.config.set({"distributed.scheduler.worker-saturation": 1.0})
    with contextlib.ExitStack() as stack:
        where_: Any = given.scheduler
        if where_ is None:
            cluster = distributed.LocalCluster(n_workers=given.workers, threads_per_worker=1, dashboard_address=None)
            where_ = stack.enter_context(cluster)
        client = stack.enter_context(distributed.Client(where_))
        try:
            summary = capture(
                client,
                given.meshes,
                given.touches,
                given.output,
                seed=given.seed,
                approaches=given.approaches,
                pose=given.pose,
                format=given.format,
                touches_per_shard=given.touches_per_shard,
                progress=progress,
            )
        except PalpateError as error:
            print(error, file=sys.stderr)
            return 2 if isinstance(error, SettingError) else 1
    if show:
        print(file=sys.stderr)
    print(
        f"{summary.objects} objects are complete; {summary.done} shards were captured, {summary.kept} were there, "
        f"{summary.resubmitted} submissions were repeated, {len(summary.refused)} shards were refused"
    )
    return 1 if summary.refused else 0


if __name__ == "__main__":
    sys.exit(main())
