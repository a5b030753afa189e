"""Each function gives what the command gives, to the last bit: both are written by one serializer, so
the comparison is of equality and has no tolerance."""

from __future__ import annotations

import inspect
import math
import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from conftest import FIXTURES, plain, program

import errsep

NISTIR = FIXTURES / "nistir6868"

_SAME = {name: name for name in ("channel", "repeat", "direction", "time", "x", "reading")}
_WORDS = ",".join(f"{name}={name}" for name in _SAME)


def changed(seed: int, change: Callable[[float], float]) -> str:
    """A calibration line whose readings are changed by a function of the load, which no effect explains."""
    lines = []
    for line in errsep.simulate("calibration-line", sets=6, seed=seed).summary().splitlines():
        fields = line.split(",")
        if line[0].isdigit():
            fields[1] = repr(float(fields[1]) + change(float(fields[0])))
        lines.append(",".join(fields))
    return "\n".join(lines) + "\n"


def swing(load: float) -> float:
    return 0.02 * math.cos(2 * math.pi * load / 3.1 + 0.4)


def renamed(text: str, names: dict[str, str]) -> str:
    """A table whose columns have other names; lines of comment are left out."""
    header, *rows = [line for line in text.splitlines() if line[:1] != "#"]
    columns = ",".join(names.get(name, name) for name in header.split(","))
    return "\n".join([columns, *rows]) + "\n"


def with_effects(tmp_path: Path) -> dict[str, tuple[Callable[[], errsep.Result], list[str | Path]]]:
    """Effects in the fit, and columns by other names, for every command that takes them."""

    def written(name: str, text: str) -> Path:
        (tmp_path / name).write_text(text)
        return tmp_path / name

    made = {
        "circle": errsep.simulate("circle", repeats=3, noise=0.2, effects="ovality=0.8", seed=3),
        "four-sensor": errsep.simulate("four-sensor", repeats=3, effects=["gain=0.003"], seed=3),
        "fourier": errsep.simulate("fourier", repeats=3, positions=200, effects={"yaw": 2e-5}, seed=3),
        "step-diagonal": errsep.simulate("step-diagonal", repeats=3, effects={"drift": 2}, seed=3),
    }
    oval = written("oval.csv", renamed(made["circle"].summary(), {"x": "u", "y": "v", "repeat": "n"}))
    bent = written("bent.csv", renamed(made["four-sensor"].summary(), {"repeat": "run"}))
    sensors = ",".join(["x=x", "repeat=run", *(f"m{k}=m{k}" for k in range(1, 5))])
    four = written("four.toml", made["four-sensor"].setup or "")
    yawing = written("yawing.csv", made["fourier"].summary())
    section = written("yawing.toml", made["fourier"].setup or "")
    drifting = written("drifting.csv", made["step-diagonal"].summary())
    return {
        "circle with an effect, columns": (
            lambda: errsep.circle(oval, with_="ovality", columns={"x": "u:mm", "y": "v:mm", "repeat": "n"}),
            ["circle", oval, "--with", "ovality", "--columns", "x=u:mm,y=v:mm,repeat=n"],
        ),
        "four-sensor with an effect, columns": (
            lambda: errsep.four_sensor(bent, four, with_=["gain"], columns=sensors),
            ["four-sensor", bent, "--setup", four, "--with", "gain", "--columns", sensors],
        ),
        "fourier with an effect": (
            lambda: errsep.fourier(yawing, setup=section, with_="yaw", seed=2),
            ["fourier", yawing, "--setup", section, "--with", "yaw", "--seed", "2"],
        ),
        "step-diagonal with an effect": (
            lambda: errsep.step_diagonal(drifting, with_="drift"),
            ["step-diagonal", drifting, "--with", "drift"],
        ),
        "diagnose with an effect": (
            lambda: errsep.diagnose(drifting, with_=("drift", "thermal-expansion")),
            ["diagnose", drifting, "--with", "drift,thermal-expansion"],
        ),
    }


