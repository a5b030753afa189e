"""Many campaigns at once: in this process, or on the processes of a Dask cluster."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from . import _errsep
from ._inputs import as_csv, whole

#: A list of campaigns: a path, CSV text, a dictionary of columns, or a table of another package.
Table = Any


class Batch:
    """The answers of a batch: rows in the order of the list.

    Attributes
    ----------
    folder
        Where the parts are; a temporary folder, gone with this object, where none was given.
    campaigns, worked_out, failed
        How many campaigns the list has, how many were worked out by this call, how many have no answer.
    """

    def __init__(
        self, folder: Path, counts: tuple[int, int, int], temporary: tempfile.TemporaryDirectory[str] | None
    ) -> None:
        self.folder = folder
        self.campaigns, self.worked_out, self.failed = counts
        self._temporary = temporary

    def rows(self) -> Iterator[dict[str, Any]]:
        """The rows one by one: ``id``, ``key``, ``status``, ``exit``, ``message``, ``result``."""
        for part in sorted(self.folder.glob("part-*.ndjson")):
            with part.open(encoding="utf-8") as lines:
                for line in lines:
                    yield json.loads(line)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return self.rows()

    def __len__(self) -> int:
        return self.campaigns

    def to_dataframe(self) -> Any:
        """The rows as a pandas table, without the answers: ``id``, ``status``, ``exit``, ``message`` and
        a column for every quantity of the answers, such as ``alpha`` and ``alpha_std``."""
        import pandas

        told = ("id", "status", "exit", "message")
        rows = [
            {name: row[name] for name in told} | dict(_quantities("", row["result"] or {}))
            for row in self.rows()
        ]
        return pandas.DataFrame(rows)

    def __repr__(self) -> str:
        return (
            f"<errsep batch: {self.campaigns} campaigns, {self.worked_out} worked out now, "
            f"{self.failed} failed, in {self.folder}>"
        )


def _quantities(name: str, value: Any) -> Iterator[tuple[str, float]]:
    """Everything with a value and a unit, by its name in the answer."""
    if not isinstance(value, dict):
        return
    if "unit" in value and isinstance(value.get("value"), (int, float)):
        yield name, value["value"]
        if isinstance(value.get("std"), (int, float)):
            yield f"{name}_std", value["std"]
        return
    for key, inner in value.items():
        yield from _quantities(key if name in ("", "tilts") else f"{name}.{key}", inner)


def batch(
    frame: Table,
    client: Any = None,
    out: str | os.PathLike[str] | None = None,
    *,
    jobs: int | None = None,
    retry_failed: bool = False,
    verify: bool = False,
    parquet: bool = False,
    progress: Callable[[int, int], object] | None = None,
) -> Batch:
    """Works out many campaigns; what is done already in ``out`` is not worked out again.

    Parameters
    ----------
    frame
        A row a campaign: ``id``, ``command``, ``data`` and, as far as needed, ``setup``, ``options``, as
        ``errsep batch`` takes them. Files are relative to the list's folder, or to the working folder
        where the list is held in memory.
    client
        A ``dask.distributed.Client``: its workers do the work, at least 100 campaigns a task (200, but
        for the last). They must see the files and ``out`` under the same paths. Without one, the work is
        done in this process.
    out
        Folder of the answers, the same as that of ``errsep batch``. A cluster that is killed loses what
        it was at; called again, the batch goes on. It must be given with a client.
    jobs
        Campaigns at the same time: in this process, by default as many as there are cores, at most
        sixteen a core; in a task of a client, by default 1, so that each thread of a worker does one.
    retry_failed
        Try again what failed.
    verify
        Read every input again in place of trusting its size and time of change.
    parquet
        Write every part as Parquet too, with a column for every number of the answers.
    progress
        Called as ``progress(done, campaigns)`` after each part.

    >>> import errsep
    >>> answers = errsep.batch({"id": ["a"], "command": ["straightness"], "data": ["nowhere.csv"]})
    >>> [row["status"] for row in answers]
    ['failed']
    """
    if client is not None and out is None:
        raise TypeError("a client works on files: give out, a folder that all its workers see")
    if jobs is None:
        jobs = (os.cpu_count() or 1) if client is None else 1
    jobs = whole("jobs", jobs, 1)
    temporary = tempfile.TemporaryDirectory(prefix="errsep-") if out is None else None
    folder = Path(temporary.name if temporary is not None else os.fspath(out or "")).absolute()
    path, inputs = _list(frame)
    shared = _errsep.Shared(
        path, inputs, folder, jobs=jobs, retry_failed=retry_failed, verify=verify, parquet=parquet
    )
    try:
        tasks = shared.tasks()
        waiting = sum(count for _, count in tasks)
        done = 0
        for report, count in _worked(tasks, client):
            shared.take(report)
            done += count
            if progress is not None:
                progress(done, waiting)
        counts = shared.finish()
    finally:
        shared.close()
    return Batch(folder, counts, temporary)


def _list(frame: Table) -> tuple[str, list[tuple[str, bytes]]]:
    """The list's path, and its bytes where it is held in memory."""
    if isinstance(frame, (str, os.PathLike)) and not (isinstance(frame, str) and "\n" in frame):
        return os.path.abspath(frame), []
    # What stands in front of the name is what files are relative to.
    name = os.path.join(os.getcwd(), "<campaigns>")
    return name, [(name, as_csv(frame, {}))]


def _worked(tasks: list[tuple[str, int]], client: Any) -> Iterator[tuple[str, int]]:
    """The reports of tasks as they come in, each with the number of its campaigns."""
    if client is None:
        for task, count in tasks:
            yield _work(task), count
        return
    from distributed import as_completed

    # Each part is a file: a task that is lost with its worker is safely done again.
    futures = client.map(_work, [task for task, _ in tasks], pure=False, retries=3)
    counts = {future.key: count for future, (_, count) in zip(futures, tasks, strict=True)}
    try:
        for future, report in as_completed(futures, with_results=True):
            yield report, counts[future.key]
    finally:
        client.cancel(futures)


def _work(task: str) -> str:
    return _errsep.work(task)
