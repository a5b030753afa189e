#!/bin/sh
# The reversal fit beside Ceres and scipy: same readings, same model, same minimum, in one run.
#
#   benches/peers/reversal.sh [readings a channel ...]      default: 2000 20000 200000
#
# 60 interior knots for each of three forms, exact rotation and thickness shift, four channels.
# scipy is installed into a virtual environment (PEERS, default target/peers), Ceres comes from
# Debian's package libceres-dev and is installed where this runs as root; without one of them its
# lines are missing and the table says so. SCIPY_SECONDS (default 300) is when scipy is given up.
# The peers hold the gauge by rows of a weight: with a light one they are faster and leave the
# minimum at the sixth digit of the cost, with the heavy one they reach it.
# Memory: ours beyond the data in memory, the others' of the whole process, with scipy's imports.
set -e
cd "$(dirname "$0")/../.."
place="${PEERS:-target/peers}"
limit="${SCIPY_SECONDS:-300}"
[ $# -gt 0 ] || set -- 2000 20000 200000
mkdir -p "$place"
if [ ! -x "$place/bin/python" ]; then
    { python3 -m venv "$place" && "$place/bin/pip" install -q scipy; } ||
        echo "scipy could not be installed"
fi
if [ ! -e /usr/include/ceres/ceres.h ] && [ "$(id -u)" = 0 ]; then
    { apt-get update -q && apt-get install -y -q libceres-dev; } > "$place/apt.log" 2>&1 ||
        echo "libceres-dev could not be installed, see $place/apt.log"
fi
if [ -e /usr/include/ceres/ceres.h ]; then
    c++ -O3 -march=native -std=c++17 -I/usr/include/eigen3 benches/peers/reversal.cc \
        -o "$place/reversal_ceres" -lceres -lglog
fi
cargo build -q --release -p errsep-campaigns --bin peer_reversal

echo "processors: $(nproc), load when begun:$(cut -d' ' -f1-3 /proc/loadavg | sed 's/^/ /')"
[ ! -x "$place/reversal_ceres" ] ||
    echo "Ceres $(dpkg-query -W -f '${Version}' libceres-dev 2> /dev/null || echo 'of this machine')"
"$place/bin/python" -c "import scipy; print('scipy', scipy.__version__)" 2> /dev/null || true
data=$(mktemp)
trap 'rm -f "$data" "$data.ours" "$data.ours.equal"' EXIT
echo
echo "| readings a channel | solver | seconds | of all processors | MB | cost against ours | passes | largest tilt difference, rad |"
echo "|---|---|---|---|---|---|---|---|"
row() { # readings, words; line: name seconds processor memory cost passes tilts
    awk -v n="$1" -v what="$2" '
        FNR == NR { cost = $5; for (k = 7; k <= 9; k++) tilt[k] = $k; next }
        NF < 5 { printf "| %s | %s | %s %s %s s | | | | | |\n", n, what, $2, $3, $4; next }
        {
            worst = 0
            for (k = 7; k <= 9; k++) {
                d = $k - tilt[k]
                if (d < 0) d = -d
                if (d > worst) worst = d
            }
            printf "| %s | %s | %s | %s | %s | %+.1e | %s | %.0e |\n", n, what, $2, $3, $4, $5 / cost - 1, $6, worst
        }' "$data.ours.equal" -
}
for n in "$@"; do
    target/release/peer_reversal "$n" "$data" > "$data.ours"
    grep '^equal' "$data.ours" > "$data.ours.equal"
    row "$n" "ours, equal noise" < "$data.ours.equal"
    grep '^by-channel' "$data.ours" | row "$n" "ours, noise estimated by channel"
    if [ -x "$place/reversal_ceres" ]; then
        "$place/reversal_ceres" "$data" 2 1e-6 1e3 | row "$n" "Ceres, default tolerance, light gauge"
        "$place/reversal_ceres" "$data" 2 1e-12 3e5 | row "$n" "Ceres, to the minimum"
    else
        echo "| $n | Ceres is not there | | | | | | |"
    fi
    if "$place/bin/python" -c "import scipy" 2> /dev/null; then
        "$place/bin/python" benches/peers/reversal.py "$data" "$limit" |
            row "$n" "scipy least_squares (trf, sparse)"
    else
        echo "| $n | scipy is not there | | | | | | |"
    fi
done
