"""Times whole commands and reads what `cargo bench` has measured; prints both as one table.

limits.py ERRSEP TARGET: the program and the folder of builds.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

errsep, target = sys.argv[1:]


def used(arguments, most_runs=3):
    """Least wall seconds of several runs with processor seconds and memory (MB) of the same."""
    best = None
    for _ in range(most_runs):
        began = time.perf_counter()
        child = subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        _, status, usage = os.wait4(child.pid, 0)
        wall = time.perf_counter() - began
        if status != 0:
            sys.exit(f"{' '.join(map(str, arguments))} failed")
        figures = wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024
        best = min(best or figures, figures)
        if wall > 20:
            break
    return best


def made(folder, name, *what):
    """A simulated table."""
    path = pathlib.Path(folder, name)
    with path.open("w") as file:
        subprocess.run([errsep, "simulate", *what], stdout=file, check=True)
    return path


def process(work, arguments, goal):
    wall, processors, memory = used(arguments)
    told = f"{wall:.3g} s, {memory:.0f} MB ({processors:.3g} s of all processors)"
    print(f"| {work} | {told} | | {goal} |", flush=True)


def estimates():
    """Median seconds of every benchmark, and how many things one run of it does."""
    found = {}
    for path in pathlib.Path(target, "criterion").rglob("new/benchmark.json"):
        about = json.loads(path.read_text())
        median = json.loads((path.parent / "estimates.json").read_text())["median"]
        throughput = about.get("throughput") or {}
        count = throughput.get("Elements", 1)
        found[about["full_id"]] = (median["point_estimate"] * 1e-9, count)
    return found


def seconds(figure):
    return "–" if figure is None else f"{1e3 * figure[0]:.3g} ms"


def rate(figure):
    return "–" if figure is None else f"{figure[1] / figure[0]:,.0f} a second".replace(",", " ")


def main():
    print("| work | errsep | beside it in the same run | goal |")
    print("|---|---|---|---|")
    bench = estimates()
    for name in ["oval", "noisy"]:
        goals = {1000: "5 ms", 3600: "15 ms", 14_400: "60 ms", 1_000_000: "5 s"}
        for points, goal in goals.items() if name == "oval" else [(36_000, "0.1 s")]:
            own = bench.get(f"all reference circles/{name}/{points}")
            peer = bench.get(
                f"all reference circles/{name}, linear program of the zone alone/{points}"
            )
            beside = f"linear program of the zone {seconds(peer)}" if peer else ""
            work = f"minimum zone, inscribed and circumscribed circle, {points} points, {name}"
            print(f"| {work} | {seconds(own)} | {beside} | {goal} |")
    circles = "circles of 36 points/"
    single = rate(bench.get(circles + "one by one"))
    batch = rate(bench.get(circles + "batch, threads 2"))
    print(f"| circles of 36 points, fit and uncertainty | {batch} | one by one {single} | 300 000 |")
    print(f"| the same, all four references | {rate(bench.get(circles + 'all four references'))} | | 50 000 a core |")
    for drawn, goal in [("Points", "300 000"), ("Scatter", "500 000")]:
        own = rate(bench.get(f"machine_monte_carlo/sampler, {drawn}, threads 2"))
        earlier = rate(bench.get(f"machine_monte_carlo/one by one, {drawn}, threads 1"))
        work = f"Monte Carlo of 21 errors, {drawn.lower()} drawn, two threads"
        print(f"| {work} | {own} | one by one on one thread {earlier} | {goal} |")
    with tempfile.TemporaryDirectory(prefix="errsep-limits-") as folder:
        commands(folder)


def commands(folder):
    named = made(folder, "named.csv", "reversal", "--positions", "150", "--repeats", "4", "--both-directions",
                 "--noise", "0.1", "--effect", "thermal-drift=1")
    unknown = made(folder, "unknown.csv", "reversal", "--positions", "150", "--repeats", "4",
                   "--both-directions", "--noise", "0.1", "--effect", "hysteresis=1")
    large = made(folder, "large.csv", "reversal", "--positions", "250000", "--noise", "0.1",
                 "--effect", "zero-jump=2")
    twice = made(folder, "twice.csv", "reversal", "--positions", "500000", "--noise", "0.1",
                 "--effect", "zero-jump=2")
    clean = made(folder, "clean.csv", "reversal", "--positions", "150", "--repeats", "4",
                 "--both-directions", "--noise", "0.05", "--seed", "2")
    bare = ["--severity", "0"]
    process("diagnosis of 4800 readings, named, without severity", [errsep, "diagnose", named, *bare], "0.3 s")
    process("the same with severity", [errsep, "diagnose", named], "1 s")
    hidden = [errsep, "diagnose", unknown, "--without", "hysteresis"]
    process("diagnosis of 4800 readings, unknown, without severity", [*hidden, *bare], "1 s")
    process("the same with severity", hidden, "3 s")
    process("diagnosis of 10⁶ readings, named", [errsep, "diagnose", large], "10 s, 1 GB")
    process("of 2 × 10⁶", [errsep, "diagnose", twice], "twice that")
    process("1000 trials (`--prove 1000`)", [errsep, "diagnose", clean, "--prove", "1000"], "30 s")
    for steps, goal in [(20, "0.02 s"), (100, "0.1 s")]:
        runs = made(folder, f"steps{steps}.csv", "step-diagonal", "--steps", str(steps))
        process(f"step-diagonal test, {steps} steps", [errsep, "step-diagonal", runs], goal)


main()