def both(tmp_path: Path) -> dict[str, tuple[Callable[[], errsep.Result], list[str | Path]]]:
    """A call of each function and the command that is the same."""
    readings, setup = FIXTURES / "reversal/readings.csv", FIXTURES / "reversal/setup.toml"
    four, four_setup = FIXTURES / "four_sensor/data.csv", FIXTURES / "four_sensor/setup.toml"
    machine, holes = NISTIR / "machine.toml", NISTIR / "holes.csv"
    scans, section = tmp_path / "scans.csv", tmp_path / "section.toml"
    made = errsep.simulate("fourier", seed=5)
    scans.write_text(made.summary())
    section.write_text(made.setup or "")
    profile = tmp_path / "profile.csv"
    steps = tmp_path / "steps.csv"
    steps.write_text(errsep.simulate("step-diagonal", seed=5).summary())
    profile.write_text("x,deviation\n0,-0.3\n100,0.9\n200,0.1\n")
    forms = tmp_path / "forms.csv"
    (tmp_path / "of.csv").write_text("x,M,S\n0,0,1\n1,1,0\n2,0.5,1\n")
    forms.write_text("place,M,S\n0,-0.3,1\n100,0.9,0\n200,0.1,1\n")
    replicates = tmp_path / "replicates.csv"
    replicates.write_text("piece,length\n1,1.0\n1,1.2\n2,3.0\n2,3.4\n")
    drilled = tmp_path / "drilled.csv"
    drilled.write_text(renamed((NISTIR / "drilled_holes.csv").read_text(), {"value": "found"}))
    holes_by = {name: name for name in ("part", "point", "axis", "replicate")} | {"value": "found:um"}
    holes_words = "part=part,point=point,axis=axis,replicate=replicate,value=found:um"
    planned = {"noise": 0.02, "travel": 300.0, "positions": 31, "repeats": 2}
    plan = tmp_path / "plan.toml"
    plan.write_text("\n".join(f"{key} = {value}" for key, value in planned.items()))
    sealed, planned_next = tmp_path / "sealed.toml", tmp_path / "next.csv"
    lines = readings.read_text().splitlines()
    planned_next.write_text("\n".join(line.rsplit(",", 1)[0] for line in lines if line[:1] != "#") + "\n")
    errsep.diagnose(readings, setup, severity=0, seal=sealed, next=planned_next)
    lawful = tmp_path / "lawful.csv"
    lawful.write_text(changed(1, swing))
    made_machine = {"stations": 5, "repeats": 3, "seed": 2}
    return {
        "reversal": (lambda: errsep.reversal(readings), ["reversal", readings]),
        "reversal, simultaneous": (
            lambda: errsep.reversal(readings, setup, simultaneous=True),
            ["reversal", readings, "--setup", setup, "--simultaneous"],
        ),
        "reversal with effects": (
            lambda: errsep.reversal(readings, simultaneous=True, with_=["thermal-drift", "zero-jump"]),
            ["reversal", readings, "--simultaneous", "--with", "thermal-drift,zero-jump"],
        ),
        "reversal, diagnosed": (
            lambda: errsep.reversal(readings, setup, simultaneous=True, diagnose=True, seed=3),
            ["reversal", readings, "--setup", setup, "--simultaneous", "--diagnose", "--seed", "3"],
        ),
        "circle": (
            lambda: errsep.circle(FIXTURES / "circle/six_points.csv", nistir=True),
            ["circle", FIXTURES / "circle/six_points.csv", "--nistir"],
        ),
        "four-sensor": (
            lambda: errsep.four_sensor(four, four_setup),
            ["four-sensor", four, "--setup", four_setup],
        ),
        "fourier": (
            lambda: errsep.fourier(scans, setup=section, length=100.0),
            ["fourier", scans, "--setup", section, "--length", "100"],
        ),
        "step-diagonal": (
            lambda: errsep.step_diagonal(steps, choose=True),
            ["step-diagonal", steps, "--choose"],
        ),
        "machine predict": (
            lambda: errsep.machine(machine, "predict", holes, independence="points"),
            ["machine", machine, "predict", holes, "--independence", "points"],
        ),
        "machine length": (
            lambda: errsep.machine(machine, "length", holes, between=[("3", "9"), "3:15"], trials=500),
            ["machine", machine, "length", holes, *"--between 3:9 --between 3:15 --trials 500".split()],
        ),
        "machine circularity": (
            lambda: errsep.machine(machine, "circularity", centre=(75, 75), radius=44.5, trials=300, seed=4),
            ["machine", machine, *"circularity --centre 75,75 --radius 44.5 --trials 300 --seed 4".split()],
        ),
        "machine parts": (
            lambda: errsep.machine(machine, "parts", NISTIR / "drilled_holes.csv", points=holes),
            ["machine", machine, "parts", NISTIR / "drilled_holes.csv", "--points", holes],
        ),
        "machine parts, columns": (
            lambda: errsep.machine(machine, "parts", drilled, points=holes, columns=holes_by),
            ["machine", machine, "parts", drilled, "--points", holes, "--columns", holes_words],
        ),
        "anova": (
            lambda: errsep.anova(NISTIR / "replicates.csv", recipe="section-5.1", confidence=0.9),
            ["anova", NISTIR / "replicates.csv", "--recipe", "section-5.1", "--confidence", "0.9"],
        ),
        "anova, columns": (
            lambda: errsep.anova(replicates, columns={"part": "piece", "value": "length:mm"}),
            ["anova", replicates, "--columns", "part=piece,value=length:mm"],
        ),
        "straightness": (lambda: errsep.straightness(profile), ["straightness", profile]),
        "straightness, columns": (
            lambda: errsep.straightness(forms, columns="x=place:mm,deviation=M:um"),
            ["straightness", forms, "--columns", "x=place:mm,deviation=M:um"],
        ),
        "straightness of a form": (
            lambda: errsep.straightness({"x": [0, 1, 2], "M": [0.0, 1.0, 0.5], "S": [1, 0, 1]}, of="M"),
            ["straightness", forms.with_name("of.csv"), "--of", "M"],
        ),
        "diagnose": (
            lambda: errsep.diagnose(readings, setup, without=["taper"], false_alarm=0.05),
            ["diagnose", readings, "--setup", setup, "--without", "taper", "--false-alarm", "0.05"],
        ),
        "diagnose, columns and severity": (
            lambda: errsep.diagnose(readings, setup, columns=_SAME, severity=0),
            ["diagnose", readings, "--setup", setup, "--columns", _WORDS, "--severity", "0"],
        ),
        "diagnose, law": (
            lambda: errsep.diagnose(lawful, model="calibration-line", law=True),
            ["diagnose", lawful, "--model", "calibration-line", "--law"],
        ),
        "check": (lambda: errsep.check(sealed, readings), ["check", sealed, readings]),
        "plan": (lambda: errsep.plan(planned), ["plan", plan]),
        **with_effects(tmp_path),
        "simulate": (
            lambda: errsep.simulate("reversal", alpha=-5, thickness=42, effects={"zero-jump": 0.2}, seed=7),
            ["simulate", "reversal", *"--alpha=-5 --thickness 42 --effect zero-jump=0.2 --seed 7".split()],
        ),
        "simulate, lists": (
            lambda: errsep.simulate(
                "circle", lobe=["2:1.5", "3:0.8"], effects=["ovality=1", "squareness=1e-5"]
            ),
            [
                *"simulate circle --lobe 2:1.5 --lobe 3:0.8".split(),
                *"--effect ovality=1 --effect squareness=1e-5".split(),
            ],
        ),
        "simulate, numbers in lists": (
            lambda: errsep.simulate("step-diagonal", travel=[500, 400, 300], sequence=["XYZ", "ZYX"]),
            "simulate step-diagonal --travel 500 400 300 --sequence XYZ --sequence ZYX".split(),
        ),
        "simulate machine": (
            lambda: errsep.simulate("machine", machine, points=holes, **made_machine),
            [
                *["simulate", "machine", machine, "--points", holes],
                *"--stations 5 --repeats 3 --seed 2".split(),
            ],
        ),
    }


