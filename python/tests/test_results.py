"""What an answer offers beside the command's own forms."""

from __future__ import annotations

import copy
import json
import pickle
import re
from base64 import b64decode
from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree

import matplotlib
import numpy as np
import pytest
from conftest import FIXTURES

import errsep

matplotlib.use("Agg")

NISTIR = FIXTURES / "nistir6868"


@pytest.fixture(scope="module")
def answers() -> dict[str, errsep.Result]:
    """One of each command."""
    four = FIXTURES / "four_sensor"
    scans = errsep.simulate("fourier", seed=5)
    reversal = FIXTURES / "reversal/readings.csv"
    machine, holes = NISTIR / "machine.toml", NISTIR / "holes.csv"
    corners = {"first": ["3", "21"], "second": ["3", "9"]}
    return {
        "reversal": errsep.reversal(reversal, simultaneous=True),
        "circle": errsep.circle(FIXTURES / "circle/six_points.csv"),
        "four_sensor": errsep.four_sensor(four / "data.csv", four / "setup.toml"),
        "fourier": errsep.fourier(scans["data"], setup=scans.setup),
        "step_diagonal": errsep.step_diagonal(errsep.simulate("step-diagonal", seed=5)["data"]),
        "predict": errsep.machine(machine, "predict", holes),
        "length": errsep.machine(machine, "length", holes, between=[("3", "9")]),
        "squareness": errsep.machine(machine, "squareness", holes, **corners),
        "anova": errsep.anova(NISTIR / "replicates.csv"),
        "straightness": errsep.straightness({"x": [0, 1, 2], "deviation": [0.0, 1.0, 0.0]}),
        "diagnose": errsep.diagnose(reversal),
        "diagnose with": errsep.diagnose(errsep.simulate("circle", repeats=3)["data"], with_="ovality"),
        "plan": errsep.plan({"noise": 0.02, "travel": 300.0, "positions": 31}),
        "simulate": errsep.simulate("reversal", seed=1),
        "simulate fourier": scans,
        "simulate anova": errsep.simulate("anova", seed=1),
    }


def test_tilts_have_what_the_guide_asks_for(answers: dict[str, errsep.Result]) -> None:
    answer = answers["reversal"]
    given = answer["tilts"]["alpha"]
    alpha = answer.tilts["alpha"]
    assert (alpha.value, alpha.std, alpha.dof) == (
        given["value"],
        given["std"],
        given["degrees_of_freedom"],
    )
    assert alpha.expanded == given["expanded"]["expanded_uncertainty"]
    assert alpha.coverage_probability == 0.95
    low, high = alpha.interval
    # The same sum worked out twice: epsilons.
    assert low == pytest.approx(given["expanded"]["lower"], rel=1e-15)
    assert high == pytest.approx(given["expanded"]["upper"], rel=1e-15)
    assert answer.quantities["tilts.alpha"] == alpha
    assert str(alpha) == "alpha = 39.997 ± 0.013 µrad"
    with pytest.raises(KeyError, match="alpha, beta, gamma"):
        answer.tilts["delta"]


def test_a_share_has_no_unit_in_words() -> None:
    assert errsep.Quantity("scale", 1e-5, 1e-7, "1").words == "(1.000 ± 0.010)e-05"


def test_degrees_of_freedom_of_what_is_known_are_infinite() -> None:
    angle = np.linspace(0, 6, 12)
    answer = errsep.circle({"x": 50 * np.cos(angle), "y": 50 * np.sin(angle)}, noise=1.0)
    assert answer.quantities["fit.radius"].dof == np.inf


def test_every_quantity_is_found_with_its_uncertainty(answers: dict[str, errsep.Result]) -> None:
    names = {name: list(answer.quantities) for name, answer in answers.items()}
    assert names["reversal"] == ["tilts.alpha", "tilts.beta", "tilts.gamma", "closure.slope"]
    assert names["circle"] == ["fit.radius", "fit.centre_x", "fit.centre_y"]
    assert names["length"] == ["results.length 3 to 9"]
    assert "points.3.deviation.x" in names["predict"]
    assert answers["length"].quantities["results.length 3 to 9"].expanded > 0
    assert len([n for n in names["anova"] if n.endswith("analysis.mean")]) == 15


