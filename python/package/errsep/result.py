"""Answers of the commands."""

from __future__ import annotations

import copy
import html
import json
import math
import os
from base64 import b64encode
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from . import _errsep, _plot
from .quantity import Covariance, Quantities, Quantity, is_quantity, quantity
from .quantity import to_gtc as _to_gtc
from .quantity import to_uncertainties as _to_uncertainties

#: Parts of an answer that say what goes into a quantity, not what came out; what came out is no other
#: variant of an effect (`elsewhere`), and the effects of a fit `with` them stand beside it.
_NO_RESULTS = {"contributions", "contrasts", "nistir6868", "provenance", "elsewhere", "with"}

#: Figures shown in a notebook; the report has all.
_SHOWN = 2


class Result(Mapping[str, Any]):
    """The answer of a command, in every form in which the command gives it.

    The values are those of the command's JSON (``errsep <command> --format json``), whose pages in
    ``docs/json`` say what each key means: ``result["forms"]["M"]``. Angles are in rad, positions in mm,
    readings and forms in µm.

    It is a mapping that nothing changes: ``for key in result``, ``len``, ``keys``, ``items``, ``get``.
    """

    def __init__(self, command: str, answered: _errsep.Answered) -> None:
        self.command = command
        self._answered = answered

    # What the command says.

    def summary(self) -> str:
        """What the command prints for people."""
        return self._answered.text

    def to_json(self) -> str:
        """What the command prints for programs, from the same serializer."""
        return self._answered.json()

    def to_dict(self) -> dict[str, Any]:
        """What the command prints for programs, as a dictionary that is the caller's own."""
        return copy.deepcopy(self._json)

    @cached_property
    def _json(self) -> dict[str, Any]:
        answer: dict[str, Any] = json.loads(self._answered.json())
        return answer

    def __getitem__(self, key: str) -> Any:
        return self._json[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._json)

    def __len__(self) -> int:
        return len(self._json)

    def report(self, folder: str | os.PathLike[str], *, force: bool = False) -> None:
        """Writes the report's folder, as ``--out`` does: report.html, result.json and the tables.

        ``force`` lets it replace files that errsep did not write.
        """
        self._answered.write(os.fspath(folder), force)

    # What is in it.

    @cached_property
    def quantities(self) -> Quantities:
        """Every single value with its uncertainty, by its place in the answer: ``tilts.alpha``; of a
        diagnosis the sizes of the causes that it names: ``candidates.taper.parameters.half-angle``."""
        return Quantities(dict(_quantities(self._json, ())))

    @cached_property
    def tilts(self) -> Quantities:
        """The tilts of a reversal, those that the channels determine; empty for other answers."""
        tilts = self._json.get("tilts") or {}
        return Quantities({name: quantity(t) for name, t in tilts.items() if t is not None})

    @cached_property
    def covariance(self) -> Covariance | None:
        """The covariance with its names, where the command's answer has one: of a circle, of the tilts
        and effects of a simultaneous reversal."""
        named = self._json.get("covariance")
        if named is not None:
            units = set(named["units"])
            return Covariance(named["names"], named["matrix"], f"{units.pop()}2" if len(units) == 1 else "")
        found = self._json.get("fit", {}).get("covariance")
        return None if found is None else Covariance(found["order"], found["value"], found["unit"])

    @property
    def not_determined(self) -> list[str]:
        """What the data do not determine, in words; empty where nothing is missing."""
        return _not_determined(self._json)

    @property
    def warnings(self) -> list[str]:
        """What the reader should know, in words."""
        found = (self._json.get(key) or [] for key in ("warnings", "remarks", "notes"))
        warnings = [warning for several in found for warning in several]
        regularization = self._json.get("regularization") or {}
        more = (regularization.get(key) for key in ("instead", "note"))
        return warnings + [words for words in more if words]

    @cached_property
    def tables(self) -> dict[str, dict[str, Any]]:
        """The tables of the report by their names: columns are arrays, or lists of texts."""
        tables = self._answered.tables()
        return {file.removesuffix(".csv"): dict(columns) for file, columns in tables}

    @property
    def setup(self) -> str | None:
        """Of a simulation: the set-up with which its data are read, as TOML."""
        return self._answered.setup

    # As other packages have it.

    def to_dataframe(self, table: str | None = None) -> Any:
        """A table of the report as a DataFrame of pandas, by default the first.

        An answer without tables gives its quantities.
        """
        import pandas

        if not self.tables and table is None:
            rows = [vars(q) | {"name": name} for name, q in self.quantities.items()]
            frame = pandas.DataFrame(rows)
            return frame.set_index("name") if rows else frame
        return pandas.DataFrame(self._table(table))

    def to_xarray(self, table: str | None = None) -> Any:
        """A table of the report as a Dataset of xarray, by default the first.

        Its first column is the coordinate where it is made of different numbers, else the row.
        """
        import xarray

        columns = self._table(table)
        first = next(iter(columns))
        values = np.asarray(columns[first])
        along = values.dtype.kind == "f" and np.unique(values).size == values.size
        dimension = first if along else "row"
        variables = {
            name: (dimension, np.asarray(column), _unit_of(name))
            for name, column in columns.items()
            if not (along and name == first)
        }
        coordinates = {first: (first, values, _unit_of(first))} if along else {}
        return xarray.Dataset(variables, coordinates, {"schema": self._json["schema"]})

    def to_uncertainties(self) -> dict[str, Any]:
        """The quantities as numbers of the package ``uncertainties``, correlated where known."""
        return _to_uncertainties(self.quantities, self.covariance)

    def to_gtc(self) -> dict[str, Any]:
        """The quantities as uncertain numbers of the package ``GTC``, correlated where known."""
        return _to_gtc(self.quantities, self.covariance)

    def _table(self, name: str | None) -> dict[str, Any]:
        if not self.tables:
            raise ValueError(f"an answer of {self.command} has no tables")
        if name is None:
            return next(iter(self.tables.values()))
        if name not in self.tables:
            raise KeyError(f"there is no table {name!r}: give {', '.join(self.tables)}")
        return self.tables[name]

    # To look at.

    def plot(self, ax: Any = None) -> Any:
        """Draws the answer with matplotlib; returns the axes."""
        return _plot.result(self, ax)

    def figures(self) -> list[tuple[str, str, str]]:
        """The figures of the report: title, caption, SVG."""
        return self._answered.figures()

    def _repr_html_(self) -> str:
        title, standing, _ = self._answered.told()
        return notebook(title, standing, self._sentence(), self.warnings, self._answered.figures())

    def __repr__(self) -> str:
        sentence = self._sentence()
        return f"<errsep {self.command}: {sentence}>" if sentence else f"<errsep {self.command}>"

    def _sentence(self) -> str:
        _, _, sentence = self._answered.told()
        if not sentence:
            told = (f"{key} {self._json[key]}" for key in ("kind", "seed") if key in self)
            sentence = ", ".join(told)
        return sentence

    __str__ = __repr__

    def __getstate__(self) -> dict[str, Any]:
        return {"command": self.command, "state": self._answered.state()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.command = state["command"]
        self._answered = _errsep.Answered.of_state(state["state"])

    def __copy__(self) -> Result:
        return Result(self.command, self._answered)

    def __deepcopy__(self, memo: dict[int, Any]) -> Result:
        # What it holds never changes.
        return Result(self.command, self._answered)


def notebook(
    title: str, standing: str, sentence: str, warnings: list[str], figures: list[tuple[str, str, str]]
) -> str:
    """An answer as a notebook shows it. Drawings are images, so that no style leaks into the page."""
    parts = [f"<h3>{html.escape(title)}</h3>"]
    if sentence:
        parts.append(f"<p><strong>{html.escape(standing)}.</strong> {html.escape(sentence)}</p>")
    if warnings:
        items = "".join(f"<li>{html.escape(warning)}</li>" for warning in warnings)
        parts.append(f"<ul>{items}</ul>")
    for name, caption, svg in figures[:_SHOWN]:
        source = "data:image/svg+xml;base64," + b64encode(svg.encode()).decode()
        parts.append(
            f'<figure><img alt="{html.escape(name)}" src="{source}" style="max-width:100%"/>'
            f"<figcaption>{html.escape(name)}. {html.escape(caption)}</figcaption></figure>"
        )
    return f'<div class="errsep">{"".join(parts)}</div>'


def _unit_of(column: str) -> dict[str, str]:
    unit = column.rsplit("_", 1)[-1]
    return {"units": unit} if unit in {"mm", "um", "rad", "urad", "deg", "s"} else {}


def _quantities(
    value: Any, path: tuple[str, ...], dof: float | None = None
) -> Iterator[tuple[str, Quantity]]:
    if is_quantity(value):
        yield ".".join(path), quantity(value, label=path[-1] if path else "", dof=dof)
        linear = value.get("linear")
        if is_quantity(linear):
            # The quantity itself beside its logarithm.
            yield ".".join((*path[:-1], linear["name"])), quantity(linear, label=linear["name"], dof=dof)
    elif isinstance(value, Mapping):
        for key, part in value.items():
            if key in _NO_RESULTS:
                continue
            if key == "result" and is_quantity(part):
                # Its expanded uncertainty stands beside it.
                yield ".".join(path), quantity(part, value.get("expanded"))
            elif key == "candidates":
                yield from _quantities(_named(value), (*path, key), _freedom(value))
            else:
                own = _freedom(value) if key == "effects" else dof
                yield from _quantities(part, (*path, key), own)
    elif isinstance(value, list):
        for k, part in enumerate(value):
            if isinstance(part, (Mapping, list)):
                yield from _quantities(part, (*path, _name(part, k)), dof)


def _named(answer: Mapping[str, Any]) -> list[Any]:
    """Of the effects that a diagnosis weighs, those that it names."""
    named = (answer.get("verdict") or {}).get("effects", [])
    return [c for c in answer["candidates"] if isinstance(c, Mapping) and c.get("effect") in named]


def _freedom(answer: Mapping[str, Any]) -> float | None:
    """The degrees of freedom that the sizes of all effects share: those of the noise, infinite where it is
    stated."""
    of = answer.get("with") or answer
    if of.get("schema") not in ("errsep.diagnosis/1", "errsep.fit-with/1"):
        return None
    dof = of["noise"].get("degrees_of_freedom")
    return math.inf if dof is None else float(dof)


def _name(part: Any, k: int) -> str:
    if isinstance(part, Mapping):
        for key in ("label", "name", "point", "effect", "quantity"):
            name = part.get(key)
            if isinstance(name, str):
                return name
    return str(k)


def _in_words(one: Any) -> str:
    """What a design leaves open comes with what to do about it."""
    if isinstance(one, Mapping):
        return ": ".join(words for words in (one["combination"], one.get("remedy")) if words)
    return str(one)


def _not_determined(answer: Mapping[str, Any]) -> list[str]:
    found: list[str] = [_in_words(one) for one in answer.get("not_determined") or []]
    found += [f"tilt {name}" for name, tilt in (answer.get("tilts") or {}).items() if tilt is None]
    forms = answer.get("forms") or {}
    found += [f"form {name}" for name, form in forms.items() if form is None and "_std" not in name]
    found += [ambiguity["statement"] for ambiguity in answer.get("ambiguities") or []]
    found += [f"order {order} of the profile" for order in answer.get("lost_orders") or []]
    for feature in answer.get("features") or []:
        components = feature["analysis"]["components"]
        if feature["analysis"]["groups"] > 1 and components["within"] is None:
            found.append(f"{feature['name']}: scatter of the parts against that of the measurement")
    for key in ("hidden", "effects"):
        if key == "effects" and "extra_measurements" not in answer:
            continue
        effects = answer.get(key) or []
        found += [f"effect {e['effect']}" for e in effects if e.get("detectable") is None]
    return found
