#!/bin/sh
# What the whole program costs, line by line (docs/validation/engine.md), beside its peers or the earlier way, in one
# run. Nothing else should run.
#
#   benches/peers/limits.sh [fit | reading | work | build] ...      default: all
#
# fit: the reversal fit beside Ceres and scipy, and one pass beside a pass that only evaluates residuals.
# reading: the whole command on CSV and Parquet beside polars and pyarrow, up to 10 million readings.
# work: circles beside a linear program, Monte Carlo beside the earlier way, diagnosis, trials, step-diagonal tests.
# build: the program from nothing, in a folder of its own.
set -e
cd "$(dirname "$0")/../.."
target="${CARGO_TARGET_DIR:-target}"
[ $# -gt 0 ] || set -- fit reading work build

for part in "$@"; do
    case "$part" in
    fit)
        benches/peers/reversal.sh 2000 20000 200000 2000000
        echo
        cargo run -q --release -p errsep-campaigns --bin kernel_limits
        ;;
    reading)
        benches/peers/reading.sh 200001 2500000
        ;;
    work)
        cargo build -q --release
        cargo bench -q -p errsep-campaigns --bench circle -- "circles of 36 points|all reference circles" > /dev/null
        cargo bench -q -p errsep-campaigns --bench machine_monte_carlo > /dev/null
        python3 benches/peers/limits.py "$target/release/errsep" "$target"
        ;;
    build)
        place=$(mktemp -d)
        trap 'rm -rf "$place"' EXIT
        cargo fetch -q
        begun=$(date +%s)
        cargo build -q --release --target-dir "$place"
        echo "first build from nothing: $(($(date +%s) - begun)) s, goal 120 s;" \
            "$(cargo tree -e no-dev --prefix none | sort -u | wc -l) crates"
        rm -rf "$place"
        ;;
    *)
        echo "$part is none of fit, reading, work, build" >&2
        exit 2
        ;;
    esac
    echo
done
