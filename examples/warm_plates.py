"""Plates on a measuring machine, each at a temperature of its own, made from the temperatures by none of the
product's formulas; what `errsep.diagnose` says of them is counted.

    python/.venv/bin/python examples/warm_plates.py CASES SEED

Two to five plates of aluminium, 5 × 5 points over 300 mm, measured four times in one clamping, 0.3 µm of
noise on every coordinate, clamped anywhere, turned by up to 1 mrad and shifted by up to 0.1 mm.
"""

from __future__ import annotations

import collections
import sys
from typing import Any

import numpy as np

import errsep

#: Aluminium, 1/K.
EXPANSION = 23.1e-6
SIDE = np.linspace(0.0, 300.0, 5)
NOISE = 0.3e-3
MACHINE = {"chain": "FXYZ", "part": {"align": "free"}}
SIZE = "candidates.part-temperature.parameters.scale-of-part-{}"


def plate(kelvins: float, generator: np.random.Generator, square: float = 0.0) -> dict[str, list[Any]]:
    """A table of a plate that is warmer than when it was calibrated; the Y axis leans by `square`, rad."""
    nominal = np.array([(x, y) for x in SIDE for y in SIDE])
    angle = generator.uniform(-1e-3, 1e-3)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    clamped = generator.uniform(0.0, 300.0, 2)
    lies = clamped + (nominal - clamped) * (1 + EXPANSION * kelvins)
    lies = lies @ turn.T + generator.uniform(-0.1, 0.1, 2)
    lies[:, 0] -= lies[:, 1] * np.tan(square)
    names = ("point", "nominal x", "nominal y", "measured x", "measured y", "replicate")
    table: dict[str, list[Any]] = {name: [] for name in names}
    for replicate in range(1, 5):
        measured = lies + generator.normal(0.0, NOISE, lies.shape)
        for k, (place, found) in enumerate(zip(nominal, measured, strict=True)):
            for name, value in zip(names, (f"H{k}", *place, *found, replicate), strict=True):
                table[name].append(value)
    return table


def temperatures(kind: str, generator: np.random.Generator) -> np.ndarray:
    """By how many kelvins the plates are warmer."""
    count = int(generator.integers(2, 6))
    sign = generator.choice([-1.0, 1.0])
    if kind == "alike":
        return np.full(count, sign * generator.uniform(0.2, 2.0))
    if kind == "one warm":
        return np.append(sign * generator.uniform(0.3, 1.5), np.zeros(count - 1))
    return generator.normal(0.0, 0.7, count) * (kind != "none")


def one(kind: str, seed: int) -> tuple[str, int, int]:
    """The verdict, and how many of the scales that it tells are within two standard uncertainties."""
    generator = np.random.default_rng(seed)
    kelvins = temperatures(kind, generator)
    square = generator.uniform(-1e-5, 1e-5) * (kind == "out of square")
    answer = errsep.diagnose([plate(warm, generator, square) for warm in kelvins], MACHINE, severity=0)
    verdict = answer["verdict"]
    named = " + ".join(sorted(verdict["effects"])) or verdict["kind"]
    if verdict["indistinguishable"]:
        named += ", in a group"
    within = told = 0
    if "part-temperature" in verdict["effects"]:
        told = len(kelvins)
        for part, warm in enumerate(kelvins, 1):
            size = answer.quantities[SIZE.format(part)]
            within += abs(size.value - EXPANSION * warm) <= 2 * size.std
    return named, within, told


def main(cases: int, seed: int) -> None:
    for kind in ("each its own", "alike", "one warm", "out of square", "none"):
        found = [one(kind, 100_000 * seed + case) for case in range(cases)]
        counts = collections.Counter(name for name, _, _ in found)
        within, told = (sum(each[k] for each in found) for k in (1, 2))
        print(f"{kind}: {dict(counts.most_common())}; {within} of {told} scales within 2 u", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