def test_a_covariance_has_names(answers: dict[str, errsep.Result]) -> None:
    answer = answers["circle"]
    covariance = answer.covariance
    radius = answer.quantities["fit.radius"]
    # A root squared: epsilons.
    assert covariance["radius", "radius"] == pytest.approx(radius.std**2, rel=1e-14)
    assert covariance.unit == "mm2"
    frame = covariance.to_dataframe()
    assert frame.loc["centre_x", "radius"] == covariance["radius", "centre_x"]
    assert -1 < covariance.correlation("radius", "centre_y") < 1
    assert answers["fourier"].covariance is None


def test_tilts_of_one_fit_are_correlated(readings: Path, setup: Path) -> None:
    answer = errsep.reversal(readings, setup, simultaneous=True)
    covariance = answer.covariance
    assert covariance.names == list(answer.tilts)
    assert covariance.unit == "rad2"
    for name, tilt in answer.tilts.items():
        # A root squared: epsilons.
        assert covariance[name, name] == pytest.approx(tilt.std**2, rel=1e-12)
    numbers = answer.to_uncertainties()
    total = numbers["tilts.alpha"] + numbers["tilts.beta"]
    variance = sum(covariance[a, b] for a in ("alpha", "beta") for b in ("alpha", "beta"))
    # `uncertainties` factors the covariance by eigenvalues.
    assert total.std_dev == pytest.approx(variance**0.5, rel=1e-9)
    # Sizes of an effect are µm and s beside tilts in rad: no unit for all.
    drifting = errsep.reversal(readings, setup, simultaneous=True, with_=["thermal-drift"]).covariance
    assert drifting.unit == "" and any(name.startswith("thermal-drift.") for name in drifting.names)


def test_what_is_not_determined_is_told(answers: dict[str, errsep.Result], readings: Path) -> None:
    assert len(answers["four_sensor"].not_determined) == 3
    assert any("positioning" in words for words in answers["step_diagonal"].not_determined)
    assert "effect gravity-sag" in answers["diagnose"].not_determined
    assert "effect gravity-sag" in answers["plan"].not_determined
    assert answers["reversal"].not_determined == []
    lines = readings.read_text().splitlines()
    two = "\n".join(line for line in lines if line.startswith(("channel", "1A", "2B"))) + "\n"
    few = errsep.reversal(two)
    assert [name for name in few.not_determined if name.startswith("tilt")]
    assert not set(few.tilts) & {name.removeprefix("tilt ") for name in few.not_determined}


def test_warnings_are_those_of_the_command(tmp_path: Path) -> None:
    still = dict(errsep.simulate("reversal", seed=1)["data"])
    pairs = zip(still["channel"], still["reading"], strict=True)
    still["reading"] = [0.0 if channel == "1A" else reading for channel, reading in pairs]
    answer = errsep.reversal(still)
    assert answer.warnings == answer["warnings"]
    assert any("all readings of 1A are equal" in warning for warning in answer.warnings)
    four = FIXTURES / "four_sensor"
    setup = tmp_path / "setup.toml"
    setup.write_text((four / "setup.toml").read_text() + '\n[separation]\npenalty = "profile"\n')
    assert "L-curve" in errsep.four_sensor(four / "data.csv", setup).warnings[0]


def test_a_pickle_and_a_copy_keep_everything(answers: dict[str, errsep.Result], tmp_path: Path) -> None:
    assert "length = 100" in answers["simulate fourier"].setup
    for name, answer in answers.items():
        again = pickle.loads(pickle.dumps(answer))
        twice = pickle.loads(pickle.dumps(again))
        for other in (again, twice, copy.copy(answer), copy.deepcopy(answer)):
            assert other.to_json() == answer.to_json(), name
            assert other.summary() == answer.summary()
            assert other.figures() == answer.figures()
            assert other.setup == answer.setup
            assert repr(other) == repr(answer)
        answer.report(tmp_path / name / "before")
        twice.report(tmp_path / name / "after")
        for file in (tmp_path / name / "before").iterdir():
            assert (tmp_path / name / "after" / file.name).read_bytes() == file.read_bytes(), file


