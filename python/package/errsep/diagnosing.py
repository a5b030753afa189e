"""The commands about the gap between model and readings as functions."""

from __future__ import annotations

import os

from ._calls import (
    FOUR_SENSOR,
    POINTS,
    REVERSAL,
    ColumnMap,
    Setup,
    Table,
    answer,
    as_path,
    give_fit,
    give_setup,
)
from ._inputs import Call, Columns, Names, listed
from .result import Result


def diagnose(
    data: Table,
    setup: Setup | None = None,
    *,
    model: str | None = None,
    points: Table | None = None,
    columns: ColumnMap | None = None,
    without: Names = (),
    with_: Names = (),
    effects: Setup | None = None,
    learn: str | os.PathLike[str] | None = None,
    law: bool | str | os.PathLike[str] = False,
    seal: str | os.PathLike[str] | None = None,
    next: Table | None = None,
    false_alarm: float | None = None,
    severity: int | None = None,
    prove: int | None = None,
    seed: int | None = None,
    threads: int | None = None,
) -> Result:
    """Where the gap between model and readings lies, which effect causes it, how far it shrinks.

    Parameters
    ----------
    data, setup
        Those of the model's own command. Parts may come as a list of tables, a part each.
    model
        ``"reversal"``, ``"calibration-line"``, ``"circle"``, ``"four-sensor"``, ``"fourier"``,
        ``"machine"``, ``"step-diagonal"``, ``"turning-bar"``; columns and set-up tell where it is absent.
    points
        Points of the parts, for a machine.
    columns
        Names and units of the columns.
    without
        Effects left out of the catalogue.
    with_
        Seek nothing: fit these effects along with the model. The answer is that fit
        (``errsep.fit-with/1``), without a verdict.
    effects
        More effects for the catalogue: a dictionary, TOML text or a path.
    learn
        A file into which what no effect explains is written as an effect of its own, for ``effects``.
    law
        ``True``: seek a law (a formula) in what no effect explains; a file: write it there too, for
        ``effects``. Without a law to write that is `NotDetermined`, with the answer in its ``result``.
    seal, next
        A file into which is written what a further measurement will show, for `check`, and that
        measurement: its columns without the readings.
    false_alarm
        Probability of naming anything where nothing is there.
    severity
        Most rivals of a family that are drawn to say what else would have been given the same name.
    prove
        Number of sealed effects that are put in and diagnosed blind.
    """
    call = Call("diagnose")
    columns_of: Columns = {**REVERSAL, **POINTS} if model != "four-sensor" else FOUR_SENSOR
    for one in data if isinstance(data, list) else [data]:
        call.positional(call.table(one, "data", columns_of))
    give_setup(call, setup)
    give_fit(call, with_, columns, seed)
    call.options({"model": model, "false_alarm": false_alarm, "prove": prove})
    call.options({"severity": severity, "learn": as_path(learn), "seal": as_path(seal)})
    call.option("law", law if isinstance(law, bool) else as_path(law))
    if next is not None:
        call.option("next", call.table(next, "plan"))
    if points is not None:
        call.option("points", call.table(points, "points"))
    call.repeated("without", listed(without))
    if effects is not None:
        call.option("effects", call.toml(effects, "effects"))
    return answer(call, threads)


def check(
    sealed: str | os.PathLike[str],
    data: Table,
    *,
    seed: int | None = None,
    threads: int | None = None,
) -> Result:
    """Does a measurement show what was sealed before it was made, by ``diagnose(…, seal=, next=)``?

    A low score is an answer; a seal that was touched is an `InputError`.
    """
    call = Call("check")
    call.positional(os.fspath(sealed))
    call.positional(call.table(data, "data", {**REVERSAL, **POINTS}))
    call.option("seed", seed)
    return answer(call, threads)


def plan(setup: Setup, *, seed: int | None = None, threads: int | None = None) -> Result:
    """What a planned reversal could show of every effect, before any reading is taken.

    ``setup`` has ``noise`` (µm), ``travel`` (mm), ``positions`` and perhaps ``repeats``,
    ``both_directions``, ``tilts`` (µrad), ``forms`` (µm RMS).
    """
    call = Call("plan")
    call.positional(call.toml(setup, "plan"))
    call.option("seed", seed)
    return answer(call, threads)
