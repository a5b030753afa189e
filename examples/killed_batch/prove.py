#!/usr/bin/env python3
"""A batch that is killed over and over ends complete, with the bytes of one that was not.

    cargo build --release
    examples/killed_batch/prove.py [--campaigns 10000] [--kills 20] [--positions 20] [target/release/errsep]

The campaigns are reversals of four traces, each file with tilts, forms and noise of its own, solved in
stages. Each run is killed (SIGKILL) at a moment drawn from the work that it still has. Needs Python alone;
ends with status 1 where a campaign is missing, there twice, or has other bytes.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("errsep", nargs="?", type=Path, default=Path("target/release/errsep"))
    parser.add_argument("--campaigns", type=int, default=10_000)
    parser.add_argument("--positions", type=int, default=20, help="of each of the four traces")
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1, help="of the campaigns and of the moments of the kills")
    parser.add_argument("--folder", type=Path, help="where the temporary folder is made")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=asked.folder) as temporary:
        return prove(Path(temporary), asked)


def prove(folder: Path, asked: argparse.Namespace) -> int:
    chance = random.Random(asked.seed)
    make(folder, asked.campaigns, asked.positions, chance)
    begin = time.perf_counter()
    start(folder, "whole", asked).wait()
    whole = time.perf_counter() - begin
    print(f"not killed: {whole:.1f} s, {asked.campaigns / whole:.0f} campaigns a second by {asked.jobs} jobs")
    cut_off = killed(folder, asked, whole, chance)
    begin = time.perf_counter()
    last = start(folder, "killed", asked).wait()
    rest = time.perf_counter() - begin
    print(f"killed {len(cut_off)} times, {cut_off} campaigns done at each, then {rest:.1f} s to the end")
    wrong = compare(folder, asked.campaigns)
    if last != 0:
        wrong.append(f"the last run ended with status {last}")
    if len(cut_off) != asked.kills:
        wrong.append(f"only {len(cut_off)} of {asked.kills} kills came before the end")
    print("\n".join(wrong) or f"{asked.campaigns} campaigns, each once, the same bytes")
    return 1 if wrong else 0


def make(folder: Path, campaigns: int, positions: int, chance: random.Random) -> None:
    """The list and its files."""
    lines = ["id,command,data"]
    for k in range(campaigns):
        alpha, beta, gamma = (chance.gauss(0, 0.05) for _ in range(3))  # µm a millimetre
        wave, phase = chance.uniform(0.5, 3), chance.uniform(0, math.tau)
        rows = ["channel,x,reading"]
        for channel, (a, b, c) in {"1A": (1, 1, 1), "1B": (-1, 1, -1), "2A": (1, -1, -1), "2B": (-1, -1, 1)}.items():
            for i in range(positions):
                x = 300 * i / (positions - 1)
                form = wave * math.sin(x / 40 + phase * a)
                rows.append(f"{channel},{x:.4f},{(a * alpha + b * beta + c * gamma) * x + form + chance.gauss(0, 0.05):.4f}")
        (folder / f"{k}.csv").write_text("\n".join(rows) + "\n")
        lines.append(f"c{k},reversal,{k}.csv")
    (folder / "campaigns.csv").write_text("\n".join(lines) + "\n")


def start(folder: Path, out: str, asked: argparse.Namespace) -> subprocess.Popen[bytes]:
    words = [asked.errsep, "batch", folder / "campaigns.csv", "--out", folder / out, "--quiet", "--jobs", asked.jobs]
    return subprocess.Popen([str(word) for word in words], stdout=subprocess.DEVNULL)


def killed(folder: Path, asked: argparse.Namespace, whole: float, chance: random.Random) -> list[int]:
    """Kills runs one after the other; how many campaigns were done at each kill."""
    done = []
    while len(done) < asked.kills:
        before = rows(folder / "killed")
        child = start(folder, "killed", asked)
        # From the first row that is new on, so that every run comes further.
        while child.poll() is None and rows(folder / "killed") == before:
            time.sleep(0.01)
        time.sleep(chance.uniform(0, 1.2 * whole / (asked.kills + 1)))
        if child.poll() is not None:
            break
        child.kill()
        child.wait()
        done.append(rows(folder / "killed"))
    return done


def rows(out: Path) -> int:
    """Rows that are there, in parts and in what is not yet a part."""
    total = 0
    for place in [*out.glob("part-*.ndjson"), *out.glob(".journal-*")]:
        try:
            total += sum(1 for line in place.read_bytes().split(b"\n") if line)
        except FileNotFoundError:  # A journal whose part has just come.
            continue
    return total


def compare(folder: Path, campaigns: int) -> list[str]:
    """What is wrong with the folder of the runs that were killed."""
    names = lambda out: sorted(place.name for place in (folder / out).glob("part-*"))  # noqa: E731
    if names("whole") != names("killed"):
        return ["the two folders have other parts"]
    ids, wrong = [], []
    for name in names("killed"):
        text = (folder / "killed" / name).read_bytes()
        if text != (folder / "whole" / name).read_bytes():
            wrong.append(f"{name} differs")
        ids += [json.loads(line)["id"] for line in text.splitlines()]
    if ids != [f"c{k}" for k in range(campaigns)]:
        wrong.append("campaigns are missing, there twice or out of order")
    return wrong


if __name__ == "__main__":
    sys.exit(main())
