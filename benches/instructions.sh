#!/bin/sh
# Instructions of the engine's kernels, counted by callgrind, against those kept in
# benches/instructions.txt: a kernel that needs over 2 % more fails. Nothing is timed, so that a busy
# machine does not matter; compiler, C library and processor features do, and the file names them.
#
#   benches/instructions.sh            compare
#   benches/instructions.sh --update   write the file anew
set -e
cd "$(dirname "$0")/.."
file=benches/instructions.txt
command -v valgrind > /dev/null || { echo "skipped: valgrind is not installed"; exit 0; }
cargo build -q --release -p errsep-campaigns --bin kernels
program=target/release/kernels
counts=$(mktemp)
trap 'rm -f "$counts" "$counts.out"' EXIT
made_with="$(rustc --version), $(ldd --version | head -1 | sed 's/^ldd *//'), $(
    grep -o -w -m 1 -E 'avx512f|avx2' /proc/cpuinfo | sort | tail -1)"

count() { # kernel, times: instructions of the whole program
    RAYON_NUM_THREADS=1 valgrind --tool=callgrind --callgrind-out-file="$counts.out" \
        "$program" "$1" "$2" 2>&1 | awk '/Collected/ { print $4 }'
}

for run in compress:200 fold:50 solve:20 splines:20 pass:10 fit:5 fit-by-channel:5; do
    kernel=${run%:*}
    times=${run#*:}
    # What comes before the kernel is counted by running it no times.
    with=$(count "$kernel" "$times")
    without=$(count "$kernel" 0)
    echo "$kernel $(((with - without) / times))"
done > "$counts"

if [ "$1" = --update ]; then
    { echo "# $made_with"; cat "$counts"; } > "$file"
    cat "$file"
    exit 0
fi
kept_with=$(sed -n 's/^# //p' "$file")
[ "$kept_with" = "$made_with" ] ||
    echo "note: kept counts are of $kept_with; these of $made_with: differences may come from there"
awk -v tolerance=0.02 '
    FNR == NR { if ($1 != "#") kept[$1] = $2; next }
    {
        if (!($1 in kept)) { print $1 ": no count is kept, use --update"; bad = 1; next }
        change = $2 / kept[$1] - 1
        verdict = change > tolerance ? "MORE" : change < -tolerance ? "less: keep it with --update" : "same"
        printf "%-16s %10d kept %10d now %+6.1f %%  %s\n", $1, kept[$1], $2, 100 * change, verdict
        if (change > tolerance) bad = 1
    }
    END { exit bad }' "$file" "$counts"
