"""What all commands have in common: how they are called, and what their arguments may be."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from . import _errsep
from ._inputs import Call, Columns, Names, listed, whole
from .errors import Error, NotDetermined
from .result import Result

#: A table: a path, CSV text, a dictionary of columns, an array, or a table of another package.
Table = Any
#: A set-up: a dictionary, TOML text or a path.
Setup = Mapping[str, Any] | str | bytes | os.PathLike[str]
#: Names and units of columns: ``{"x": "z_mm:mm"}`` or ``"x=z_mm:mm"``.
ColumnMap = Mapping[str, str] | str

#: Columns of arrays of two dimensions.
REVERSAL: Columns = {5: ("x", "1A", "1B", "2A", "2B"), 3: ("x", "1A", "2B")}
FOURIER: Columns = {3: ("x", "m1", "m2"), 4: ("x", "m1", "m2", "m3")}
FOUR_SENSOR: Columns = {5: ("x", "m1", "m2", "m3", "m4")}
POINTS: Columns = {2: ("x", "y")}
PROFILE: Columns = {2: ("x", "deviation")}


def answer(call: Call, threads: int | None) -> Result:
    """Runs the command; what good data do not determine is an exception."""
    threads = None if threads is None else whole("threads", threads, 1)
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


def give_setup(call: Call, setup: Setup | None) -> None:
    """Adds the set-up where there is one."""
    if setup is not None:
        call.option("setup", call.toml(setup, "setup"))


def give_fit(call: Call, effects: Names, columns: ColumnMap | None, seed: int | None) -> None:
    """Adds what the commands that fit a model take alike: effects in the fit, names of columns, seed."""
    call.options({"with": listed(effects) or None, "columns": columns, "seed": seed})


def as_path(path: str | os.PathLike[str] | None) -> str | None:
    """A path as a word of the command line."""
    return None if path is None else os.fspath(path)
