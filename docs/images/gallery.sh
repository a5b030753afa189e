#!/usr/bin/env bash
# Makes the pictures of docs/gallery.md: runs each command on data of this repository and takes the
# head of its report as a picture. Wants a Chromium as `chromium`, or in CHROMIUM.
set -euo pipefail
cd "$(dirname "$0")/../.."
errsep=${ERRSEP:-target/release/errsep}
chromium=${CHROMIUM:-chromium}
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT

picture() { # name height command...
    local name=$1 height=$2
    shift 2
    "$errsep" "$@" --out "$out/$name" --quiet
    "$chromium" --headless --no-sandbox --hide-scrollbars --window-size="960,$height" \
        --screenshot="docs/images/gallery/$name.png" "file://$out/$name/report.html" 2>/dev/null
}

picture reversal 1500 reversal fixtures/reversal/readings.csv --setup fixtures/reversal/setup.toml --simultaneous
"$errsep" simulate reversal --positions 61 --repeats 3 --both-directions --noise 0.1 --thickness 42 \
    --effect thermal-drift=1.2 --out "$out/drift" --quiet
picture diagnose 1900 diagnose "$out/drift/readings.csv" --setup "$out/drift/setup.toml"
picture positioning 1500 positioning fixtures/positioning/readings.csv
picture four-sensor 1500 four-sensor fixtures/four_sensor/data.csv --setup fixtures/four_sensor/setup.toml
picture machine 1500 machine fixtures/nistir6868/machine.toml predict fixtures/nistir6868/holes.csv
picture anova 1500 anova fixtures/nistir6868/replicates.csv
"$errsep" simulate circle --positions 180 --lobe 3:2.5 --noise 0.3 --out "$out/lobes" --quiet
picture circle 1700 circle "$out/lobes/points.csv"
