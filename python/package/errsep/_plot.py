"""Answers drawn with matplotlib: one axes each, the rest is in the report."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from .fit import Fit
    from .result import Result

#: Half the width of a 95 % band, in standard uncertainties of many degrees of freedom.
BAND = 1.96


def result(answer: Result, ax: Any) -> Any:
    """Draws an answer on the axes, new ones where there are none."""
    ax = _axes(ax)
    _DRAWN[answer.command](answer, ax)
    if ax.get_legend_handles_labels()[1]:
        ax.legend()
    return ax


def fit(found: Fit, ax: Any) -> Any:
    """Draws the residuals of a fit."""
    ax = _axes(ax)
    ax.axhline(0.0, color="0.7", linewidth=0.8)
    ax.plot(found.residuals, ".")
    ax.set(xlabel="residual number", ylabel="residual", title=found.ending)
    return ax


def _axes(ax: Any) -> Any:
    if ax is not None:
        return ax
    import matplotlib.pyplot

    return matplotlib.pyplot.subplots()[1]


def _line(ax: Any, table: Mapping[str, Any], y: str, std: str | None, label: str) -> None:
    x = table["x_mm"]
    (line,) = ax.plot(x, table[y], label=label)
    if std is not None:
        half = BAND * np.asarray(table[std])
        ax.fill_between(x, table[y] - half, table[y] + half, color=line.get_color(), alpha=0.25)


def _label(ax: Any, title: str, x: str = "x (mm)", y: str = "deviation (µm)") -> None:
    ax.set(title=title, xlabel=x, ylabel=y)


def _reversal(answer: Result, ax: Any) -> None:
    table = answer.tables["profiles"]
    for form in (name.removesuffix("_std_um") for name in table if name.endswith("_std_um")):
        _line(ax, table, f"{form}_um", f"{form}_std_um", form)
    _label(ax, "Forms of the slide and of the artefact, 95 % bands")


def _circle(answer: Result, ax: Any) -> None:
    table, of = answer.tables["deviations"], answer.quantities
    x, y = table["x_mm"] - of["fit.centre_x"].value, table["y_mm"] - of["fit.centre_y"].value
    ax.axhline(0.0, color="0.7", linewidth=0.8)
    ax.plot(np.degrees(np.arctan2(y, x)), table["deviation_um"], ".")
    _label(ax, "Radial deviations, positive outside", "angle (°)")


def _four_sensor(answer: Result, ax: Any) -> None:
    found = answer["straightness"]
    table = {"x_mm": np.array(found["x"]), "S": np.array(found["S"]), "std": np.array(found["S_std"])}
    _line(ax, table, "S", "std", "slide")
    _label(ax, "Straightness of the slide, 95 % band")


def _fourier(answer: Result, ax: Any) -> None:
    table = answer.tables["profiles"]
    _line(ax, table, "straightness_um", "straightness_std_um", "workpiece")
    _label(ax, "Workpiece without its line, 95 % band")


def _straightness(answer: Result, ax: Any) -> None:
    table = answer.tables["deviations"]
    for name in table:
        if name != "x_mm":
            _line(ax, table, name, None, name.removesuffix("_um").replace("_", " "))
    _label(ax, "Deviation from each reference line")


def _step_diagonal(answer: Result, ax: Any) -> None:
    for component in answer["components"]:
        if component["unit"] == "um" and component["value"]:
            table = {"x_mm": np.array(component["position"]), "y": np.array(component["value"])}
            table["std"] = np.array(component["std"], dtype=float)
            _line(ax, table, "y", "std", component["name"])
    _label(ax, "Component errors that are determined, 95 % bands", "position (mm)")


def _machine(answer: Result, ax: Any) -> None:
    if "deviations" in answer.tables and "deviation_x_um" in answer.tables["deviations"]:
        table = answer.tables["deviations"]
        places = np.arange(len(table["point"]))
        for axis in "xyz":
            ax.errorbar(
                places,
                table[f"deviation_{axis}_um"],
                table[f"expanded_{axis}_um"],
                fmt=".",
                capsize=2,
                label=axis.upper(),
            )
        ax.set_xticks(places, table["point"])
        _label(ax, "Predicted deviations, expanded uncertainty", "point")
        return
    of = answer.quantities
    places = np.arange(len(of))
    ax.errorbar(places, [q.value for q in of.values()], [q.std for q in of.values()], fmt="o", capsize=3)
    ax.set_xticks(places, list(of), rotation=30, ha="right")
    units = {q.unit for q in of.values()}
    _label(ax, f"Machine: {answer['action']}, k = 1", "", " / ".join(sorted(units)))


def _bars(ax: Any, names: list[str], values: list[float], what: str, title: str) -> None:
    ax.barh(np.arange(len(names)), values)
    ax.set_yticks(np.arange(len(names)), names)
    ax.invert_yaxis()
    ax.set(xlabel=what, title=title)


def _anova(answer: Result, ax: Any) -> None:
    names = [feature["name"] for feature in answer["features"]]
    places = np.arange(len(names))
    for k, (part, label) in enumerate((("between", "part to part"), ("within", "measurement"))):
        found = [feature["analysis"]["components"][part] for feature in answer["features"]]
        values = [np.nan if one is None else one["standard_deviation"] for one in found]
        ax.barh(places + 0.4 * k, values, 0.4, label=label)
    ax.set_yticks(places + 0.2, names)
    ax.invert_yaxis()
    units = sorted({feature["unit"] for feature in answer["features"]})
    ax.set(xlabel=f"standard deviation ({', '.join(units)})", title="What varies")


def _diagnose(answer: Result, ax: Any) -> None:
    if answer["schema"] == "errsep.fit-with/1":
        gap = answer["gap"]
        sizes = [gap[key]["rms"] for key in ("before", "after")]
        _bars(ax, ["without", "with"], sizes, f"gap ({gap['unit']} RMS)", "Without and with the effects")
        return
    candidates = sorted(answer["candidates"], key=lambda c: -(c["evidence"] or 0.0))
    names = [candidate["effect"] for candidate in candidates]
    evidence = [candidate["evidence"] or 0.0 for candidate in candidates]
    _bars(ax, names, evidence, "log evidence against no effect", "Evidence of each effect alone")


def _check(answer: Result, ax: Any) -> None:
    numbers = [
        (f"{effect['effect']} {number['name']}", number["z"])
        for effect in answer["effects"]
        for number in effect["numbers"]
    ]
    numbers += [(number["name"], number["z"]) for number in answer["quantities"]]
    told = [(name, z) for name, z in numbers if z is not None]
    names, found = [name for name, _ in told], [z for _, z in told]
    _bars(ax, names, found, "found less sealed, standard deviations", "Against what was sealed")
    for end in (-BAND, BAND):
        ax.axvline(end, color="0.5", linewidth=0.8, linestyle="--")


def _plan(answer: Result, ax: Any) -> None:
    found = [e for e in answer["effects"] if e["detectable"] is not None and e["unit"] == "um"]
    names = [effect["effect"] for effect in found]
    detectable = [effect["detectable"] for effect in found]
    _bars(ax, names, detectable, "smallest detectable size (µm)", "What the plan can show")
    ax.set_xscale("log")


def _simulate(answer: Result, ax: Any) -> None:
    ((name, table),) = list(answer.tables.items())[:1]
    columns = {key: np.asarray(values) for key, values in table.items()}
    numbers = [key for key, values in columns.items() if values.dtype.kind == "f"]
    x, y = (numbers[0], numbers[-1]) if "x" not in numbers else ("x", numbers[-1])
    by = next((columns[key] for key in ("channel", "diagonal", "component") if key in columns), None)
    for one in [None] if by is None else dict.fromkeys(by.tolist()):
        of = slice(None) if by is None else by == one
        ax.plot(columns[x][of], columns[y][of], ".", label=one)
    _label(ax, f"Simulated {name}", x, y)


_DRAWN: dict[str, Callable[[Result, Any], None]] = {
    "reversal": _reversal,
    "circle": _circle,
    "four-sensor": _four_sensor,
    "fourier": _fourier,
    "straightness": _straightness,
    "step-diagonal": _step_diagonal,
    "machine": _machine,
    "anova": _anova,
    "diagnose": _diagnose,
    "check": _check,
    "plan": _plan,
    "simulate": _simulate,
}
