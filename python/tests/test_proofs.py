"""The scripts that need a controller or a browser, each on a stand-in for it (`stand_ins/`): that they run,
and that they fail where they have to."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from conftest import ROOT, program

STAND_INS = Path(__file__).parent / "stand_ins"


def prove(script: str, *words: str | Path, **environment: str) -> subprocess.CompletedProcess[str]:
    path = f"{STAND_INS}{os.pathsep}{os.environ['PATH']}"
    variables = {**os.environ, "PATH": path, "ERRSEP": str(program()), **environment}
    command = [str(ROOT / "examples" / script), *map(str, words)]
    return subprocess.run(command, env=variables, capture_output=True, text=True, check=False)


def test_the_loop_closes_on_a_controller(tmp_path: Path) -> None:
    done = prove("linuxcnc/prove", tmp_path, PROVE_RUNS="2")
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.endswith("what is left is the noise\n")
    # A controller that did not load the table leaves what the screw errs.
    after = (tmp_path / "before.csv", tmp_path / "before.csv")
    judge = ["python3", str(ROOT / "examples/linuxcnc/judge.py"), *map(str, after)]
    judged = subprocess.run(judge, capture_output=True, text=True, check=False)
    assert judged.returncode == 1
    assert judged.stdout.endswith("what is left is NOT the noise\n")


def test_pages_have_what_a_screen_reader_needs(tmp_path: Path) -> None:
    names = ("circle", "positioning", "reversal-measured", "diagnose-drift", "batch")
    done = prove("accessible_pages/prove", tmp_path, *names)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout == f"{len(names)} pages: 0 things lacking\n"


@pytest.mark.parametrize(
    ("spoilt", "by", "told"),
    [
        (' lang="en"', "", "no language"),
        ('role="img" aria-label=', 'role="img" title=', "a picture without a name"),
        ("<h2", "<h4", "h4 under h1"),
    ],
)
def test_what_a_page_lacks_is_seen(tmp_path: Path, spoilt: str, by: str, told: str) -> None:
    prove("accessible_pages/prove", tmp_path, "circle")
    page = tmp_path / "pages/circle/report.html"
    text = page.read_text()
    assert spoilt in text
    page.write_text(text.replace(spoilt, by))
    node = [str(STAND_INS / "node"), "check.mjs", str(tmp_path / "pages")]
    done = subprocess.run(node, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert told in done.stdout
