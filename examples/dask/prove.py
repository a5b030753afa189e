#!/usr/bin/env python3
"""Many campaigns on a Dask cluster of processes: how many a second, what the cluster loses to one process,
and that a batch killed over and over ends as one that was not.

    python/.venv/bin/python examples/dask/prove.py [--campaigns 10000] [--kills 20] [--workers 2]

Takes some gigabytes in a temporary folder (--folder). Ends with status 1 where a campaign is missing, there
twice, or has other bytes.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import errsep

#: Measurements that are simulated; campaigns beyond them read one of these with a seed of their own.
MEASUREMENTS = 200


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--campaigns", type=int, default=10_000)
    parser.add_argument("--positions", type=int, default=500, help="positions of each of the four traces")
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1, help="of the moments of the kills")
    parser.add_argument("--folder", type=Path, help="where the temporary folder is made")
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.child is not None:
        on_a_cluster(asked.child, asked.child / "killed", asked.workers)
        return 0
    with tempfile.TemporaryDirectory(dir=asked.folder) as temporary:
        return prove(Path(temporary), asked)


def prove(folder: Path, asked: argparse.Namespace) -> int:
    make(folder, asked.campaigns, asked.positions)
    n = asked.campaigns
    begin = time.perf_counter()
    errsep.batch(folder / "campaigns.csv", out=folder / "one", jobs=asked.workers)
    alone = time.perf_counter() - begin
    print(f"one process, {asked.workers} threads: {alone:.1f} s, {n / alone:.0f} campaigns a second")
    shared = on_a_cluster(folder, folder / "cluster", asked.workers)
    print(
        f"cluster, {asked.workers} processes: {shared:.1f} s without its start, {n / shared:.0f} campaigns a "
        f"second, loses {100 * (1 - alone / shared):.0f} %"
    )
    kills = killed(folder, asked, shared)
    last = on_a_cluster(folder, folder / "killed", asked.workers)
    print(f"killed {kills} times, then {last:.1f} s to the end")
    ids = [row["id"] for row in errsep.Batch(folder / "killed", (n, 0, 0), None)]
    wrong = (
        [] if ids == [f"c{k}" for k in range(n)] else ["campaigns are missing, twice there or out of order"]
    )
    for out in ("cluster", "killed"):
        wrong += [f"{out}: {name} differs" for name in different(folder / "one", folder / out)]
    print("\n".join(wrong) or f"{n} campaigns, each once, the same bytes in all three folders")
    return 1 if wrong else 0


def make(folder: Path, campaigns: int, positions: int) -> None:
    """The list and its files: reversals with forms, noise and tilt of their own."""
    for k in range(min(campaigns, MEASUREMENTS)):
        made = errsep.simulate("reversal", positions=positions, thickness=42, seed=k, alpha=k % 80)
        made.report(folder / "made", force=True)
        (folder / "made" / "readings.csv").rename(folder / f"{k}.csv")
    (folder / "setup.toml").write_text("[artefact]\nthickness = 42\n")
    lines = ["id,command,data,setup,options"]
    for k in range(campaigns):
        lines.append(f"c{k},reversal,{k % MEASUREMENTS}.csv,setup.toml,--simultaneous --seed {k}")
    (folder / "campaigns.csv").write_text("\n".join(lines) + "\n")


def on_a_cluster(folder: Path, out: Path, workers: int) -> float:
    """The seconds of a batch on a cluster of processes that has started."""
    from distributed import Client, LocalCluster

    with (
        LocalCluster(
            n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        Client(cluster) as client,
    ):
        client.wait_for_workers(workers)
        begin = time.perf_counter()
        errsep.batch(folder / "campaigns.csv", client, out)
        return time.perf_counter() - begin


def killed(folder: Path, asked: argparse.Namespace, whole: float) -> int:
    """Kills the cluster and the process that feeds it, at moments spread over half of what a run takes."""
    choice = random.Random(asked.seed)
    kills = 0
    while kills < asked.kills:
        words = [sys.executable, __file__, "--child", str(folder), "--workers", str(asked.workers)]
        child = subprocess.Popen(words, start_new_session=True, stderr=subprocess.DEVNULL)
        before = at_work(folder / "killed")
        # From the first row that is new on, so that every run comes further.
        while child.poll() is None and at_work(folder / "killed") == before:
            time.sleep(0.02)
        time.sleep(choice.uniform(0, 0.5 * whole / asked.kills))
        if child.poll() is not None:
            print(f"done after {kills} kills")
            break
        os.killpg(child.pid, signal.SIGKILL)
        child.wait()
        kills += 1
    return kills


def at_work(out: Path) -> int:
    """Bytes of rows that are there."""
    places = [*out.glob("part-*.ndjson"), *out.glob(".journal-*")]
    total = 0
    for place in places:
        try:
            total += place.stat().st_size
        except FileNotFoundError:  # A journal whose part has just come.
            continue
    return total


def different(one: Path, other: Path) -> list[str]:
    """The parts in which two folders differ."""
    names = {path.name for folder in (one, other) for path in folder.glob("part-*")}
    differs = lambda name: (  # noqa: E731
        not (one / name).exists()
        or not (other / name).exists()
        or (one / name).read_bytes() != (other / name).read_bytes()
    )
    return sorted(name for name in names if differs(name))


if __name__ == "__main__":
    sys.exit(main())
