"""Times commands on one table: the least of five runs, of the process and its children alone."""

import os
import subprocess
import sys
import time

data, errsep = sys.argv[1:]
rows = sum(1 for line in open(data) if not line.startswith("#")) - 1

POLARS = """
import sys, time, resource
import polars
best = None
for _ in range(5):
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_SELF)
    polars.read_csv(sys.argv[1], comment_prefix="#")
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_SELF)
    all_processors = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    best = min(best or (wall, all_processors), (wall, all_processors))
print(*best, after.ru_maxrss / 1024)
"""


def run(arguments):
    began = time.perf_counter()
    child = subprocess.Popen(arguments, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(child.pid, 0)
    if status != 0:
        sys.exit(f"{arguments} failed")
    return time.perf_counter() - began, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def row(what, figures):
    wall, processors, memory = figures
    print(f"| {rows} | {what} | {wall:.3f} | {processors:.3f} | {memory:.0f} |")


simultaneous = [errsep, "reversal", data, "--simultaneous"]
row("errsep reversal --simultaneous", min(run(simultaneous) for _ in range(5)))
row("errsep reversal (staged)", min(run([errsep, "reversal", data]) for _ in range(5)))
polars = subprocess.run([sys.executable, "-c", POLARS, data], capture_output=True, text=True)
if polars.returncode == 0:
    row("polars reads the file, its imports not counted in seconds", map(float, polars.stdout.split()))
else:
    print(f"| {rows} | polars is not there | | | |")
