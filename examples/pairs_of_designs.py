#!/usr/bin/env python3
"""Pairs of effects that some designs of a reversal confuse and others tell apart, over machines drawn at random.

    examples/pairs_of_designs.py [ERRSEP]

Slopes are drawn between 20 and 1000 urad (even in their logarithm, either sign), the cone among -20, 0 and 20;
`errsep plan` works out the certificate of every design (noise 0.05 um, 300 mm, 41 positions, three repeats in both
directions, forms of 1 um). A pair is confused where the certificate says so, told apart where both are seen and it does not.
"""
import collections
import json
import pathlib
import random
import subprocess
import sys
import tempfile

MACHINES = 40
SIXTEEN = [f"{phi}/{theta}" for phi in (0, 90, 180, 270) for theta in (0, 90, 180, 270)]
DESIGNS = {
    "4": [c for c in SIXTEEN if c.split("/")[0] in ("0", "180") and c.split("/")[1] in ("0", "180")],
    "8": [c for c in SIXTEEN if c.split("/")[1] in ("0", "180")],
    "8, near and far every 90°": [c for c in SIXTEEN if c.split("/")[0] in ("0", "180")],
    "16": SIXTEEN,
}


def planned(errsep, slopes):
    text = f"""noise = 0.05
travel = 300.0
positions = 41
repeats = 3
both_directions = true
slopes = {slopes}
forms = [1.0, 1.0]
wanted = ["alpha_h"]
"""
    for name, channels in DESIGNS.items():
        text += f'[[design]]\nname = "{name}"\nchannels = "{",".join(channels)}"\n'
    with tempfile.TemporaryDirectory() as folder:
        plan = pathlib.Path(folder) / "plan.toml"
        plan.write_text(text)
        done = subprocess.run([errsep, "plan", plan, "--format", "json"], capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stderr)
    return json.loads(done.stdout)["designs"]


def main():
    errsep = sys.argv[1] if len(sys.argv) > 1 else "errsep"
    draw = random.Random(15)
    size = lambda: draw.choice([-1, 1]) * 10 ** draw.uniform(1.3, 3.0)
    counts = collections.defaultdict(collections.Counter)
    for _ in range(MACHINES):
        slopes = [size() for _ in range(4)] + [draw.choice([0.0, 20.0, -20.0])]
        confused, seen = {}, {}
        for design in planned(errsep, slopes):
            confused[design["name"]] = {tuple(sorted(pair["effects"])) for pair in design["confused"]}
            seen[design["name"]] = {e["effect"] for e in design["effects"] if e["detectable"] is not None}
        for pair in set().union(*confused.values()):
            for name in DESIGNS:
                if pair in confused[name]:
                    counts[pair][name] += 1
                elif not set(pair) <= seen[name]:
                    counts[pair][name, "unseen"] += 1
            four = pair in confused["4"]
            counts[pair]["only 4"] += four and pair not in confused["8"] and set(pair) <= seen["8"]
            counts[pair]["machines"] += 1
    print("| pair | machines | " + " | ".join(DESIGNS) + " | confused by 4, told apart by 8 |")
    print("|---" * (len(DESIGNS) + 3) + "|")
    for pair, own in sorted(counts.items(), key=lambda c: (-c[1]["only 4"], -c[1]["4"], c[0])):
        cells = []
        for name in DESIGNS:
            unseen = own[name, "unseen"]
            cells.append(f"{own[name]}" + (f" ({unseen} not seen)" if unseen else ""))
        words = " / ".join(f"`{effect}`" for effect in pair)
        print(f"| {words} | {own['machines']} | " + " | ".join(cells) + f" | {own['only 4']} |")


main()
