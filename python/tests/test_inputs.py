"""What is given in memory is worked with as the same CSV is: answers are compared for equality."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import polars
import pyarrow
import pytest
from conftest import plain

import errsep

Columns = dict[str, list[Any]]


@pytest.fixture(scope="module")
def columns(readings: Path) -> Columns:
    lines = [line for line in readings.read_text().splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    number = {"repeat": int, "time": float, "x": float, "reading": float}
    return {name: [number.get(name, str)(row[name]) for row in rows] for name in rows[0]}


@pytest.fixture(scope="module")
def expected(readings: Path) -> dict[str, Any]:
    return told(errsep.reversal(readings))


def told(answer: errsep.Result) -> dict[str, Any]:
    """An answer without the sentence on how the file was written."""
    return {key: value for key, value in plain(answer.to_dict()).items() if key != "input"}


class OnlyArrow:
    """A table that knows nothing but the Arrow interface."""

    def __init__(self, table: pyarrow.Table) -> None:
        self._table = table

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        return self._table.__arrow_c_stream__(requested_schema)


class OnlyDataframe:
    """A table that knows nothing but the dataframe interface."""

    def __init__(self, table: Any) -> None:
        self._table = table

    def __dataframe__(self, *args: Any, **kwargs: Any) -> Any:
        return self._table.__dataframe__(*args, **kwargs)


def structured(columns: Columns) -> np.ndarray:
    types = [(name, np.asarray(values).dtype) for name, values in columns.items()]
    array = np.zeros(len(columns["x"]), dtype=types)
    for name, values in columns.items():
        array[name] = values
    return array


def as_text(columns: Columns) -> str:
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return text.getvalue()


@pytest.mark.parametrize(
    "made",
    [
        dict,
        pandas.DataFrame,
        lambda columns: pandas.DataFrame(columns).convert_dtypes(),
        lambda columns: pandas.DataFrame(columns).convert_dtypes(dtype_backend="pyarrow"),
        lambda columns: pandas.DataFrame(columns).astype({"channel": "category"}),
        polars.DataFrame,
        pyarrow.table,
        lambda columns: OnlyArrow(pyarrow.table(columns)),
        lambda columns: OnlyDataframe(pyarrow.table(columns)),
        structured,
        lambda columns: {name: np.array(values) for name, values in columns.items()},
        as_text,
        lambda columns: as_text(columns).encode(),
    ],
    ids=[
        *["dict", "pandas", "pandas nullable", "pandas arrow", "pandas category", "polars", "pyarrow"],
        *["arrow interface", "dataframe interface", "structured array", "arrays", "text", "bytes"],
    ],
)
def test_a_table_in_memory_is_read_as_the_file_is(
    made: Any, columns: Columns, expected: dict[str, Any]
) -> None:
    assert told(errsep.reversal(made(columns))) == expected


def test_an_array_has_the_columns_of_the_wide_form() -> None:
    made = errsep.simulate("reversal", seed=3, repeats=1)["data"]
    x = sorted(set(made["x"]))
    by = {name: {} for name in ("1A", "1B", "2A", "2B")}
    for channel, place, reading in zip(made["channel"], made["x"], made["reading"], strict=True):
        by[channel][place] = reading
    wide = {"x": x} | {channel: [by[channel][place] for place in x] for channel in by}
    array = np.array(list(wide.values())).T
    assert told(errsep.reversal(array)) == told(errsep.reversal(wide))
    assert not array.flags["C_CONTIGUOUS"]


def test_a_missing_number_is_an_empty_field_whatever_says_so() -> None:
    x, deviation = [0.0, 1.0, 2.0], [0.0, None, 1.0]
    for made in (dict, pandas.DataFrame, polars.DataFrame, pyarrow.table):
        with pytest.raises(errsep.InputError, match="deviation is missing") as caught:
            errsep.straightness(made({"x": x, "deviation": deviation}))
        assert (caught.value.file, caught.value.line, caught.value.row) == ("<profile>", 3, 1)
    from errsep._inputs import as_csv

    for dtype in ("Int64", "Float64", "string"):
        column = pandas.DataFrame({"x": pandas.array([1, None, 3], dtype=dtype)})
        assert as_csv(column, {}) == b'x\n1\n""\n3\n', dtype
    masked = np.ma.masked_array([0.0, 5.0, 1.0], [False, True, False])
    with pytest.raises(errsep.InputError, match="deviation is missing"):
        errsep.straightness({"x": x, "deviation": masked})


def test_numbers_arrive_to_the_last_bit() -> None:
    """Every float64 is written so that it reads back the same: equality, no tolerance."""
    generator = np.random.default_rng(1)
    values = np.concatenate(
        [generator.normal(size=200) * 10.0 ** generator.integers(-12, 6, 200), [5e-324, 0.1, -0.0]]
    )
    from errsep._inputs import as_csv

    written = as_csv({"x": np.arange(values.size), "deviation": values}, {}).decode().splitlines()[1:]
    read = np.array([float(line.split(",")[1]) for line in written])
    assert np.array_equal(read, values)


def test_whole_numbers_of_every_width_and_booleans() -> None:
    from errsep._inputs import as_csv

    for dtype in ("int8", "uint16", "int64", "float32"):
        assert as_csv({"x": np.array([1, 2], dtype)}, {}) == b"x\n1\n2\n"
    assert as_csv({"x": [True, False]}, {}) == b"x\nTrue\nFalse\n"


@pytest.mark.parametrize(
    "setup",
    [
        {"artefact": {"thickness": 42.0}, "indicator": {"noise": np.float64(0.05)}},
        "[artefact]\nthickness = 42.0\n[indicator]\nnoise = 0.05\n",
        b"artefact.thickness = 42.0\nindicator.noise = 0.05\n",
        "artefact = { thickness = 42.0 }\nindicator = { noise = 0.05 }",
    ],
    ids=["dict", "text", "bytes", "inline"],
)
def test_a_set_up_in_memory_is_that_of_the_file(setup: Any, readings: Path, tmp_path: Path) -> None:
    file = tmp_path / "setup.toml"
    file.write_text("[artefact]\nthickness = 42.0\n[indicator]\nnoise = 0.05\n")
    expected = plain(errsep.reversal(readings, file, simultaneous=True).to_dict())
    assert plain(errsep.reversal(readings, setup, simultaneous=True).to_dict()) == expected
    assert plain(errsep.reversal(readings, str(file), simultaneous=True).to_dict()) == expected


def test_toml_reads_back_what_was_written() -> None:
    tomllib = pytest.importorskip("tomllib")
    from errsep._toml import dumps

    given = {
        "chain": "XYFZ",
        "a key": 'quo"ted \\ and\nlines \x7f\t°',
        "numbers": [1, -2.5, 1e-300, float("inf")],
        "errors": {"EXX": {"table": {"positions": np.array([0.0, 1.0]), "values": (1, 2)}}, "C0Y": {}},
        "effect": [{"name": "one", "on": True}, {"name": "two", "channels": {"1A": 1.0}}],
        "mixed": [{"x": 1}, [1, 2]],
    }
    plain_values = dict(
        given, errors={"EXX": {"table": {"positions": [0.0, 1.0], "values": [1, 2]}}, "C0Y": {}}
    )
    assert tomllib.loads(dumps(given | {"left out": None})) == plain_values


def test_columns_by_other_names_and_units(readings: Path, columns: Columns, expected: dict[str, Any]) -> None:
    renamed = {"z": columns["x"], "I": [value / 1000 for value in columns["reading"]]}
    renamed |= {key: columns[key] for key in ("channel", "repeat", "direction", "time") if key in columns}
    named = {"x": "z:mm", "reading": "I:mm"} | {key: key for key in renamed if key not in "zI"}
    alpha = errsep.reversal(renamed, columns=named).tilts["alpha"]
    # Division and multiplication by 1000 cost rounding: epsilons of the readings, in units of α.
    assert alpha.value == pytest.approx(expected["tilts"]["alpha"]["value"], rel=1e-11)


def test_what_is_no_table_is_told() -> None:
    with pytest.raises(TypeError, match="int is no table"):
        errsep.circle(3)
    with pytest.raises(TypeError, match="Result is no table"):
        errsep.circle(errsep.simulate("circle"))
    with pytest.raises(errsep.InputError, match="shape") as caught:
        errsep.circle(np.zeros((4, 3)))
    assert caught.value.help == "give columns 2 (x, y)"
    with pytest.raises(errsep.InputError, match="`y` has 1 values"):
        errsep.circle({"x": [1.0, 2.0], "y": [1.0]})
    with pytest.raises(errsep.InputError, match="shape"):
        errsep.circle({"x": [[1.0, 2.0]], "y": [[1.0, 3.0]]})
    with pytest.raises(TypeError, match="no column names"):
        errsep.anova(np.zeros((4, 2)))


def test_the_provenance_names_what_was_in_memory() -> None:
    import hashlib

    table = b"x,deviation\n0,0\n1,1\n2,0\n"
    (given,) = errsep.straightness(table)["provenance"]["inputs"]
    assert given == {"file": "<profile>", "sha256": hashlib.sha256(table).hexdigest()}


def test_a_path_that_looks_like_an_option(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("--help").write_text("x,deviation\n0,0\n1,1\n2,0\n")
    assert errsep.straightness("--help")["points"] == 3


def test_a_single_name_is_one_name(readings: Path) -> None:
    several = plain(errsep.reversal(readings, simultaneous=True, with_=["taper"]).to_dict())
    assert plain(errsep.reversal(readings, simultaneous=True, with_="taper").to_dict()) == several
    assert plain(errsep.reversal(readings, simultaneous=True, with_=iter(("taper",))).to_dict()) == several
    several = plain(errsep.diagnose(readings, without=["taper"], severity=0).to_dict())
    assert plain(errsep.diagnose(readings, without="taper", severity=0).to_dict()) == several
    points = "point,x,y,z\n31,0,0,0\n32,100,0,0\n33,0,100,0\n"
    machine = {"chain": "FXYZ", "errors": {"EXX": {"polynomial": [0.0, 0.01]}}}
    length = errsep.machine(machine, "length", points, between="31:32")
    assert list(length.quantities) == ["results.length 31 to 32"]
    corners = {"first": "31,32", "second": "31,33"}
    given = {name: words.split(",") for name, words in corners.items()}
    square = errsep.machine(machine, "squareness", points, **corners)
    assert plain(square.to_dict()) == plain(errsep.machine(machine, "squareness", points, **given).to_dict())
    assert errsep.least_squares(lambda p: p - 1, [0.0], names="drift").names == ["drift"]


def test_effects_of_a_simulation_come_as_they_are_written() -> None:
    of = {"zero-jump": 0.2, "taper": 2e-5}
    made = [
        plain(errsep.simulate("reversal", positions=31, effects=effects, seed=7).to_dict())
        for effects in (of, [f"{name}={size!r}" for name, size in of.items()])
    ]
    assert made[0] == made[1] and list(made[0]["truth"]["effects"])
