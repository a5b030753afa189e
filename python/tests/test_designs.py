"""Readings of designs at any angles, by columns ``indicator`` and ``spindle``, and several parts at once."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import errsep

BOTH_PLANES = ",".join(f"{i}/{s}" for s in (0, 90, 180) for i in (0, 90, 180, 270))


@pytest.fixture(scope="module")
def made() -> errsep.Result:
    return errsep.simulate("reversal", design=BOTH_PLANES, positions=41, seed=3)


def test_a_design_is_solved_from_columns(made: errsep.Result) -> None:
    data = made["data"]
    assert {"indicator", "spindle", "x", "reading"} <= set(data)
    answer = errsep.reversal(data)
    assert answer["schema"] == "errsep.reversal/2"
    assert len(answer["design"]) == 12
    assert answer.tilts and all(tilt.std > 0 for tilt in answer.tilts.values())
    truth = made["truth"]["tilts"]
    for name, tilt in answer.tilts.items():
        # k·u, one seed.
        assert abs(tilt.value - truth[name]["value"]) < 5 * tilt.std, name
    assert all(isinstance(words, str) for words in answer.not_determined)
    assert "profiles" in answer.tables


def test_two_channels_say_what_they_leave_open(made: errsep.Result) -> None:
    data = made["data"]
    kept = (np.asarray(data["spindle"]) == 0) & (np.asarray(data["indicator"]) % 180 == 90)
    few = {name: np.asarray(values)[kept] for name, values in data.items()}
    answer = errsep.reversal(few)
    told = [words for words in answer.not_determined if ": " in words]
    assert told, answer.not_determined


def test_a_batch_takes_designs(made: errsep.Result, tmp_path: Path) -> None:
    (tmp_path / "planes.csv").write_text(made.summary())
    campaigns = {"id": ["one"], "command": ["reversal"], "data": [str(tmp_path / "planes.csv")]}
    errsep.batch(campaigns, out=tmp_path / "answers")
    (part,) = sorted((tmp_path / "answers").glob("part-*.ndjson"))
    row = json.loads(part.read_text())
    assert (row["status"], row["result"]["schema"]) == ("done", "errsep.reversal/2")
    own = errsep.reversal(tmp_path / "planes.csv")
    assert row["result"]["tilts"] == own["tilts"]


def test_parts_come_as_a_list_of_tables() -> None:
    table = "Pt  X nom  Y nom  X act  Y act\nA 0 0 {a} 0\nB 60 0 60.002 0.001\n"
    tables = [table.format(a=a) for a in ("0.001", "-0.002")]
    answer = errsep.machine({"chain": "FXYZ"}, "parts", tables)
    assert answer["readings"] == 8
    parts = answer.tables["residuals"]["part"]
    assert len(set(parts)) == 2
