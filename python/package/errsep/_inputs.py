"""Tables and set-ups as the readers take them: paths as they are, all else as bytes with a name."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from . import _errsep, _toml
from .errors import InputError
from .result import Result

#: Columns of an array of two dimensions that has none of its own, by their number.
Columns = Mapping[int, Sequence[str]]

#: Names in a list, or one name; none.
Names = str | Iterable[str] | None

#: The greatest number that counts anything.
_MOST = 2**64 - 1


def listed(names: Names) -> list[str]:
    """Names as a list; a single text is one name.

    >>> listed("taper"), listed(("taper", "zero-jump"))
    (['taper'], ['taper', 'zero-jump'])
    """
    return [names] if isinstance(names, str) else list(names or ())


def whole(name: str, value: Any, least: int = 0) -> int:
    """An argument that counts something, where the compiled half takes no other.

    >>> whole("threads", 4, 1)
    4
    """
    try:
        number = int(value)
    except (TypeError, ValueError, OverflowError):
        number = -1
    if number != value or not least <= number <= _MOST:
        raise InputError(f"{name} is {value!r}", help=f"give a whole number, {least} or greater")
    return number


class Call:
    """The arguments of a command and what goes with them in memory."""

    def __init__(self, *words: str) -> None:
        self.words: list[str] = list(words)
        self.inputs: list[tuple[str, bytes]] = []
        self.tables: set[str] = set()

    def table(self, data: Any, name: str, columns: Columns | None = None) -> str:
        """The argument for a table."""
        if isinstance(data, (str, os.PathLike)) and not _is_text(data):
            return os.fspath(data)
        label = self._named(name, as_csv(data, columns or {}))
        self.tables.add(label)
        return label

    def toml(self, setup: Any, name: str) -> str:
        """The argument for a set-up: a dictionary, TOML text or a path."""
        if isinstance(setup, Mapping):
            return self._named(name, _toml.dumps(setup).encode())
        if isinstance(setup, bytes):
            return self._named(name, setup)
        if isinstance(setup, str) and ("\n" in setup or "=" in setup):
            return self._named(name, setup.encode())
        path: str = os.fspath(setup)
        return path

    def positional(self, word: str) -> Call:
        """Adds an argument, also one that looks like an option."""
        # A path in memory begins with `<`; only a path given by the caller can begin with `-`.
        self.words.append(f"./{word}" if word.startswith("-") and word != "-" else word)
        return self

    def option(self, name: str, value: Any) -> Call:
        """Adds an option unless it is None or False."""
        if value is None or value is False:
            return self
        self.words.append(f"--{name}" if value is True else f"--{name}={_word(value)}")
        return self

    def options(self, values: Mapping[str, Any]) -> Call:
        """Adds options by their names in Python."""
        for name, value in values.items():
            self.option(name.strip("_").replace("_", "-"), value)
        return self

    def repeated(self, name: str, values: Iterable[Any]) -> Call:
        """Adds an option once for each value."""
        for value in values:
            self.option(name, value)
        return self

    def _named(self, name: str, content: bytes) -> str:
        taken = {name for name, _ in self.inputs}
        label, number = f"<{name}>", 1
        while label in taken:
            number += 1
            label = f"<{name} {number}>"
        self.inputs.append((label, content))
        return label


def _word(value: Any) -> str:
    if isinstance(value, Mapping):
        return ",".join(f"{key}={part}" for key, part in value.items())
    if isinstance(value, (list, tuple)):
        return ",".join(_word(part) for part in value)
    if hasattr(value, "item"):
        value = value.item()
    return repr(value) if isinstance(value, float) else str(value)


def _is_text(data: Any) -> bool:
    return isinstance(data, str) and "\n" in data


def as_csv(data: Any, columns: Columns) -> bytes:
    """A table in memory as the bytes of a CSV.

    >>> as_csv({"x": [0.0, 1.5], "channel": ["1A", "2B"]}, {})
    b'x,channel\\n0,1A\\n1.5,2B\\n'
    """
    if isinstance(data, bytes):
        return data
    if isinstance(data, str):
        return data.encode()
    named = [(name, _column(values)) for name, values in _named_columns(data, columns)]
    return _errsep.table_as_csv(named)


def _named_columns(data: Any, columns: Columns) -> list[tuple[str, Any]]:
    if isinstance(data, Mapping) and not isinstance(data, Result):
        return [(str(name), values) for name, values in data.items()]
    if isinstance(data, np.ndarray):
        return _of_array(data, columns)
    # pyarrow says column_names, pandas and polars columns.
    names = getattr(data, "column_names", getattr(data, "columns", None))
    if names is not None and not callable(names) and hasattr(data, "__getitem__"):
        return [(str(name), data[name]) for name in names]
    if hasattr(data, "__arrow_c_stream__") or hasattr(data, "__dataframe__"):
        return _of_arrow(data)
    raise TypeError(
        f"{type(data).__name__} is no table: give a path, a dictionary of columns, a numpy array, or a "
        "table of pandas, polars or pyarrow"
    )


def _of_array(array: np.ndarray, columns: Columns) -> list[tuple[str, Any]]:
    if array.dtype.names is not None:
        return [(name, array[name]) for name in array.dtype.names]
    shapes = " or ".join(f"{n} ({', '.join(names)})" for n, names in sorted(columns.items()))
    if not columns:
        raise TypeError("an array has no column names: give a dictionary of columns")
    if array.ndim != 2 or array.shape[1] not in columns:
        raise InputError(f"an array of shape {array.shape} is no such table", help=f"give columns {shapes}")
    return list(zip(columns[array.shape[1]], array.T, strict=True))


def _of_arrow(data: Any) -> list[tuple[str, Any]]:
    try:
        import pyarrow
        import pyarrow.interchange
    except ImportError as error:
        raise TypeError(
            f"reading {type(data).__name__} through its Arrow interface takes pyarrow: pip install pyarrow"
        ) from error
    if hasattr(data, "__arrow_c_stream__"):
        table = pyarrow.table(data)
    else:
        table = pyarrow.interchange.from_dataframe(data)
    return [(name, table[name]) for name in table.column_names]


def _column(values: Any) -> Any:
    """Numbers as an array of float64 with NaN where one is missing; anything else as texts."""
    array = values.to_numpy() if hasattr(values, "to_numpy") else np.asarray(values)
    if array.ndim != 1:
        raise InputError(
            f"a column has the shape {array.shape}", help="give columns of one dimension, all as long"
        )
    if np.ma.isMaskedArray(values):
        array = np.ma.filled(np.ma.asarray(values, dtype=float), np.nan)
    if array.dtype.kind in "fiu":
        return np.ascontiguousarray(array, dtype=np.float64)
    texts = [_text(value) for value in array.tolist()]
    return texts


def _text(value: Any) -> str:
    if value is None or (isinstance(value, float) and np.isnan(value)):
        return ""
    # pandas.NA is neither true nor false.
    return "" if type(value).__name__ == "NAType" else str(value)
