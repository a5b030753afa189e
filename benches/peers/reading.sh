#!/bin/sh
# The whole command on a large CSV and the same as Parquet beside polars and pyarrow, which only read the
# file, in one run.
#
#   benches/peers/reading.sh [readings a channel ...]      default: 200001
#
# polars and pyarrow are installed into a virtual environment (PEERS, default target/peers); without them
# their lines are missing. Memory is the greatest of the process.
set -e
cd "$(dirname "$0")/../.."
place="${PEERS:-target/peers}"
[ $# -gt 0 ] || set -- 200001
mkdir -p "$place"
[ -x "$place/bin/python" ] || python3 -m venv "$place"
"$place/bin/python" -c "import polars, pyarrow" 2> /dev/null || "$place/bin/pip" install -q polars pyarrow ||
    echo "polars and pyarrow could not be installed"
cargo build -q --release --features parquet
echo "processors: $(nproc), load when begun:$(cut -d' ' -f1-3 /proc/loadavg | sed 's/^/ /')"
echo
echo "| readings | what | seconds | of all processors | MB |"
echo "|---|---|---|---|---|"
for n in "$@"; do
    data=$(mktemp --suffix=.csv)
    trap 'rm -f "$data"' EXIT
    target/release/errsep simulate reversal --positions "$n" > "$data"
    "$place/bin/python" benches/peers/reading.py "$data" target/release/errsep
    rm -f "$data"
done
