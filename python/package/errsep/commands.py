"""The commands as functions. Each takes what the command takes and returns its answer."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from . import _errsep
from ._inputs import Call, Columns
from .errors import Error, NotDetermined
from .result import Result

#: A table: a path, CSV text, a dictionary of columns, an array, or a table of another package.
Table = Any
#: A set-up: a dictionary, TOML text or a path.
Setup = Mapping[str, Any] | str | bytes | os.PathLike[str]
#: Names and units of columns: ``{"x": "z_mm:mm"}`` or ``"x=z_mm:mm"``.
ColumnMap = Mapping[str, str] | str

_REVERSAL: Columns = {5: ("x", "1A", "1B", "2A", "2B"), 3: ("x", "1A", "2B")}
_FOURIER: Columns = {3: ("x", "m1", "m2"), 4: ("x", "m1", "m2", "m3")}
_FOUR_SENSOR: Columns = {5: ("x", "m1", "m2", "m3", "m4")}
_POINTS: Columns = {2: ("x", "y")}
_PROFILE: Columns = {2: ("x", "deviation")}


def _answer(call: Call, threads: int | None) -> Result:
    try:
        answered = _errsep.call(call.words, call.inputs, threads)
    except Error as error:
        if error.file in call.tables and error.line is not None and error.line > 1:
            error.row = error.line - 2
        raise
    result = Result(call.words[0], answered)
    if result._answered.status == 0:
        return result
    what = _missing_law(result) or "; ".join(result.not_determined) or "the question"
    raise NotDetermined(f"not determined: {what}").with_result(result)


def _missing_law(result: Result) -> str:
    """Why there is no law where one was to be written."""
    law = result.to_dict().get("law") or {}
    return f"a law ({law['why']})" if law.get("found") is False else ""


def reversal(
    data: Table,
    setup: Setup | None = None,
    *,
    method: str | None = None,
    simultaneous: bool = False,
    with_: Sequence[str] = (),
    corrected: str | os.PathLike[str] | None = None,
    diagnose: bool = False,
    columns: ColumnMap | None = None,
    seed: int | None = None,
    threads: int | None = None,
) -> Result:
    """Tilt between slide and spindle, form of the slide and of the artefact, from a reversal.

    Parameters
    ----------
    data
        One row a reading (``channel``, ``x`` in mm, ``reading`` in µm; also ``repeat``, ``direction``,
        ``time``) or one column a channel (``x``, ``1A``, ``1B``, ``2A``, ``2B``). An array of five columns
        is the latter, one of three columns is ``x``, ``1A``, ``2B``.
    setup
        ``[artefact] thickness``, ``[indicator] noise``, ``[model] convention``, ``[columns]``.
    method
        ``"shear"``, ``"rotation"`` or ``"auto"``: how tilt is taken out, of the solution in stages.
    simultaneous
        Solve tilts and forms in one least-squares fit with exact geometry.
    with_
        Effects that are fitted along, such as ``["thermal-drift"]``; takes ``simultaneous``.
    corrected
        A file into which the readings without these effects are written.
    diagnose
        Say as well where and why model and readings disagree; takes ``simultaneous``.
    columns
        Names and units of the columns.

    >>> import errsep
    >>> data = errsep.simulate("reversal", seed=7)["data"]
    >>> answer = errsep.reversal(data)
    >>> abs(answer.tilts["alpha"].value - 40e-6) < 3 * answer.tilts["alpha"].expanded
    True
    """
    call = Call("reversal")
    call.positional(call.table(data, "data", _REVERSAL))
    _setup(call, setup)
    call.options({"method": method, "simultaneous": simultaneous, "with": list(with_) or None})
    call.options({"corrected": _path(corrected), "diagnose": diagnose})
    call.options({"columns": columns, "seed": seed})
    return _answer(call, threads)


def circle(
    points: Table,
    *,
    noise: float | None = None,
    nistir: bool = False,
    threads: int | None = None,
) -> Result:
    """The circle through points (``x``, ``y`` in mm), its uncertainty, circularity by four references.

    ``noise`` is the standard deviation of a point's radial deviation in µm, estimated from the
    residuals where it is absent; ``nistir`` adds the fit as NISTIR 6868 makes it.

    >>> import errsep, numpy
    >>> angle = numpy.linspace(0, 6, 12)
    >>> answer = errsep.circle({"x": 50 * numpy.cos(angle), "y": 50 * numpy.sin(angle)}, noise=1.0)
    >>> round(answer.quantities["fit.radius"].value, 9)
    50.0
    """
    call = Call("circle")
    call.positional(call.table(points, "points", _POINTS))
    call.options({"noise": noise, "nistir": nistir})
    return _answer(call, threads)


def four_sensor(data: Table, setup: Setup, *, threads: int | None = None) -> Result:
    """Straightness and tilt of a slide from four sensors on one surface.

    ``data`` has one row a slide position, ``x`` in mm and ``m1`` to ``m4`` in µm, or one row a reading
    (``sensor``, ``x``, ``reading``); ``setup`` has ``[sensors] spacing``.
    """
    call = Call("four-sensor")
    call.positional(call.table(data, "data", _FOUR_SENSOR))
    _setup(call, setup)
    return _answer(call, threads)


def fourier(
    *data: Table,
    setup: Setup | None = None,
    length: float | None = None,
    threads: int | None = None,
) -> Result:
    """Straightness by the Fourier two-sensor, three-sensor and hybrid methods.

    Each table has ``x`` (mm, even steps over the section), ``m1``, ``m2`` and perhaps ``m3`` (µm); a
    column ``spacing`` lets one table hold several scans. ``length`` is that of the section, mm.
    """
    call = Call("fourier")
    for one in data:
        call.positional(call.table(one, "data", _FOURIER))
    _setup(call, setup)
    call.option("length", length)
    return _answer(call, threads)


def step_diagonal(
    data: Table,
    setup: Setup | None = None,
    *,
    choose: bool = False,
    threads: int | None = None,
) -> Result:
    """Diagonal and step-diagonal displacement tests (ISO 230-6): what they determine and what not.

    ``data`` has ``diagonal``, ``sequence``, ``x``, ``y``, ``z`` (mm) and ``reading`` (µm); ``choose``
    adds which sets of sequences would determine which angular errors.
    """
    call = Call("step-diagonal")
    call.positional(call.table(data, "data"))
    _setup(call, setup)
    call.option("choose", choose)
    return _answer(call, threads)


def machine(
    model: Setup,
    action: str,
    data: Table | None = None,
    *,
    components: Table | None = None,
    points: Table | None = None,
    between: Sequence[tuple[str, str] | str] = (),
    first: Sequence[str] = (),
    second: Sequence[str] = (),
    along: str | None = None,
    centre: Sequence[float] | None = None,
    radius: float | None = None,
    count: int | None = None,
    plane: str | None = None,
    trials: int | None = None,
    independence: str | None = None,
    prediction: str | None = None,
    confidence: float | None = None,
    seed: int | None = None,
    threads: int | None = None,
) -> Result:
    """What the 21 component errors of a machine do to points, lengths, squareness, circularity.

    Parameters
    ----------
    model
        The machine: ``chain`` and ``[errors.…]`` under their ISO 230-1 names.
    action
        ``"predict"`` (``data``: points), ``"length"`` (points, ``between``), ``"squareness"`` (points,
        ``first``, ``second``, ``along``), ``"circularity"`` (``centre``, ``radius``, ``count``,
        ``plane``), ``"parts"`` (``data``: readings of parts or a list of such tables; ``points``).
    components
        Readings to which the entries with a ``degree`` are fitted.
    between
        Pairs of points: ``[("3", "9")]``.
    independence, prediction, confidence, trials, seed
        How uncertainty is propagated.
    """
    call = Call("machine")
    call.positional(call.toml(model, "model"))
    if components is not None:
        call.option("components", call.table(components, "components"))
    call.words.append(action)
    for one in data if isinstance(data, list) else [] if data is None else [data]:
        call.positional(call.table(one, "readings" if action == "parts" else "points"))
    if points is not None:
        call.option("points", call.table(points, "points"))
    pairs = (pair if isinstance(pair, str) else ":".join(pair) for pair in between)
    call.repeated("between", pairs)
    call.options({"first": list(first) or None, "second": list(second) or None, "along": along})
    call.options({"centre": None if centre is None else list(map(float, centre)), "radius": radius})
    call.options({"count": count, "plane": plane, "trials": trials, "independence": independence})
    call.options({"prediction": prediction, "confidence": confidence, "seed": seed})
    return _answer(call, threads)


def anova(
    replicates: Table,
    *,
    confidence: float | None = None,
    recipe: str | None = None,
    threads: int | None = None,
) -> Result:
    """Is it the manufacturing or the measuring that varies? Replicates with ``part`` and ``value``.

    ``recipe`` adds the figures as NISTIR 6868 forms them: ``"section-5.1"`` or ``"part-means"``.

    >>> import errsep
    >>> answer = errsep.anova({"part": [1, 1, 2, 2], "value": [1.0, 1.2, 3.0, 3.4]})
    >>> round(answer["features"][0]["analysis"]["f"], 2)
    88.2
    """
    call = Call("anova")
    call.positional(call.table(replicates, "replicates"))
    call.options({"confidence": confidence, "recipe": recipe})
    return _answer(call, threads)


def straightness(profile: Table, *, threads: int | None = None) -> Result:
    """Straightness of a profile (``x`` in mm, ``deviation`` in µm) by three reference lines.

    >>> import errsep
    >>> answer = errsep.straightness({"x": [0, 100, 200], "deviation": [0, 2, 0]})
    >>> answer["reference_lines"][2]["error"]
    {'value': 2.0, 'unit': 'um'}
    """
    call = Call("straightness")
    call.positional(call.table(profile, "profile", _PROFILE))
    return _answer(call, threads)


def diagnose(
    data: Table,
    setup: Setup | None = None,
    *,
    model: str | None = None,
    points: Table | None = None,
    columns: ColumnMap | None = None,
    without: Sequence[str] = (),
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
        ``"machine"``, ``"step-diagonal"``; columns and set-up tell where it is absent.
    points
        Points of the parts, for a machine.
    columns
        Names and units of the columns.
    without
        Effects left out of the catalogue.
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
    columns_of: Columns = {**_REVERSAL, **_POINTS} if model != "four-sensor" else _FOUR_SENSOR
    for one in data if isinstance(data, list) else [data]:
        call.positional(call.table(one, "data", columns_of))
    _setup(call, setup)
    call.options({"model": model, "columns": columns, "false_alarm": false_alarm, "prove": prove})
    call.options({"severity": severity, "learn": _path(learn), "seal": _path(seal)})
    call.option("law", law if isinstance(law, bool) else _path(law))
    if next is not None:
        call.option("next", call.table(next, "plan"))
    if points is not None:
        call.option("points", call.table(points, "points"))
    call.repeated("without", without)
    if effects is not None:
        call.option("effects", call.toml(effects, "effects"))
    call.option("seed", seed)
    return _answer(call, threads)


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
    call.positional(call.table(data, "data", {**_REVERSAL, **_POINTS}))
    call.option("seed", seed)
    return _answer(call, threads)


def plan(setup: Setup, *, seed: int | None = None, threads: int | None = None) -> Result:
    """What a planned reversal could show of every effect, before any reading is taken.

    ``setup`` has ``noise`` (µm), ``travel`` (mm), ``positions`` and perhaps ``repeats``,
    ``both_directions``, ``tilts`` (µrad), ``forms`` (µm RMS).
    """
    call = Call("plan")
    call.positional(call.toml(setup, "plan"))
    call.option("seed", seed)
    return _answer(call, threads)


def simulate(
    kind: str,
    model: Setup | None = None,
    *,
    effects: Mapping[str, float] | None = None,
    seed: int | None = None,
    points: Table | None = None,
    threads: int | None = None,
    **options: Any,
) -> Result:
    """Data with known truth: ``result["data"]`` and ``result["truth"]``, the set-up in ``result.setup``.

    Parameters
    ----------
    kind
        ``"reversal"``, ``"circle"``, ``"four-sensor"``, ``"fourier"``, ``"step-diagonal"``,
        ``"machine"``, ``"anova"``, ``"calibration-line"``.
    model, points
        Of a machine.
    effects
        Effects that are switched on, with their sizes: ``{"zero-jump": 0.2}``.
    options
        Options of ``errsep simulate KIND --help``, such as ``noise=0.02``.

    >>> import errsep
    >>> made = errsep.simulate("circle", noise=2.0, seed=3)
    >>> made["truth"]["noise"], len(made["data"]["x"])
    ({'value': 2.0, 'unit': 'um'}, 36)
    """
    call = Call("simulate", kind)
    if model is not None:
        call.positional(call.toml(model, "model"))
    if points is not None:
        call.option("points", call.table(points, "points"))
    call.options(options)
    sizes = (f"{name}={float(size)!r}" for name, size in (effects or {}).items())
    call.repeated("effect", sizes)
    call.option("seed", seed)
    return _answer(call, threads)


def _setup(call: Call, setup: Setup | None) -> None:
    if setup is not None:
        call.option("setup", call.toml(setup, "setup"))


def _path(path: str | os.PathLike[str] | None) -> str | None:
    return None if path is None else os.fspath(path)