@pytest.fixture(scope="module")
def calls(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return both(tmp_path_factory.mktemp("inputs"))


@pytest.mark.parametrize(
    "name",
    [
        "reversal",
        "reversal, simultaneous",
        "reversal with effects",
        "reversal, diagnosed",
        "circle",
        "four-sensor",
        "fourier",
        "step-diagonal",
        "machine predict",
        "machine length",
        "machine circularity",
        "machine parts",
        "machine parts, columns",
        "anova",
        "anova, columns",
        "straightness",
        "straightness, columns",
        "straightness of a form",
        "diagnose",
        "diagnose, columns and severity",
        "diagnose, law",
        "check",
        "plan",
        "circle with an effect, columns",
        "four-sensor with an effect, columns",
        "fourier with an effect",
        "step-diagonal with an effect",
        "diagnose with an effect",
        "simulate",
        "simulate, lists",
        "simulate, numbers in lists",
        "simulate machine",
    ],
)
def test_the_answer_is_that_of_the_command(
    name: str, calls: dict[str, Any], command: Callable[..., dict[str, Any]]
) -> None:
    call, words = calls[name]
    answer = call()
    assert plain(answer.to_dict()) == command(*words)
    assert repr(answer).startswith(f"<errsep {words[0]}")


def test_every_call_is_compared(calls: dict[str, Any]) -> None:
    mark = next(m for m in test_the_answer_is_that_of_the_command.pytestmark)
    assert list(calls) == mark.args[1]
    functions = {"_".join(words[0].split("-")) for _, words in calls.values()}
    known = {"reversal", "circle", "four_sensor", "fourier", "step_diagonal", "machine", "anova"}
    assert functions == known | {"straightness", "diagnose", "check", "plan", "simulate"}


@pytest.mark.parametrize(
    "words",
    [
        *["reversal", "circle", "four-sensor", "fourier", "step-diagonal", "anova", "straightness"],
        *[f"machine {action}" for action in ("predict", "length", "squareness", "circularity", "parts")],
        *["diagnose", "check", "plan"],
    ],
)
def test_every_option_of_the_command_is_an_argument(words: str) -> None:
    """But for how the answer is delivered, and the seed where nothing is random."""
    told = subprocess.run([program(), *words.split(), "--help"], capture_output=True, check=True, text=True)
    options = set(re.findall(r"^ +(?:-\w, )?--([a-z-]+)", told.stdout, re.MULTILINE))
    function = getattr(errsep, words.split()[0].replace("-", "_"))
    given = {name.strip("_").replace("_", "-") for name in inspect.signature(function).parameters}
    assert options - given <= {"format", "out", "force", "quiet", "help", "seed"}
    assert "with" not in options or "seed" in given


def test_the_text_is_that_of_the_command(readings: Path) -> None:
    words = [str(program()), "reversal", str(readings)]
    printed = subprocess.run(words, capture_output=True, check=True, text=True).stdout
    assert errsep.reversal(readings).summary() == printed


def test_the_report_is_that_of_the_command(readings: Path, tmp_path: Path) -> None:
    """The same files with the same bytes, but for the command line and the seconds told in two of them."""
    ours, theirs = tmp_path / "ours", tmp_path / "theirs"
    errsep.reversal(readings).report(ours)
    words = [str(program()), "reversal", str(readings), "--out", str(theirs)]
    subprocess.run(words, capture_output=True, check=True)
    names = sorted(path.name for path in theirs.iterdir())
    assert sorted(path.name for path in ours.iterdir()) == names
    for name in names:
        if name not in ("report.html", "result.json"):
            assert (ours / name).read_bytes() == (theirs / name).read_bytes(), name
    told = f" --out {theirs}"
    page = (theirs / "report.html").read_text()
    assert told in page
    assert (ours / "report.html").read_text() == page.replace(told, "")


def test_a_law_is_written_as_the_command_writes_it(
    tmp_path: Path, command: Callable[..., dict[str, Any]]
) -> None:
    data = tmp_path / "monday.csv"
    data.write_text(changed(1, swing))
    for folder in ("ours", "theirs"):
        (tmp_path / folder).mkdir()
    ours, theirs = tmp_path / "ours/swing.toml", tmp_path / "theirs/swing.toml"
    answer = plain(errsep.diagnose(data, model="calibration-line", law=ours).to_dict())
    expected = command("diagnose", data, "--model", "calibration-line", "--law", theirs)
    assert answer["law"].pop("file") == str(ours)
    assert expected["law"].pop("file") == str(theirs)
    assert answer == expected and answer["law"]["found"]
    assert ours.read_bytes() == theirs.read_bytes()


def test_a_law_that_is_not_there_cannot_be_written(tmp_path: Path) -> None:
    def curve(load: float) -> float:
        u = load / 10
        return 0.02 * math.sin(math.sinh(2 * (u - 0.3))) * (1 + u) + 0.012 * math.cos(9 * u * u)

    data = changed(3, curve)
    told = errsep.diagnose(data, model="calibration-line", law=True)
    assert told["law"]["found"] is False
    with pytest.raises(errsep.NotDetermined, match="not determined: a law") as caught:
        errsep.diagnose(data, model="calibration-line", law=tmp_path / "law.toml")
    assert told["law"]["why"] in caught.value.what
    assert caught.value.result["law"] == told["law"]
    assert not (tmp_path / "law.toml").exists()
