"""What the tests share: fixtures, and the program that the functions are compared with."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
FIXTURES = ROOT / "fixtures"


def program() -> Path:
    """The program that cargo builds from the workspace, not the one that the package brings."""
    found = os.environ.get("ERRSEP_PROGRAM", str(ROOT / "target/debug/errsep"))
    return Path(found)


@pytest.fixture(scope="session")
def command() -> Callable[..., dict[str, Any]]:
    """Runs the program and returns its JSON without what differs from run to run."""

    def run(*arguments: str | Path) -> dict[str, Any]:
        words = [str(program()), *map(str, arguments), "--format", "json"]
        done = subprocess.run(words, capture_output=True, check=False, text=True)
        assert done.stdout, done.stderr
        return plain(json.loads(done.stdout))

    return run


def plain(answer: dict[str, Any]) -> dict[str, Any]:
    """An answer without its provenance and the seconds that it took."""
    answer = {key: value for key, value in answer.items() if key != "provenance"}
    if "convergence" in answer:
        answer["convergence"] = {k: v for k, v in answer["convergence"].items() if k != "seconds"}
    return answer


@pytest.fixture(scope="session")
def readings() -> Path:
    return FIXTURES / "reversal/readings.csv"


@pytest.fixture(scope="session")
def setup() -> Path:
    return FIXTURES / "reversal/setup.toml"
