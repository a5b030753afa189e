#!/bin/sh
# Digits and time on NIST's certified regression problems, this library beside scipy, in one run.
#
#   benches/peers/nist.sh [folder of the virtual environment, default target/peers]
#
# scipy is installed there if Python and a package index can be reached; without it the table has
# this library's columns only, and says so. The data sets are those of
# https://www.itl.nist.gov/div898/strd/nls/nls_main.shtml, in ../shared/data/nist_strd or in the
# folder nist_strd of the folder that ERRSEP_DATA names.
set -e
cd "$(dirname "$0")/../.."
data="${ERRSEP_DATA:-../shared/data}/nist_strd"
[ -d "$data" ] || { echo "skipped: no folder nist_strd, see ERRSEP_DATA"; exit 0; }
place="${1:-target/peers}"
if [ ! -x "$place/bin/python" ]; then
    python3 -m venv "$place" && "$place/bin/pip" install -q scipy || echo "scipy could not be installed"
fi
ours=$(mktemp)
trap 'rm -f "$ours"' EXIT
cargo build -q --release -p errsep-solvers --example certified_digits
target/release/examples/certified_digits > "$ours"
if "$place/bin/python" -c "import scipy" 2>/dev/null; then
    "$place/bin/python" benches/peers/nist.py "$data" "$ours"
else
    echo "scipy is not there: this library alone"
    cat "$ours"
fi
