"""`errsep.batch`: the folder is the command's, in this process and on a cluster of processes."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from conftest import ROOT, program

import errsep

COLUMNS = ("id", "command", "data", "setup", "options")


def campaigns(folder: Path, readings: Path, setup: Path, count: int = 12) -> dict[str, list[str]]:
    """Profiles, reversals and one whose data is missing, with their files where they say."""
    rows = []
    for k in range(count):
        if k % 6 == 2:
            rows.append((f"c{k}", "reversal", str(readings), str(setup), "--method shear"))
        elif k % 6 == 5:
            rows.append((f"c{k}", "straightness", str(folder / "nowhere.csv"), "", ""))
        else:
            profile = folder / f"p{k}.csv"
            profile.write_text(f"x,deviation\n0,0\n100,0.{k}\n200,{k}\n")
            rows.append((f"c{k}", "straightness", str(profile), "", ""))
    return {name: list(column) for name, column in zip(COLUMNS, zip(*rows, strict=True), strict=True)}


def parts(folder: Path, kind: str = "ndjson") -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.glob(f"part-*.{kind}"))}


def as_list(columns: dict[str, list[str]]) -> str:
    lines = [",".join(COLUMNS), *(",".join(row) for row in zip(*columns.values(), strict=True))]
    return "\n".join(lines) + "\n"


def test_the_folder_is_that_of_the_command(tmp_path: Path, readings: Path, setup: Path) -> None:
    path = tmp_path / "campaigns.csv"
    path.write_text(as_list(campaigns(tmp_path, readings, setup)))
    words = [str(program()), "batch", str(path), "--out", str(tmp_path / "command"), "--quiet"]
    subprocess.run(words, check=True)
    answers = errsep.batch(path, out=tmp_path / "python")
    assert (answers.campaigns, answers.worked_out, answers.failed, len(answers)) == (12, 12, 2, 12)
    # Exact: the same calculation.
    assert parts(tmp_path / "python") == parts(tmp_path / "command")
    # And the command finds that all is done.
    words[4] = str(tmp_path / "python")
    done = subprocess.run(words[:-1], check=True, capture_output=True, text=True)
    assert done.stdout.startswith("12 campaigns: 0 worked out now, 12 done before; 2 failed")
    assert errsep.batch(path, out=tmp_path / "python").worked_out == 0
    assert errsep.batch(path, out=tmp_path / "python", retry_failed=True).worked_out == 2


@pytest.mark.parametrize("kind", ["dictionary", "pandas", "polars", "pyarrow", "text"])
def test_a_list_in_memory_is_one_on_the_disk(kind: str, tmp_path: Path, readings: Path, setup: Path) -> None:
    columns = campaigns(tmp_path, readings, setup)
    path = tmp_path / "campaigns.csv"
    path.write_text(as_list(columns))
    frame = {
        "dictionary": lambda: columns,
        "pandas": lambda: pytest.importorskip("pandas").DataFrame(columns),
        "polars": lambda: pytest.importorskip("polars").DataFrame(columns),
        "pyarrow": lambda: pytest.importorskip("pyarrow").table(columns),
        "text": lambda: as_list(columns),
    }[kind]()
    errsep.batch(path, out=tmp_path / "disk")
    errsep.batch(frame, out=tmp_path / "memory")
    assert parts(tmp_path / "memory") == parts(tmp_path / "disk")


def test_rows_and_table_say_what_the_functions_say(tmp_path: Path, readings: Path, setup: Path) -> None:
    answers = errsep.batch(campaigns(tmp_path, readings, setup))
    rows = list(answers)
    assert [row["id"] for row in rows] == [f"c{k}" for k in range(12)]
    alone = errsep.reversal(readings, setup, method="shear").to_dict()
    alone.pop("provenance")
    alone["convergence"].pop("seconds")
    assert rows[2]["result"] == alone
    assert "nowhere.csv" in rows[5]["message"]
    table = answers.to_dataframe()
    assert list(table["status"]) == [row["status"] for row in rows]
    alpha = alone["tilts"]["alpha"]
    assert (table["alpha"][2], table["alpha_std"][2]) == (alpha["value"], alpha["std"])


def test_parquet_says_what_the_rows_say(tmp_path: Path, readings: Path, setup: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    out = tmp_path / "out"
    answers = errsep.batch(campaigns(tmp_path, readings, setup), out=out, parquet=True)
    table = parquet.read_table(out / "part-1-00001.parquet")
    rows = list(answers)
    for name in ("id", "key", "status", "exit", "message"):
        assert table[name].to_pylist() == [row[name] for row in rows]
    results = [text and json.loads(text) for text in table["result"].to_pylist()]
    assert results == [row["result"] for row in rows]
    alpha = rows[2]["result"]["tilts"]["alpha"]
    assert table["alpha"][2].as_py() == alpha["value"]
    assert table["alpha_std"][2].as_py() == alpha["std"]
    assert table["residual.rms"][2].as_py() == rows[2]["result"]["residual"]["rms"]
    assert table["points"].to_pylist()[:3] == [3, 3, None]


def test_a_key_selects_rows_of_a_parquet_file(tmp_path: Path, readings: Path, setup: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    many: dict[str, list[Any]] = {"machine": [], "x": [], "deviation": []}
    for k in range(3):
        deviations = [0.1 * k, 1 / 3, 1.5]
        many["machine"] += [f"m{k}"] * 3
        many["x"] += [0.0, 100.0, 200.0]
        many["deviation"] += deviations
        lines = ["x,deviation", *(f"{x},{d!r}" for x, d in zip((0, 100, 200), deviations, strict=True))]
        (tmp_path / f"m{k}.csv").write_text("\n".join(lines) + "\n")
    # Rows of a machine in groups of their own and across their borders.
    parquet.write_table(pyarrow.table(many), tmp_path / "many.parquet", row_group_size=4)
    rows = ["id,command,data,key", *(f"c{k},straightness,many.parquet,machine=m{k}" for k in range(4))]
    (tmp_path / "selected.csv").write_text("\n".join(rows) + "\n")
    rows = ["id,command,data", *(f"c{k},straightness,m{k}.csv" for k in range(3))]
    (tmp_path / "single.csv").write_text("\n".join(rows) + "\n")
    selected = list(errsep.batch(tmp_path / "selected.csv", out=tmp_path / "selected"))
    single = list(errsep.batch(tmp_path / "single.csv"))
    assert [row["result"] for row in selected[:3]] == [row["result"] for row in single]
    assert selected[3]["status"] == "failed"
    assert "no row has machine = m3" in selected[3]["message"]
    assert errsep.batch(tmp_path / "selected.csv", out=tmp_path / "selected").worked_out == 0
    # Other rows of one machine, at another time: its campaign alone is worked out again.
    many["deviation"][1] = 7.0
    parquet.write_table(pyarrow.table(many), tmp_path / "many.parquet", row_group_size=4)
    assert errsep.batch(tmp_path / "selected.csv", out=tmp_path / "selected").worked_out == 1


def test_a_wrong_list_is_told_with_its_place(tmp_path: Path) -> None:
    with pytest.raises(errsep.InputError, match="`revers` is no command") as caught:
        errsep.batch({"id": ["a"], "command": ["revers"], "data": ["a.csv"]}, out=tmp_path / "out")
    assert (caught.value.line, caught.value.column) == (2, 3)
    with pytest.raises(TypeError, match="give out"):
        errsep.batch({"id": ["a"], "command": ["circle"]}, client=object())


def test_a_cluster_that_is_killed_and_started_again_does_each_campaign_once(tmp_path: Path) -> None:
    """The script that proves it at 10 000 campaigns, at a few: killed twice, then to the end."""
    pytest.importorskip("distributed")
    script = ROOT / "examples/dask/prove.py"
    words = [sys.executable, str(script), "--campaigns", "450", "--positions", "24", "--kills", "2"]
    done = subprocess.run([*words, "--folder", str(tmp_path)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "450 campaigns, each once, the same bytes in all three folders" in done.stdout
    assert "killed 2 times" in done.stdout
