"""Times commands on one table, as CSV and as Parquet: the least of five runs, of the process and its children alone."""

import os
import subprocess
import sys
import time

data, errsep = sys.argv[1:]
rows = sum(1 for line in open(data) if not line.startswith("#")) - 1

PEER = """
import sys, time, resource
{library}
best = None
for _ in range(5):
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_SELF)
    {call}
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


def peer(what, library, call, path):
    program = PEER.format(library=library, call=call)
    done = subprocess.run([sys.executable, "-c", program, path], capture_output=True, text=True)
    if done.returncode == 0:
        row(f"{what}, its imports not counted in seconds", map(float, done.stdout.split()))
    else:
        print(f"| {rows} | {what}: it is not there | | | |")


def commands(path, kind):
    simultaneous = [errsep, "reversal", path, "--simultaneous"]
    row(f"errsep reversal --simultaneous, {kind}", min(run(simultaneous) for _ in range(5)))
    row(f"errsep reversal (staged), {kind}", min(run([errsep, "reversal", path]) for _ in range(5)))


commands(data, "CSV")
read_csv = 'polars.read_csv(sys.argv[1], comment_prefix="#")'
peer("polars reads the CSV", "import polars", read_csv, data)

columns = data.removesuffix(".csv") + ".parquet"
converted = f"""
import polars
polars.read_csv({data!r}, comment_prefix="#").write_parquet({columns!r}, compression="snappy")
"""
if subprocess.run([sys.executable, "-c", converted], capture_output=True).returncode == 0:
    try:
        commands(columns, "Parquet")
        read = "pyarrow.parquet.read_table(sys.argv[1])"
        peer("pyarrow reads the Parquet", "import pyarrow.parquet", read, columns)
    finally:
        os.remove(columns)