def test_json_and_dictionary_are_the_same_and_the_caller_s_own(answers: dict[str, errsep.Result]) -> None:
    answer = answers["reversal"]
    assert answer.to_dict() == json.loads(answer.to_json())
    answer.to_dict()["tilts"].clear()
    assert answer["tilts"] and "tilts" in answer


def test_an_answer_is_a_mapping(answers: dict[str, errsep.Result]) -> None:
    answer = answers["reversal"]
    assert isinstance(answer, Mapping)
    assert list(answer) == list(answer.keys()) == list(json.loads(answer.to_json()))
    assert len(answer) == len(answer.to_dict()) and dict(answer) == answer.to_dict()
    assert dict(answer.items())["tilts"] == answer["tilts"]
    assert answer.get("nothing") is None
    with pytest.raises(KeyError, match="nothing"):
        answer["nothing"]


def test_a_diagnosis_has_the_sizes_of_the_causes_that_it_names() -> None:
    made = errsep.simulate("circle", repeats=4, noise=0.2, effects={"ovality": 2.0}, seed=1)
    answer = errsep.diagnose(made["data"], severity=0)
    assert answer["verdict"]["effects"] == ["ovality"]
    size = answer.quantities["candidates.ovality.parameters.amplitude"]
    assert (size.label, size.unit, size.dof) == ("amplitude", "um", answer["noise"]["degrees_of_freedom"])
    # k·u with k = 4.
    assert abs(size.value - 2.0) < 4 * size.std
    assert 10 < size.dof < np.inf and size.expanded is None
    # What is not named has no size.
    assert all(name.startswith("candidates.ovality.") for name in answer.quantities)
    assert len(answer["candidates"]) > 1
    stated = errsep.diagnose(made["data"], {"circle": {"noise": 0.2}}, severity=0)
    assert stated.quantities["candidates.ovality.parameters.amplitude"].dof == np.inf
    nothing = errsep.diagnose(errsep.simulate("circle", repeats=3, seed=2)["data"])
    assert nothing["verdict"]["kind"] == "none" and not nothing.quantities


def test_effects_in_a_fit_are_quantities_once(readings: Path) -> None:
    made = errsep.simulate("step-diagonal", repeats=3, effects={"drift": 2.0}, seed=3)["data"]
    answer = errsep.step_diagonal(made, with_="drift")
    sizes = [name for name in answer.quantities if "drift" in name]
    told = answer["effects"][0]["parameters"]
    names = [one["name"] for one in told] + [one["linear"]["name"] for one in told if "linear" in one]
    assert len(names) > len(told)
    assert sorted(sizes) == sorted(f"effects.drift.parameters.{name}" for name in names)
    assert answer.quantities[sizes[0]].dof == answer["with"]["noise"]["degrees_of_freedom"]
    alone = errsep.diagnose(made, with_="drift").quantities
    assert {name: alone[name] for name in sizes} == {name: answer.quantities[name] for name in sizes}
    # A diagnosis beside the answer stands in its own place.
    data = errsep.simulate("reversal", repeats=3, positions=61, thickness=42, effects={"taper": 1e-4}, seed=2)
    setup = {"artefact": {"thickness": 42}}
    beside = errsep.reversal(data["data"], setup, simultaneous=True, diagnose=True)
    assert beside["diagnosis"]["verdict"]["effects"] == ["taper"]
    assert beside.quantities["diagnosis.candidates.taper.parameters.half-angle"].unit == "rad"


def test_a_data_frame_has_the_profiles(answers: dict[str, errsep.Result]) -> None:
    answer = answers["reversal"]
    frame = answer.to_dataframe()
    assert frame["M_um"].tolist() == answer["forms"]["M"]
    residuals = answer.to_dataframe("residuals")
    assert set(residuals["channel"]) == {"1A", "1B", "2A", "2B"}
    with pytest.raises(KeyError, match="profiles, closure, residuals"):
        answer.to_dataframe("nothing")
    assert answers["length"].to_dataframe().loc["results.length 3 to 9", "unit"] == "um"


