"""Set-ups that are given as dictionaries, as the TOML that the readers take."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from typing import Any

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def dumps(table: Mapping[str, Any]) -> str:
    """A dictionary as TOML; ``None`` stands for a key that is left out.

    >>> print(dumps({"artefact": {"thickness": 42}, "indicator": {"noise": None}}), end="")
    [artefact]
    thickness = 42
    [indicator]
    """
    return "".join(_lines(table, ()))


def _lines(table: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    plain, tables = [], []
    for key, value in table.items():
        if value is None:
            continue
        if isinstance(value, Mapping):
            tables.append((key, [value], "[{}]\n"))
        elif isinstance(value, list) and value and all(isinstance(v, Mapping) for v in value):
            tables.append((key, value, "[[{}]]\n"))
        else:
            plain.append(f"{_key(key)} = {_value(value)}\n")
    for key, values, header in tables:
        below = (*path, key)
        for value in values:
            plain.append(header.format(".".join(_key(k) for k in below)))
            plain.extend(_lines(value, below))
    return plain


def _key(key: Any) -> str:
    if not isinstance(key, str):
        raise TypeError(f"a key of a set-up is a text, not {key!r}")
    return key if _BARE.fullmatch(key) else json.dumps(key)


def _value(value: Any) -> str:
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if math.isfinite(value):
            return repr(value)
        return "nan" if math.isnan(value) else ("inf" if value > 0 else "-inf")
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value(v) for v in value) + "]"
    if isinstance(value, Mapping):
        pairs = (f"{_key(k)} = {_value(v)}" for k, v in value.items() if v is not None)
        return "{ " + ", ".join(pairs) + " }"
    raise TypeError(f"a set-up holds numbers, texts, truth values, lists and tables, not {value!r}")
