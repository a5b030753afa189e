"""The engine on residuals of Python."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
import scipy.optimize
import scipy.stats

import errsep
from errsep import least_squares

# Misra1a of the Statistical Reference Datasets (NIST): dental research, monomolecular adsorption.
MISRA_Y = [10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78]
MISRA_X = [77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0]
MISRA = {"b1": (2.3894212918e02, 2.7070075241), "b2": (5.5015643181e-04, 7.2668688436e-06)}
MISRA_DEVIATION = 1.0187876330e-01


def misra(p: np.ndarray) -> np.ndarray:
    return p[0] * (1 - np.exp(-p[1] * np.array(MISRA_X))) - np.array(MISRA_Y)


def misra_jacobian(p: np.ndarray) -> np.ndarray:
    x = np.array(MISRA_X)
    return np.column_stack([1 - np.exp(-p[1] * x), p[0] * x * np.exp(-p[1] * x)])


@pytest.mark.parametrize("start", [(500.0, 1e-4), (250.0, 5e-4)])
@pytest.mark.parametrize("method", ["levenberg-marquardt", "nielsen", "gauss-newton", "dogleg"])
@pytest.mark.parametrize("jacobian", [misra_jacobian, None], ids=["derivatives", "differences"])
def test_certified_digits(start: tuple[float, float], method: str, jacobian: object) -> None:
    """Certified digits: eleven are printed. With derivatives ten are asked of the parameters and nine of
    the uncertainties; with differences, whose own error is 1e-10 of a derivative, eight and seven."""
    found = least_squares(misra, dict(zip(MISRA, start, strict=True)), jacobian=jacobian, method=method)
    digits, of_std = (1e-10, 1e-9) if jacobian else (1e-8, 1e-7)
    for name, (value, std) in MISRA.items():
        assert found.parameters[name].value == pytest.approx(value, rel=digits)
        assert found.parameters[name].std == pytest.approx(std, rel=of_std)
    assert found.residual_std == pytest.approx(MISRA_DEVIATION, rel=of_std)
    assert found.degrees_of_freedom == 12 and found.converged


@pytest.fixture(scope="module")
def line() -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(7)
    matrix = generator.normal(size=(30, 4))
    return matrix, matrix @ [1.0, -2.0, 0.5, 3.0] + 0.1 * generator.normal(size=30)


def test_a_linear_problem_against_numpy(line: tuple[np.ndarray, np.ndarray]) -> None:
    """A well-conditioned factorisation by two programs: epsilons times the condition number of 2."""
    matrix, y = line
    found = least_squares(lambda p: matrix @ p - y, np.zeros(4), jacobian=lambda p: matrix)
    x, (square,), _, _ = np.linalg.lstsq(matrix, y, rcond=None)
    covariance = np.linalg.inv(matrix.T @ matrix) * square / 26
    assert found.x == pytest.approx(x, rel=1e-13)
    assert found.covariance.matrix == pytest.approx(covariance, rel=1e-12, abs=1e-16)
    assert found.covariance.names == ["p0", "p1", "p2", "p3"]
    t = scipy.stats.t.ppf(0.975, 26)
    for k, q in enumerate(found.parameters.values()):
        assert q.expanded == pytest.approx(t * covariance[k, k] ** 0.5, rel=1e-9)
        assert q.dof == 26 and q.coverage_factor == pytest.approx(t, rel=1e-9)


def test_the_profile_of_a_linear_problem_is_the_interval_of_student(
    line: tuple[np.ndarray, np.ndarray],
) -> None:
    """Exact limit: a linear model has profiles that end at the quantile. The engine ends the search for
    an end at 1e-6 of the quantile."""
    matrix, y = line
    found = least_squares(
        lambda p: matrix @ p - y, np.zeros(4), jacobian=lambda p: matrix, profile=0.9, coverage=0.9
    )
    for name, q in found.parameters.items():
        interval = found.profile[name]
        assert (interval.lower, interval.upper) == pytest.approx(q.interval, abs=3e-6 * q.expanded)
        assert (interval.lower_end, interval.upper_end) == ("at", "at")


def test_a_profile_may_end_at_a_bound_or_not_at_all() -> None:
    """A saturated reading limits its parameter below only: tanh ∞ = 1 is half a standard deviation off."""

    def residuals(p: np.ndarray) -> np.ndarray:
        return (np.tanh(p) - 0.9) / 0.2

    found = least_squares(residuals, {"a": 1.0}, sigma="known", profile=0.95)
    interval = found.profile["a"]
    assert (interval.lower_end, interval.upper_end, interval.upper) == ("at", "open", np.inf)
    # Where the residual reaches the quantile, to the engine's 1e-6 of it.
    assert np.tanh(interval.lower) == pytest.approx(0.9 - 0.2 * 1.959964, abs=1e-6)
    held = least_squares(residuals, {"a": 1.0}, sigma="known", profile=0.95, bounds={"a": (None, 3)})
    assert (held.profile["a"].upper_end, held.profile["a"].upper) == ("bound", 3.0)


def test_known_scatter(line: tuple[np.ndarray, np.ndarray]) -> None:
    """Epsilons times the condition number, as above."""
    matrix, y = line
    found = least_squares(
        lambda p: (matrix @ p - y) / 0.1, np.zeros(4), jacobian=lambda p: matrix / 0.1, sigma="known"
    )
    assert found.covariance.matrix == pytest.approx(
        0.01 * np.linalg.inv(matrix.T @ matrix), rel=1e-12, abs=1e-16
    )
    assert found.parameters["p0"].dof == np.inf


@pytest.mark.parametrize("loss", ["huber", "soft-l1", "cauchy"])
def test_robust_losses_against_scipy(loss: str, line: tuple[np.ndarray, np.ndarray]) -> None:
    """Other tool: scipy's minimum of the same loss, which it is asked for to 1e-12 of the cost and
    therefore has to 1e-6 of the parameters."""
    matrix, y = line
    spoilt = y.copy()
    spoilt[:3] += 5
    found = least_squares(lambda p: matrix @ p - spoilt, np.zeros(4), loss=loss, loss_scale=0.2)
    other = scipy.optimize.least_squares(
        lambda p: matrix @ p - spoilt,
        np.zeros(4),
        loss=loss.replace("-", "_"),
        f_scale=0.2,
        xtol=1e-12,
        ftol=1e-12,
        gtol=1e-12,
    )
    assert found.x == pytest.approx(other.x, rel=1e-6)
    quadratic = least_squares(lambda p: matrix @ p - spoilt, np.zeros(4))
    assert np.abs(found.x - [1, -2, 0.5, 3]).max() < np.abs(quadratic.x - [1, -2, 0.5, 3]).max()


def test_bounds_hold_a_parameter() -> None:
    x = np.arange(5.0)

    def residuals(p: np.ndarray) -> np.ndarray:
        return p[0] + p[1] * x - (2 + 3 * x)

    for bounds in ({"slope": (None, 2.5)}, ([-np.inf, -np.inf], [np.inf, 2.5]), (-10.0, [10.0, 2.5])):
        found = least_squares(residuals, {"offset": 0.0, "slope": 0.0}, bounds=bounds)
        assert found.x[1] == 2.5
        # The mean of what the held slope leaves: 2 + 0.5 · 2, from differences good to 1e-10.
        assert found.x[0] == pytest.approx(3.0, rel=1e-9)
        assert found.active_bounds == [("slope", "upper", 2.5)]
        assert "held by its upper bound" in found.warnings[0]
        assert found.parameters["slope"].std == 0


def test_what_is_not_determined() -> None:
    x = np.arange(6.0)
    found = least_squares(lambda p: (p[0] + p[1]) * x + p[2] - 2 * x - 1, {"a": 0, "b": 0, "c": 0})
    assert found.kind == "not-identifiable" and not found.converged
    assert found.not_determined == ["`a` by +1, `b` by -1.0000 together change no residual"]
    assert found.parameters["a"].std == np.inf and np.isfinite(found.parameters["c"].std)
    assert "not determined" in found.summary()


def test_a_model_without_a_value_is_stepped_back_from() -> None:
    def residuals(p: np.ndarray) -> np.ndarray:
        with np.errstate(invalid="ignore"):
            return np.array([np.sqrt(p[0]) - 1.0, 0.1 * (p[0] - 1.0)])

    found = least_squares(residuals, [9.0], bounds=None)
    # From differences: good to 1e-8 at least.
    assert found.converged and found.x[0] == pytest.approx(1.0, rel=1e-8)


def test_arguments_go_to_both_functions() -> None:
    x = np.arange(4.0)
    found = least_squares(
        lambda p, x, y: p[0] * x - y,
        [0.0],
        jacobian=lambda p, x, y: x[:, None],
        args=(x, 3 * x),
        units={"p0": "mm"},
    )
    # One division: epsilons.
    assert found.x[0] == pytest.approx(3.0, rel=1e-15)
    assert found.parameters["p0"].unit == "mm"


def test_the_callback_is_told_each_iteration_and_stops_the_fit() -> None:
    told: list[errsep.State] = []
    whole = least_squares(misra, [500.0, 1e-4], callback=told.append)
    assert [state.iteration for state in told] == list(range(1, whole.iterations + 1))
    costs = [state.cost for state in told]
    assert costs == sorted(costs, reverse=True)
    assert told[-1].parameters == pytest.approx(whole.x, rel=1e-12)

    def stop(state: errsep.State) -> None:
        if state.iteration == 2:
            raise StopIteration

    found = least_squares(misra, [500.0, 1e-4], callback=stop)
    assert found.kind == "stopped" and found.iterations == 2 and not found.converged
    assert found.x.tolist() == told[1].parameters.tolist()


class Mine(Exception):
    pass


@pytest.mark.parametrize("where", ["residuals at the start", "residuals", "jacobian", "callback"])
def test_an_exception_ends_the_fit_and_goes_on(where: str) -> None:
    calls = {"residuals": 0, "after": 0}
    raised = False

    def throw() -> None:
        nonlocal raised
        raised = True
        raise Mine(where)

    def residuals(p: np.ndarray) -> np.ndarray:
        calls["residuals"] += 1
        calls["after"] += raised
        if where == "residuals at the start" or where == "residuals" and calls["residuals"] == 3:
            throw()
        return misra(p)

    def jacobian(p: np.ndarray) -> np.ndarray:
        calls["after"] += raised
        if where == "jacobian":
            throw()
        return misra_jacobian(p)

    def callback(state: errsep.State) -> None:
        if where == "callback":
            throw()

    with pytest.raises(Mine, match=where):
        least_squares(residuals, [500.0, 1e-4], jacobian=jacobian, callback=callback)
    assert calls["after"] == 0


def test_a_model_that_does_not_fit_a_known_scatter_is_told() -> None:
    x = np.arange(20.0)
    bent = least_squares(lambda p: (p[0] * x - x**2) / 0.1, [1.0], sigma="known")
    assert "does not fit" in bent.warnings[0] and bent.warnings[0] in bent.summary()
    generator = np.random.default_rng(3)
    y = 2 * x + 0.1 * generator.normal(size=20)
    assert least_squares(lambda p: (p[0] * x - y) / 0.1, [1.0], sigma="known").warnings == []


def test_what_makes_no_sense_is_told() -> None:
    def wrong(match: str, *arguments: object, **options: object) -> None:
        with pytest.raises(errsep.InputError, match=match):
            least_squares(*arguments, **options)

    wrong("1 residuals cannot determine 2", lambda p: [p[0]], [1.0, 2.0])
    wrong("no method", misra, [500.0, 1e-4], method="newton")
    wrong("no loss", misra, [500.0, 1e-4], loss="soft")
    wrong("sigma is", misra, [500.0, 1e-4], sigma=0.1)
    wrong("names for", misra, [500.0, 1e-4], names=["a"])
    wrong("names the parameters already", misra, {"a": 500.0, "b": 1e-4}, names=["a", "b"])
    wrong("bounds for 'c'", misra, {"a": 500.0, "b": 1e-4}, bounds={"c": (0, 1)})
    wrong("outside its bounds", misra, {"a": 500.0, "b": 1e-4}, bounds={"a": (0, 1)})
    wrong("bounds of parameter `a`", misra, {"a": 500.0, "b": 1e-4}, bounds={"a": (2, 1)})
    wrong("shape", misra, [[500.0, 1e-4]])
    wrong("Jacobian is 14 by 1", misra, [500.0, 1e-4], jacobian=lambda p: np.ones((14, 1)))
    wrong("coverage", misra, [500.0, 1e-4], coverage=95)
    wrong("level", misra, [500.0, 1e-4], profile=95)
    wrong("time_limit", misra, [500.0, 1e-4], time_limit=-1)
    wrong("residual 0 is NaN", lambda p: [np.nan, p[0]], [1.0])
    lengths = iter([3, 4, 5, 6])
    wrong("residuals here and 3 at the start", lambda p: np.ones(next(lengths)), [1.0])


def test_limits_end_in_not_converged() -> None:
    with pytest.raises(errsep.NotConverged, match="iteration limit") as caught:
        least_squares(misra, [500.0, 1e-4], max_iterations=2)
    assert caught.value.result.iterations == 2


def test_no_uncertainty_without_anything_left_over() -> None:
    found = least_squares(lambda p: p - [1.0, 2.0], [0.0, 0.0])
    assert found.covariance is None and np.isnan(found.parameters["p0"].std)
    assert found.parameters["p0"].expanded is None and "no uncertainties" in found.warnings[0]
    assert '"std": null' in found.to_json()


def test_a_fit_goes_through_a_pickle_and_into_other_packages() -> None:
    found = least_squares(misra, {"b1": 500.0, "b2": 1e-4}, profile=0.95)
    for again in (pickle.loads(pickle.dumps(found)), copy.copy(found), copy.deepcopy(found)):
        assert again.to_json() == found.to_json() and again.summary() == found.summary()
    assert found.to_dataframe().loc["b1", "std"] == found.parameters["b1"].std
    assert (
        found.to_xarray()["covariance"].sel(parameter="b1", parameter_="b2") == found.covariance["b1", "b2"]
    )
    correlation = found.covariance.correlation("b1", "b2")
    numbers = found.to_gtc()
    import GTC

    # Handed over as it is: epsilons.
    assert GTC.get_correlation(numbers["b1"], numbers["b2"]) == pytest.approx(correlation, rel=1e-14)
    product = found.to_uncertainties()
    # Eigenvalues of a matrix whose entries differ by 1e10: `uncertainties` keeps about six digits.
    assert (product["b1"] * product["b2"]).std_dev == pytest.approx(
        (numbers["b1"] * numbers["b2"]).u, rel=1e-5
    )
    assert found.plot().has_data()
    assert found._repr_html_().startswith('<div class="errsep">')
