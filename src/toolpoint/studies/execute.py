"""A function over many points: serial or on Dask workers; failures kept as results, finished chunks kept on disk.

A finished chunk is a file; a study started again with the same folder computes only what is missing. A worker that
dies loses nothing but its running chunk, which runs again; a point that kills its worker every time is found, reported
as failed, and the rest goes on.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import tempfile
import time
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from toolpoint._check import Array, ToolpointError, count, fail, positive
from toolpoint._notebook import NotebookText
from toolpoint._threads import available_threads, run_side_by_side

Values = Mapping[str, Array]
Function = Callable[[Any], Mapping[str, Any]]
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Outcome:
    """Outcome of one point: named arrays, or the reason why there are none, and the seconds it took."""

    values: Values | None
    failure: str = ""
    seconds: float = 0.0


Chunk = list[tuple[int, Outcome]]


class Engine(Protocol):
    """Runs chunks of points and yields their outcomes as they finish."""

    def run(self, function: Function, points: Sequence[Any], todo: list[int], *, seconds: float) -> Iterator[Chunk]:
        """Yield lists of (index, outcome) until all of `todo` is done; chunks take about `seconds`."""
        ...


@dataclass(frozen=True)
class Serial:
    """Engine of this process: one point after the other.

    Examples
    --------
    >>> result = execute(lambda point: {"square": point**2}, [1, 2, 3], Serial())
    >>> [int(outcome.values["square"]) for outcome in result.outcomes]
    [1, 4, 9]
    """

    def run(self, function: Function, points: Sequence[Any], todo: list[int], *, seconds: float) -> Iterator[Chunk]:
        """Yield chunks of about `seconds`; see `Engine`."""
        chunk: Chunk = []
        start = time.perf_counter()
        for index in todo:
            chunk.append((index, evaluate(function, points[index])))
            # Chunks are ended by the clock: points may take very different times.
            if time.perf_counter() - start >= seconds:
                yield chunk
                chunk, start = [], time.perf_counter()
        if chunk:
            yield chunk


@dataclass(frozen=True)
class Threads:
    """Engine of threads of this process, for functions whose time goes into compiled kernels; as many as cores are free.

    Examples
    --------
    >>> result = execute(lambda point: {"square": point**2}, [1, 2, 3], Threads())
    >>> [int(outcome.values["square"]) for outcome in result.outcomes]
    [1, 4, 9]
    """

    def run(self, function: Function, points: Sequence[Any], todo: list[int], *, seconds: float) -> Iterator[Chunk]:
        """Yield chunks of about `seconds`; see `Engine`."""
        threads = available_threads()
        if threads == 1:
            yield from Serial().run(function, points, todo, seconds=seconds)
            return
        size, place = threads, 0
        while place < len(todo):
            part, start = todo[place:place + size], time.perf_counter()
            outcomes = run_side_by_side(lambda index: evaluate(function, points[index]), part, threads)
            yield list(zip(part, outcomes, strict=True))
            place += len(part)
            # Points may take very different times: the next chunk is sized by the last one.
            rate = len(part) / max(time.perf_counter() - start, 1e-6)
            size = max(threads, min(int(rate * seconds), 8 * size))


@dataclass(frozen=True)
class Dask:
    """Engine of Dask workers: processes on this machine, or those of a scheduler.

    Parameters
    ----------
    workers : int
        Processes on this machine, one thread each; ignored with an `address`.
    address : str, optional
        Address of a running scheduler, e.g. ``tcp://10.0.0.5:8786``; it must be a network that you trust.

    Examples
    --------
    >>> Dask(workers=4).address is None  # processes of this machine
    True
    """

    workers: int = 2
    address: str | None = None

    def run(self, function: Function, points: Sequence[Any], todo: list[int], *, seconds: float) -> Iterator[Chunk]:
        """Yield chunks as workers finish them; see `Engine`."""
        client, cluster = self._connected()
        try:
            yield from _run_distributed(client, function, points, todo, seconds)
            if cluster is not None:
                # Closing while a killed worker is being started again fails inside the library.
                client.wait_for_workers(self.workers, timeout=60)
        finally:
            client.close()
            if cluster is not None:
                cluster.close()

    def _connected(self) -> tuple[Any, Any]:
        try:
            import dask
            from distributed import Client, LocalCluster
        except ImportError:
            fail("engine", "Dask is not installed", "this engine needs it", remedy="pip install 'toolpoint[cluster]'")
        if self.address is not None:
            return Client(self.address), None
        # The default trim threshold returns memory after every small solve, which then takes twice as long; and one
        # thread a process keeps BLAS from fighting over the cores.
        environment = {"MALLOC_TRIM_THRESHOLD_": str(2**27), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        dask.config.set({"distributed.nanny.pre-spawn-environ": environment, "distributed.scheduler.allowed-failures": 1})
        cluster = LocalCluster(n_workers=count("workers", self.workers), threads_per_worker=1, dashboard_address=None,
                               host="127.0.0.1", silence_logs=50)
        return Client(cluster), cluster


def choose_engine(workers: int = 0, address: str | None = None) -> Engine:
    """Return this process for no workers and no address of a scheduler, else Dask workers, see `Dask`.

    Examples
    --------
    >>> choose_engine()
    Serial()
    >>> choose_engine(workers=2)
    Dask(workers=2, address=None)
    """
    return Dask(workers, address) if workers or address else Serial()


def evaluate(function: Function, point: Any) -> Outcome:
    """Return the outcome of one point; an exception becomes a failure with its reason."""
    start = time.perf_counter()
    try:
        values = {name: np.asarray(value) for name, value in function(point).items()}
    except Exception as error:  # a failed point is a result, not the end of the study
        return Outcome(None, f"{type(error).__name__}: {error}", time.perf_counter() - start)
    return Outcome(values, "", time.perf_counter() - start)


def _evaluate_chunk(function: Function, points: Sequence[Any], indices: Sequence[int]) -> Chunk:
    return [(index, evaluate(function, point)) for index, point in zip(indices, points, strict=True)]


def _run_distributed(client: Any, function: Function, points: Sequence[Any], todo: list[int],
                     seconds: float) -> Iterator[Chunk]:
    from distributed import KilledWorker, as_completed

    def submit(indices: list[int]) -> Any:
        future = client.submit(_evaluate_chunk, function, [points[i] for i in indices], indices, pure=False)
        owners[future.key] = indices
        return future

    owners: dict[str, list[int]] = {}
    waiting, suspects = list(todo), list[int]()
    workers = max(1, len(client.scheduler_info()["workers"]))
    # Single points first: their time sets the size of the chunks.
    running = as_completed([submit([waiting.pop(0)]) for _ in range(min(workers, len(waiting)))])
    size = 1
    for future in running:
        indices = owners.pop(future.key)
        error = future.exception()
        if error is None:
            chunk: Chunk = future.result()
            size = _chunk_size(chunk, seconds, len(waiting), workers)
            yield chunk
        elif isinstance(error, KilledWorker):
            suspects += indices
        else:
            yield [(index, Outcome(None, f"{type(error).__name__}: {error}")) for index in indices]
        if waiting:
            running.add(submit([waiting.pop(0) for _ in range(min(size, len(waiting)))]))
    # A worker takes what else it holds down with it, so the points of lost chunks run again one at a time: only the one
    # that kills a worker when nothing else runs is to blame.
    for index in suspects:
        yield [_run_alone(client, function, points[index], index)]


def _run_alone(client: Any, function: Function, point: Any, index: int) -> tuple[int, Outcome]:
    from distributed import KilledWorker

    try:
        result: Chunk = client.submit(_evaluate_chunk, function, [point], [index], pure=False).result()
    except KilledWorker:
        return index, Outcome(None, "its worker process died each time it ran (out of memory, or a crash in compiled code)")
    return result[0]


def _chunk_size(chunk: Chunk, seconds: float, waiting: int, workers: int) -> int:
    each = max(sum(outcome.seconds for _, outcome in chunk) / len(chunk), 1e-6)
    return max(1, min(int(seconds / each), -(-waiting // (2 * workers))))


@dataclass(frozen=True)
class Execution(NotebookText):
    """All outcomes of a study, in the order of its points."""

    outcomes: tuple[Outcome, ...]
    resumed: int

    @property
    def failures(self) -> dict[int, str]:
        """Index and reason of every failed point."""
        return {i: outcome.failure for i, outcome in enumerate(self.outcomes) if outcome.values is None}

    def stacked(self, name: str) -> Array:
        """Return one value of all points as an array; not a number where a point failed."""
        good = next((o.values for o in self.outcomes if o.values is not None), None)
        if good is None:
            fail("stacked", "every point failed", "the first because: " + (self.outcomes[0].failure if self.outcomes else ""))
        empty = np.full(good[name].shape, np.nan)
        return np.stack([empty if o.values is None else o.values[name] for o in self.outcomes])

    def __repr__(self) -> str:
        return f"Execution({len(self.outcomes)} points, {len(self.failures)} failed, {self.resumed} taken from disk)"


def execute(
    function: Function, points: Sequence[Any], engine: Engine | None = None, *, folder: str | Path | None = None,
    progress: Progress | None = None, chunk_seconds: float = 1.0,
) -> Execution:
    """Return the outcomes of `function(point)` for all points.

    Parameters
    ----------
    function : callable
        Takes a point, returns a mapping of names to numbers or arrays. With Dask it must be importable or picklable.
    points : sequence
        Anything that JSON or `repr` distinguishes; with `folder` they identify the study.
    engine : Serial, Threads or Dask
        Serial where left out.
    folder : path, optional
        Where finished chunks are kept; a study that was interrupted goes on from there.
    progress : callable, optional
        Called with (done, all) after every chunk; with a `folder` that holds some, first of all with how many were kept.
    chunk_seconds : float
        About how long a chunk takes.

    Raises
    ------
    ToolpointError
        Where the folder holds another study, or a chunk in it cannot be read. Failed points do not raise: see
        `Execution.failures`.
    """
    positive("chunk_seconds", chunk_seconds)
    store = None if folder is None else _Store(Path(folder), _fingerprint(function, points))
    outcomes: dict[int, Outcome] = store.load() if store else {}
    resumed = len(outcomes)
    todo = [i for i in range(len(points)) if i not in outcomes]
    if progress and resumed:  # before anything is computed: how much was kept
        progress(resumed, len(points))
    for chunk in (engine or Serial()).run(function, points, todo, seconds=chunk_seconds) if todo else ():
        outcomes.update(chunk)
        if store:
            store.save(chunk)
        if progress:
            progress(len(outcomes), len(points))
    return Execution(tuple(outcomes[i] for i in range(len(points))), resumed)


def _fingerprint(function: Function, points: Sequence[Any]) -> str:
    name = f"{getattr(function, '__module__', '')}.{getattr(function, '__qualname__', repr(type(function)))}"
    identity = getattr(function, "identity", "")
    text = json.dumps([name, identity, len(points)]) + "".join(json.dumps(p, default=repr, sort_keys=True) for p in points)
    return hashlib.sha256(text.encode()).hexdigest()


class _Store:
    """Finished chunks in a folder, one archive of plain arrays each; nothing in it is ever executed."""

    def __init__(self, folder: Path, fingerprint: str) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        manifest = folder / "study.json"
        if not manifest.exists():
            _atomic(manifest, json.dumps({"fingerprint": fingerprint}).encode(), replace=False)
        if _fingerprint_of(manifest) != fingerprint:
            raise ToolpointError(f"folder: {folder} holds another study (other function or points); take an empty folder")

    def save(self, chunk: Chunk) -> None:
        arrays: dict[str, Any] = {}
        table = []
        for index, outcome in chunk:
            table.append({"index": index, "failure": outcome.failure, "seconds": outcome.seconds,
                          "failed": outcome.values is None})
            for name, value in (outcome.values or {}).items():
                arrays[f"{index}/{name}"] = value
        buffer = io.BytesIO()
        np.savez(buffer, table=np.frombuffer(json.dumps(table).encode(), np.uint8), **arrays)
        _atomic(self.folder / f"chunk-{chunk[0][0]:09d}.npz", buffer.getvalue())

    def load(self) -> dict[int, Outcome]:
        outcomes: dict[int, Outcome] = {}
        for path in sorted(self.folder.glob("chunk-*.npz")):
            try:
                with np.load(path, allow_pickle=False) as file:
                    values: dict[int, dict[str, Array]] = {}
                    for key in file.files:
                        index, slash, name = key.partition("/")
                        if slash:
                            values.setdefault(int(index), {})[name] = file[key]
                    table = json.loads(bytes(file["table"]))
            except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
                raise ToolpointError(f"folder: {path} cannot be read ({error}); delete this file, and only its points are "
                                     "computed again") from None
            for row in table:
                value = None if row["failed"] else values.get(row["index"], {})
                outcomes[row["index"]] = Outcome(value, row["failure"], row["seconds"])
        return outcomes


def _fingerprint_of(manifest: Path) -> str:
    try:
        return str(json.loads(manifest.read_text(encoding="utf-8"))["fingerprint"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ToolpointError(f"folder: {manifest} cannot be read ({error}); take an empty folder") from None


def _atomic(path: Path, content: bytes, *, replace: bool = True) -> None:
    """Write a file so that it is there whole or not at all; runs that write the same one at once do not meet.

    Without `replace` the first of them wins, and the others leave its file as it is.
    """
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=path.name, suffix=".part")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        if replace or not hasattr(os, "link"):
            os.replace(name, path)
        else:
            with contextlib.suppress(FileExistsError):
                os.link(name, path)
    finally:
        Path(name).unlink(missing_ok=True)
