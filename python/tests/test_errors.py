"""Errors say where and what to do, and go through a pickle."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest

import errsep


def test_wrong_input_has_file_line_column_and_help(tmp_path: Path) -> None:
    file = tmp_path / "profile.csv"
    file.write_text("# a comment\nx,deviation\n0,1\n1,two\n")
    with pytest.raises(errsep.InputError) as caught:
        errsep.straightness(file)
    error = caught.value
    assert (error.file, error.line, error.column, error.row) == (str(file), 4, 3, None)
    assert "two" in error.what and error.help
    assert str(error).startswith(f"{file}:4:3: ") and f"help: {error.help}" in str(error)
    assert isinstance(error, errsep.Error) and isinstance(error, ValueError)


def test_a_misspelt_key_of_a_dictionary_is_named_with_the_nearest(readings: Path) -> None:
    with pytest.raises(errsep.InputError, match="unknown key `thicknes`") as caught:
        errsep.reversal(readings, {"artefact": {"thicknes": 42}})
    assert (caught.value.file, caught.value.line, caught.value.row) == ("<setup>", 2, None)
    assert "did you mean `thickness`" in str(caught.value.help)


def test_a_file_that_is_not_there_and_options_that_do_not_go_together(readings: Path) -> None:
    with pytest.raises(errsep.InputError, match="cannot be read") as caught:
        errsep.circle("/nowhere.csv")
    assert caught.value.file == "/nowhere.csv" and caught.value.line is None
    with pytest.raises(errsep.InputError, match="cannot be used with"):
        errsep.reversal(readings, method="shear", simultaneous=True)
    with pytest.raises(errsep.InputError, match="invalid value") as caught:
        errsep.reversal(readings, method="sheer")
    assert caught.value.help == "a similar value exists: 'shear'"
    with pytest.raises(errsep.InputError, match="zero-jmp") as caught:
        errsep.reversal(readings, simultaneous=True, with_=["zero-jmp"])
    assert "did you mean `zero-jump`" in str(caught.value.help)


def test_what_is_not_determined_comes_with_what_there_is() -> None:
    with pytest.raises(errsep.NotDetermined) as caught:
        errsep.anova({"part": [1, 2, 3], "value": [1.0, 2.0, 3.0]})
    answer = caught.value.result
    assert answer["features"][0]["analysis"]["components"]["within"] is None
    assert answer.not_determined and answer.not_determined[0] in str(caught.value)


def test_what_is_refused_without_an_answer_has_none() -> None:
    bent = {"x": [0.0, 1, 2, 3, 4, 5], "y": [0.0, 1, 0, 1, 0, 1]}
    with pytest.raises(errsep.NotDetermined, match="straight line") as caught:
        errsep.circle(bent)
    assert caught.value.result is None and caught.value.help == "measure a longer arc"


def test_a_fit_that_does_not_converge_comes_with_how_far_it_got() -> None:
    with pytest.raises(errsep.NotConverged, match="grows") as caught:
        errsep.least_squares(lambda p: [np.exp(-p[0]), 0.0], {"a": 1.0})
    fit = caught.value.partial
    assert fit.kind == "runs-away" and not fit.converged and fit.x[0] > 10
    assert caught.value.result is fit


def test_a_reversal_that_does_not_converge_comes_with_how_far_it_got() -> None:
    # One pass without a drift: nothing bounds the time constant of one that is fitted.
    data = errsep.simulate("reversal", positions=500, thickness=42.0, alpha=0, seed=0)["data"]
    with pytest.raises(errsep.NotConverged, match="thermal-drift has no answer") as caught:
        errsep.reversal(data, {"artefact": {"thickness": 42}}, simultaneous=True, with_=["thermal-drift"])
    partial = caught.value.partial
    assert caught.value.result is None
    assert set(partial["tilts"]) == {"alpha", "beta", "gamma"}
    assert all(tilt["unit"] == "rad" and abs(tilt["value"]) < 1 for tilt in partial["tilts"].values())
    (drift,) = partial["effects"]
    assert drift["effect"] == "thermal-drift"
    assert all(isinstance(p["value"], float) and p["unit"] for p in drift["parameters"])
    assert partial["residual"]["rms"] > 0 and partial["residual"]["unit"] == "um"
    convergence = partial["convergence"]
    assert convergence["converged"] is False and convergence["iterations"] > 0
    assert convergence["reason"] in caught.value.what
    again = pickle.loads(pickle.dumps(caught.value))
    assert again.partial == partial and str(again) == str(caught.value)


def test_errors_go_through_a_pickle_and_a_copy() -> None:
    caught = []
    for call in (
        lambda: errsep.straightness({"x": [0.0, 1.0], "deviation": [0.0, np.nan]}),
        lambda: errsep.anova({"part": [1, 2, 3], "value": [1.0, 2.0, 3.0]}),
        lambda: errsep.least_squares(lambda p: [np.exp(-p[0]), 0.0], {"a": 1.0}),
    ):
        with pytest.raises(errsep.Error) as error:
            call()
        caught.append(error.value)
    for error in caught:
        for again in (pickle.loads(pickle.dumps(error)), copy.deepcopy(error)):
            assert type(again) is type(error) and str(again) == str(error)
            assert (again.row, again.line) == (error.row, error.line)
            if isinstance(error, (errsep.NotDetermined, errsep.NotConverged)):
                assert again.result.to_dict() == error.result.to_dict()


def test_a_folder_that_holds_something_else_is_not_replaced(tmp_path: Path) -> None:
    answer = errsep.straightness({"x": [0.0, 1.0, 2.0], "deviation": [0.0, 1.0, 0.0]})
    (tmp_path / "report.html").write_text("mine")
    with pytest.raises(errsep.InputError, match="report.html"):
        answer.report(tmp_path)
    assert (tmp_path / "report.html").read_text() == "mine"
    answer.report(tmp_path, force=True)
    assert "Straightness" in (tmp_path / "report.html").read_text()


@pytest.mark.parametrize("wrong", [-1, 0, 1.5, 10**30, "four", float("nan"), None])
def test_a_count_that_is_none_is_told_in_words(wrong: object, tmp_path: Path) -> None:
    profile = {"x": [0.0, 1.0, 2.0], "deviation": [0.0, 1.0, 0.0]}
    calls = {
        "threads": (lambda n: errsep.straightness(profile, threads=n), "give a whole number, 1 or greater"),
        "jobs": (lambda n: errsep.batch("id,command,data\n", jobs=n), "give a whole number, 1 or greater"),
        "max_iterations": (
            lambda n: errsep.least_squares(lambda p: p, {"a": 1.0}, max_iterations=n),
            "give a whole number, 0 or greater",
        ),
    }
    for name, (call, help) in calls.items():
        if wrong is None and name != "max_iterations" or wrong == 0 and name == "max_iterations":
            continue
        with pytest.raises(errsep.InputError) as caught:
            call(wrong)
        assert caught.value.what == f"{name} is {wrong!r}" and caught.value.help == help


def test_options_of_the_commands_that_count_are_told_in_words(readings: Path) -> None:
    for call in (
        lambda: errsep.reversal(readings, seed=-1),
        lambda: errsep.diagnose(readings, severity=-1),
        lambda: errsep.diagnose(readings, prove=1.5),
        lambda: errsep.simulate("circle", positions=-1),
        lambda: errsep.machine({"chain": "FXYZ"}, "circularity", centre=(0, 0), radius=1, trials=-1),
    ):
        with pytest.raises(errsep.InputError, match="give a whole number, 0 or greater"):
            call()


def test_whole_numbers_of_other_kinds_count() -> None:
    profile = {"x": [0.0, 1.0, 2.0], "deviation": [0.0, 1.0, 0.0]}
    assert errsep.straightness(profile, threads=np.int64(2))["points"] == 3
    assert errsep.least_squares(lambda p: p - 1, {"a": 0.0}, max_iterations=1e3).converged
