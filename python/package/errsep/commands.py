"""The commands as functions. Each takes what the command takes and returns its answer."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from ._calls import (
    FOUR_SENSOR,
    FOURIER,
    POINTS,
    PROFILE,
    REVERSAL,
    ColumnMap,
    Setup,
    Table,
    answer,
    as_path,
    give_fit,
    give_setup,
)
from ._inputs import Call, Names, listed
from .result import Result


def reversal(
    data: Table,
    setup: Setup | None = None,
    *,
    method: str | None = None,
    simultaneous: bool = False,
    with_: Names = (),
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
        Effects that are fitted along, such as ``"thermal-drift"`` or ``["thermal-drift", "zero-jump"]``;
        takes ``simultaneous``.
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
    call.positional(call.table(data, "data", REVERSAL))
    give_setup(call, setup)
    call.options({"method": method, "simultaneous": simultaneous, "diagnose": diagnose})
    call.option("corrected", as_path(corrected))
    give_fit(call, with_, columns, seed)
    return answer(call, threads)


def circle(
    points: Table,
    *,
    noise: float | None = None,
    nistir: bool = False,
    with_: Names = (),
    columns: ColumnMap | None = None,
    seed: int | None = None,
    threads: int | None = None,
) -> Result:
    """The circle through points (``x``, ``y`` in mm), its uncertainty, circularity by four references.

    ``noise`` is the standard deviation of a point's radial deviation in µm, estimated from the
    residuals where it is absent; ``nistir`` adds the fit as NISTIR 6868 makes it; ``with_`` fits these
    effects of `diagnose` along; ``columns`` are names and units of the columns.

    >>> import errsep, numpy
    >>> angle = numpy.linspace(0, 6, 12)
    >>> answer = errsep.circle({"x": 50 * numpy.cos(angle), "y": 50 * numpy.sin(angle)}, noise=1.0)
    >>> round(answer.quantities["fit.radius"].value, 9)
    50.0
    """
    call = Call("circle")
    call.positional(call.table(points, "points", POINTS))
    call.options({"noise": noise, "nistir": nistir})
    give_fit(call, with_, columns, seed)
    return answer(call, threads)


def four_sensor(
    data: Table,
    setup: Setup,
    *,
    with_: Names = (),
    columns: ColumnMap | None = None,
    seed: int | None = None,
    threads: int | None = None,
) -> Result:
    """Straightness and tilt of a slide from four sensors on one surface.

    ``data`` has one row a slide position, ``x`` in mm and ``m1`` to ``m4`` in µm, or one row a reading
    (``sensor``, ``x``, ``reading``); ``setup`` has ``[sensors] spacing``; ``with_`` fits these effects of
    `diagnose` along; ``columns`` are names and units of the columns.
    """
    call = Call("four-sensor")
    call.positional(call.table(data, "data", FOUR_SENSOR))
    give_setup(call, setup)
    give_fit(call, with_, columns, seed)
    return answer(call, threads)


def fourier(
    *data: Table,
    setup: Setup | None = None,
    length: float | None = None,
    with_: Names = (),
    columns: ColumnMap | None = None,
    seed: int | None = None,
    threads: int | None = None,
) -> Result:
    """Straightness by the Fourier two-sensor, three-sensor and hybrid methods.

    Each table has ``x`` (mm, even steps over the section), ``m1``, ``m2`` and perhaps ``m3`` (µm); a
    column ``spacing`` lets one table hold several scans. ``length`` is that of the section, mm. ``with_``
    fits these effects of `diagnose` along, where all scans are in one table; ``columns`` are names and
    units of the columns.
    """
    call = Call("fourier")
    for one in data:
        call.positional(call.table(one, "data", FOURIER))
    give_setup(call, setup)
    call.option("length", length)
    give_fit(call, with_, columns, seed)
    return answer(call, threads)


def step_diagonal(
    data: Table,
    setup: Setup | None = None,
    *,
    choose: bool = False,
    with_: Names = (),
    columns: ColumnMap | None = None,
    seed: int | None = None,
    threads: int | None = None,
) -> Result:
    """Diagonal and step-diagonal displacement tests (ISO 230-6): what they determine and what not.

    ``data`` has ``diagonal``, ``sequence``, ``x``, ``y``, ``z`` (mm) and ``reading`` (µm); ``choose``
    adds which sets of sequences would determine which angular errors; ``with_`` fits these effects of
    `diagnose` along; ``columns`` are names and units of the columns.
    """
    call = Call("step-diagonal")
    call.positional(call.table(data, "data"))
    give_setup(call, setup)
    call.option("choose", choose)
    give_fit(call, with_, columns, seed)
    return answer(call, threads)


def machine(
    model: Setup,
    action: str,
    data: Table | None = None,
    *,
    components: Table | None = None,
    points: Table | None = None,
    columns: ColumnMap | None = None,
    between: Sequence[tuple[str, str] | str] | str = (),
    first: Names = (),
    second: Names = (),
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
    columns
        Names and units of the columns of the parts.
    between
        Pairs of points: ``[("3", "9")]`` or ``"3:9"``.
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
    call.option("columns", columns)
    pairs = [between] if isinstance(between, str) else between
    call.repeated("between", (pair if isinstance(pair, str) else ":".join(pair) for pair in pairs))
    call.options({"first": listed(first) or None, "second": listed(second) or None, "along": along})
    call.options({"centre": None if centre is None else list(map(float, centre)), "radius": radius})
    call.options({"count": count, "plane": plane, "trials": trials, "independence": independence})
    call.options({"prediction": prediction, "confidence": confidence, "seed": seed})
    return answer(call, threads)


def anova(
    replicates: Table,
    *,
    confidence: float | None = None,
    recipe: str | None = None,
    columns: ColumnMap | None = None,
    seed: int | None = None,
    threads: int | None = None,
) -> Result:
    """Is it the manufacturing or the measuring that varies? Replicates with ``part`` and ``value``.

    ``recipe`` adds the figures as NISTIR 6868 forms them: ``"section-5.1"`` or ``"part-means"``;
    ``columns`` are names and units of the columns.

    >>> import errsep
    >>> answer = errsep.anova({"part": [1, 1, 2, 2], "value": [1.0, 1.2, 3.0, 3.4]})
    >>> round(answer["features"][0]["analysis"]["f"], 2)
    88.2
    """
    call = Call("anova")
    call.positional(call.table(replicates, "replicates"))
    call.options({"confidence": confidence, "recipe": recipe, "columns": columns, "seed": seed})
    return answer(call, threads)


def straightness(
    profile: Table,
    *,
    of: str | None = None,
    columns: ColumnMap | None = None,
    seed: int | None = None,
    threads: int | None = None,
) -> Result:
    """Straightness of a profile (``x`` in mm, ``deviation`` in µm) by three reference lines.

    ``of`` is the column with the deviations where other columns stand beside it, such as ``"M"`` of the
    profiles of a reversal; ``columns`` are names and units of the columns.

    >>> import errsep
    >>> answer = errsep.straightness({"x": [0, 100, 200], "deviation": [0, 2, 0]})
    >>> answer["reference_lines"][2]["error"]
    {'value': 2.0, 'unit': 'um'}
    """
    call = Call("straightness")
    call.positional(call.table(profile, "profile", PROFILE))
    call.options({"of": of, "columns": columns, "seed": seed})
    return answer(call, threads)


def simulate(
    kind: str,
    model: Setup | None = None,
    *,
    effects: Mapping[str, float] | Names = (),
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
        Effects that are switched on, with their sizes: ``{"zero-jump": 0.2}`` or ``"zero-jump=0.2"``.
    options
        Options of ``errsep simulate KIND --help``, such as ``noise=0.02``; those that take several values
        take a list: ``lobe=["2:1.5", "3:0.8"]``, ``travel=[600, 500, 400]``.

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
    if isinstance(effects, Mapping):
        effects = [f"{name}={float(size)!r}" for name, size in effects.items()]
    call.repeated("effect", listed(effects))
    call.option("seed", seed)
    return answer(call, threads)