def test_a_dataset_has_coordinates_and_units(answers: dict[str, errsep.Result]) -> None:
    dataset = answers["reversal"].to_xarray()
    assert dataset["M_um"].dims == ("x_mm",) and dataset["M_um"].attrs["units"] == "um"
    assert dataset["M_um"].sel(x_mm=300.0).item() == answers["reversal"]["forms"]["M"][-1]
    assert answers["reversal"].to_xarray("residuals")["channel"].dims == ("row",)
    with pytest.raises(ValueError, match="no tables"):
        answers["length"].to_xarray()


def test_uncertain_numbers_keep_the_correlation(answers: dict[str, errsep.Result]) -> None:
    """The uncertainty of a sum by two other packages against the formula, on numbers of order one:
    epsilons, and 1e-9 for `uncertainties`, which factors the covariance by eigenvalues."""
    answer = answers["circle"]
    covariance = answer.covariance
    variance = sum(covariance[a, b] for a in ("radius", "centre_y") for b in ("radius", "centre_y"))
    numbers = answer.to_uncertainties()
    total = numbers["fit.radius"] + numbers["fit.centre_y"]
    assert total.std_dev == pytest.approx(variance**0.5, rel=1e-9)
    numbers = answer.to_gtc()
    total = numbers["fit.radius"] + numbers["fit.centre_y"]
    assert total.u == pytest.approx(variance**0.5, rel=1e-14)
    assert total.df == pytest.approx(3.0, rel=1e-14)
    alpha = answers["reversal"].to_gtc()["tilts.alpha"]
    assert (alpha.x, alpha.u) == (
        answers["reversal"].tilts["alpha"].value,
        answers["reversal"].tilts["alpha"].std,
    )


def test_a_notebook_shows_the_report_s_own_drawing(answers: dict[str, errsep.Result]) -> None:
    answer = answers["reversal"]
    page = answer._repr_html_()
    drawn = re.findall(r'src="data:image/svg\+xml;base64,([^"]+)"', page)
    assert [b64decode(one).decode() for one in drawn] == [f[2] for f in answer.figures()[:2]]
    for _, _, svg in answer.figures():
        ElementTree.fromstring(svg)
    assert "39.997 ± 0.013 µrad" in page and "<script" not in page and "<style" not in page
    hostile = errsep.straightness({"x": [0, 1, 2], "deviation": [0.0, 1.0, 0.0]})
    assert "<b>" not in errsep.result.notebook("<b>", "<b>", "<b>", ["<b>"], [("<b>", "<b>", "")])
    assert hostile._repr_html_().startswith('<div class="errsep">')


def test_every_answer_can_be_drawn(answers: dict[str, errsep.Result]) -> None:
    from matplotlib import pyplot

    for name, answer in answers.items():
        figure, ax = pyplot.subplots()
        assert answer.plot(ax=ax) is ax, name
        assert ax.has_data() and ax.get_title(), name
        figure.canvas.draw()
        pyplot.close(figure)
    ax = answers["reversal"].plot()
    lines = {line.get_label(): line.get_ydata() for line in ax.get_lines()}
    assert lines["M"].tolist() == answers["reversal"]["forms"]["M"]
    pyplot.close("all")


def test_the_program_comes_with_the_package(tmp_path: Path) -> None:
    import subprocess
    import sys

    profile = tmp_path / "profile.csv"
    profile.write_text("x,deviation\n0,0\n1,1\n2,0\n")
    script = Path(sys.executable).parent / "errsep"

    def run(words: list[str], *more: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([*words, *more], capture_output=True, text=True, check=False)

    for words in ([str(script)], [sys.executable, "-m", "errsep"]):
        done = run(words, "straightness", str(profile))
        assert done.returncode == 0, done.stderr
        assert done.stdout == errsep.straightness(profile).summary()
        assert run(words, "straightness", "/nowhere.csv").returncode == 2
        assert run(words, "--version").stdout == f"errsep {errsep.__version__}\n"
