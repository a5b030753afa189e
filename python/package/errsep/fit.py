"""The engine on residuals of one's own: for people who never see a machine tool."""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _errsep, _plot
from .errors import InputError, NotConverged
from .quantity import Covariance, Quantities, Quantity
from .quantity import to_gtc as _to_gtc
from .quantity import to_uncertainties as _to_uncertainties

Array = NDArray[np.float64]
#: Limits of the parameters: two sequences (lower, upper), or a pair for each name that has one.
Bounds = tuple[ArrayLike, ArrayLike] | Mapping[str, tuple[float | None, float | None]]


@dataclass(frozen=True)
class State:
    """What a callback is told after each iteration."""

    iteration: int
    cost: float
    parameters: Array


@dataclass(frozen=True)
class Interval:
    """A profile-likelihood interval.

    ``lower_end`` and ``upper_end`` say what ends it: ``"at"`` (the profile), ``"bound"`` (a bound of the
    parameter) or ``"open"`` (the data do not limit it on this side as far as it was followed; the end is
    then infinite).
    """

    lower: float
    upper: float
    lower_end: str
    upper_end: str


class Fit:
    """What a fit found.

    Attributes
    ----------
    parameters : Quantities
        Each parameter by its name, with its uncertainty.
    x, residuals, jacobian : numpy arrays
        The parameters in their order, the residuals and their Jacobian there, without the loss.
    cost : float
        Half the sum of the squares of the residuals, under the loss.
    converged : bool
        Whether a minimum was found that determines every parameter.
    ending, kind : str
        Why the fit ended, in a sentence and in a word.
    iterations, residual_evaluations, jacobian_evaluations, degrees_of_freedom : int
    residual_std : float or None
        Standard deviation of a residual; None without degrees of freedom.
    covariance : Covariance or None
        Of the parameters; None where neither ``sigma`` is known nor anything is left over to tell it.
    not_determined : list of str
        Combinations of parameters that no residual depends on.
    active_bounds : list of (name, "lower" or "upper", value)
        The bounds that hold a parameter.
    profile : dict of Interval
        Profile-likelihood intervals by name, where they were asked for.
    """

    def __init__(self, found: Mapping[str, Any], level: float, units: Mapping[str, str]) -> None:
        self._found = dict(found)
        self._level = level
        self._units = dict(units)
        self.x: Array = self._found["parameters"]
        self.residuals: Array = self._found["residuals"]
        self.jacobian: Array = self._found["jacobian"]
        self.cost: float = self._found["cost"]
        self.kind: str = self._found["kind"]
        self.ending: str = self._found["ending"]
        self.iterations: int = self._found["iterations"]
        self.residual_evaluations: int = self._found["residual_evaluations"]
        self.jacobian_evaluations: int = self._found["jacobian_evaluations"]
        self.degrees_of_freedom: int = self._found["degrees_of_freedom"]
        self.residual_std: float | None = self._found["residual_std"]
        self.active_bounds: list[tuple[str, str, float]] = list(self._found["active_bounds"])

    @property
    def names(self) -> list[str]:
        """The names of the parameters, in their order."""
        return list(self._found["names"])

    @property
    def converged(self) -> bool:
        """Whether a minimum was found that determines every parameter."""
        return self.kind == "converged"

    @property
    def not_determined(self) -> list[str]:
        """Combinations of parameters that no residual depends on, in words."""
        return [words for _, words in self._found["not_determined"]]

    @property
    def warnings(self) -> list[str]:
        """What the reader should know, in words."""
        held = (f"{name} is held by its {side} bound {value:g}" for name, side, value in self.active_bounds)
        warnings = list(held)
        if not self.converged:
            warnings.insert(0, self.ending)
        variance = None if self.residual_std is None else self.residual_std**2
        # Five standard deviations of a chi-square beyond its mean.
        most = 1 + 5 * math.sqrt(2 / max(self.degrees_of_freedom, 1))
        if self._found["known_scale"] and variance is not None and variance > most:
            warnings.append(
                f"the residuals scatter {math.sqrt(variance):.3g} times as much as sigma says: the model "
                "does not fit, and the uncertainties are too small"
            )
        if self.covariance is None:
            warnings.append("no uncertainties: nothing is left over to tell the scatter of a residual")
        return warnings

    @cached_property
    def covariance(self) -> Covariance | None:
        """The covariance of the parameters with their names."""
        matrix = self._found.get("covariance")
        return None if matrix is None else Covariance(self.names, matrix)

    @cached_property
    def parameters(self) -> Quantities:
        """The parameters by their names."""
        std = self._found.get("std")
        known = self._found["known_scale"]
        dof = math.inf if known else float(self.degrees_of_freedom)
        factor = self._found["coverage_factor"]
        found = {}
        for k, name in enumerate(self.names):
            u = math.nan if std is None else float(std[k])
            found[name] = Quantity(
                label=name,
                value=float(self.x[k]),
                std=u,
                unit=self._units.get(name, ""),
                dof=dof,
                expanded=None if factor is None or std is None else factor * u,
                coverage_factor=factor,
                coverage_probability=self._level,
            )
        return Quantities(found)

    @cached_property
    def profile(self) -> dict[str, Interval]:
        """Profile-likelihood intervals by name, where they were asked for."""
        found = {}
        for name, ((lower_end, lower), (upper_end, upper)) in self._found["profile"]:
            lower = -math.inf if lower_end == "open" else lower
            upper = math.inf if upper_end == "open" else upper
            found[name] = Interval(lower, upper, lower_end, upper_end)
        return found

    def summary(self) -> str:
        """The fit for people."""
        lines = [f"{self.ending} ({self.iterations} iterations, {len(self.residuals)} residuals)"]
        lines += [f"  {q}" for q in self.parameters.values()]
        if self.residual_std is not None:
            degrees = f"{self.degrees_of_freedom} degrees of freedom"
            lines.append(f"standard deviation of a residual {self.residual_std:.4g} ({degrees})")
        lines += [f"not determined: {words}" for words in self.not_determined]
        lines += [f"{w}" for w in self.warnings if w != self.ending]
        return "\n".join(lines) + "\n"

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain values."""
        covariance = self.covariance
        return {
            "schema": "errsep.fit/1",
            "kind": self.kind,
            "ending": self.ending,
            "converged": self.converged,
            "parameters": {name: vars(q).copy() for name, q in self.parameters.items()},
            "covariance": None if covariance is None else covariance.matrix.tolist(),
            "cost": self.cost,
            "residual_std": self.residual_std,
            "degrees_of_freedom": self.degrees_of_freedom,
            "not_determined": self.not_determined,
            "active_bounds": [list(bound) for bound in self.active_bounds],
            "profile": {name: vars(interval).copy() for name, interval in self.profile.items()},
            "residuals": self.residuals.tolist(),
            "iterations": self.iterations,
            "residual_evaluations": self.residual_evaluations,
            "jacobian_evaluations": self.jacobian_evaluations,
        }

    def to_json(self) -> str:
        """Everything as JSON; numbers that are not finite are null."""
        return json.dumps(_finite(self.to_dict()), indent=2, allow_nan=False) + "\n"

    def to_dataframe(self) -> Any:
        """The parameters as a DataFrame of pandas."""
        import pandas

        rows = [vars(q) for q in self.parameters.values()]
        return pandas.DataFrame(rows, index=self.names).drop(columns="label")

    def to_xarray(self) -> Any:
        """Parameters and covariance as a Dataset of xarray."""
        import xarray

        std = np.array([q.std for q in self.parameters.values()])
        variables: dict[str, Any] = {"value": ("parameter", self.x), "std": ("parameter", std)}
        if self.covariance is not None:
            variables["covariance"] = (("parameter", "parameter_"), self.covariance.matrix)
        coordinates = {"parameter": self.names, "parameter_": self.names}
        return xarray.Dataset(variables, coordinates)

    def to_uncertainties(self) -> dict[str, Any]:
        """The parameters as correlated numbers of the package ``uncertainties``."""
        return _to_uncertainties(self.parameters, self.covariance)

    def to_gtc(self) -> dict[str, Any]:
        """The parameters as correlated uncertain numbers of the package ``GTC``."""
        return _to_gtc(self.parameters, self.covariance)

    def plot(self, ax: Any = None) -> Any:
        """Draws the residuals with matplotlib; returns the axes."""
        return _plot.fit(self, ax)

    def _repr_html_(self) -> str:
        from .result import notebook

        rows = "; ".join(str(q) for q in self.parameters.values())
        return notebook("Least squares", self.ending.capitalize(), rows, self.warnings, [])

    def __repr__(self) -> str:
        return f"<errsep fit: {self.ending}; {'; '.join(map(str, self.parameters.values()))}>"

    def __getstate__(self) -> dict[str, Any]:
        return {"found": self._found, "level": self._level, "units": self._units}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["found"], state["level"], state["units"])  # type: ignore[misc]

    def __copy__(self) -> Fit:
        return Fit(self._found, self._level, self._units)

    def __deepcopy__(self, memo: dict[int, Any]) -> Fit:
        return Fit(copy.deepcopy(self._found, memo), self._level, self._units)


def least_squares(
    residuals: Callable[..., ArrayLike],
    start: ArrayLike | Mapping[str, float],
    *,
    jacobian: Callable[..., ArrayLike] | None = None,
    args: Sequence[Any] = (),
    names: Sequence[str] | None = None,
    units: Mapping[str, str] | None = None,
    bounds: Bounds | None = None,
    loss: str = "quadratic",
    loss_scale: float = 1.0,
    sigma: str = "estimated",
    method: str = "levenberg-marquardt",
    factorization: str = "qr",
    geodesic_acceleration: bool = False,
    profile: float | None = None,
    coverage: float = 0.95,
    cost_tolerance: float = 1e-12,
    step_tolerance: float = 1e-12,
    gradient_tolerance: float = 1e-14,
    rank_tolerance: float | None = None,
    max_iterations: int = 1000,
    time_limit: float | None = None,
    callback: Callable[[State], Any] | None = None,
) -> Fit:
    """Finds parameters near ``start`` that minimise half the sum of the squares of the residuals.

    Parameters
    ----------
    residuals
        ``residuals(parameters, *args)``, m numbers for an array of n parameters. Where the model has no
        value it returns numbers that are not finite: the fit then takes a shorter step. An exception
        ends the fit and goes on to the caller.
    start
        n numbers, or a dictionary that also names the parameters.
    jacobian
        ``jacobian(parameters, *args)``, m × n; central differences where it is absent.
    bounds
        ``(lower, upper)``, or ``{"a": (0, None)}``.
    loss
        ``"quadratic"``, or robust: ``"huber"``, ``"soft-l1"``, ``"cauchy"``, ``"tukey"``, whose residuals
        count less beyond ``loss_scale``.
    sigma
        ``"estimated"``: the residuals tell their own scatter. ``"known"``: they are in units of it.
    method
        ``"levenberg-marquardt"`` (Moré's trust region), ``"nielsen"``, ``"gauss-newton"``, ``"dogleg"``.
    factorization
        ``"qr"`` or ``"svd"``, of the Jacobian.
    profile
        Confidence level of profile-likelihood intervals; none where it is absent.
    coverage
        Coverage probability of expanded uncertainties.
    rank_tolerance
        Share below which a direction counts as undetermined: 1e-13, or 1e-7 of differences.
    time_limit
        Seconds after which the fit gives up.
    callback
        Called with a `State` after each iteration. ``StopIteration`` ends the fit, which is then returned
        as it is; any other exception ends it and goes on to the caller.

    Returns
    -------
    Fit
        Also where some parameters are not determined: ``fit.not_determined`` says which, their
        uncertainties are infinite.

    Raises
    ------
    NotConverged
        No minimum was found; ``result`` of the exception holds how far the fit came.
    InputError
        The problem makes no sense as it is stated.

    >>> import numpy as np
    >>> from errsep import least_squares
    >>> x, y = np.array([0.0, 1.0, 2.0, 3.0]), np.array([1.1, 2.9, 5.2, 6.9])
    >>> fit = least_squares(lambda p: p[0] + p[1] * x - y, {"offset": 0.0, "slope": 1.0})
    >>> print(fit.parameters["slope"])
    slope = 1.970 ± 0.070
    >>> least_squares(lambda p: (p[0] + p[1]) * x - y, {"a": 0.0, "b": 0.0}).not_determined
    ['`a` by +1, `b` by -1.0000 together change no residual']
    """
    names, first = _start(start, names)
    if sigma not in ("estimated", "known"):
        raise InputError(f"sigma is {sigma!r}", help="give 'estimated' or 'known'")
    if not 0 < coverage < 1:
        raise InputError(f"coverage is {coverage}", help="give a probability, such as 0.95")
    lower, upper = _bounds(bounds, names)
    asked = {
        "names": names,
        "start": first.tolist(),
        "lower": lower,
        "upper": upper,
        "method": method,
        "factorization": factorization,
        "geodesic_acceleration": bool(geodesic_acceleration),
        "loss": loss,
        "loss_scale": float(loss_scale),
        "cost_tolerance": float(cost_tolerance),
        "step_tolerance": float(step_tolerance),
        "gradient_tolerance": float(gradient_tolerance),
        "rank_tolerance": rank_tolerance,
        "max_iterations": int(max_iterations),
        "time_limit": time_limit,
        "known_scale": sigma == "known",
        "profile": profile,
        "coverage": float(coverage),
    }

    def residuals_of(parameters: Array) -> Array:
        return np.ascontiguousarray(residuals(parameters, *args), dtype=float).ravel()

    def jacobian_of(parameters: Array) -> Array:
        assert jacobian is not None
        matrix = np.ascontiguousarray(jacobian(parameters, *args), dtype=float)
        if matrix.ndim != 2:
            raise InputError(f"the Jacobian has the shape {matrix.shape}", help="give m × n numbers")
        return matrix

    def told(iteration: int, cost: float, parameters: Array) -> None:
        assert callback is not None
        callback(State(iteration, cost, parameters))

    found = _errsep.least_squares(
        residuals_of,
        None if jacobian is None else jacobian_of,
        None if callback is None else told,
        asked,
    )
    fit = Fit(found, coverage, units or {})
    if fit.kind in ("converged", "not-identifiable", "stopped"):
        return fit
    raise NotConverged(fit.ending).with_result(fit)


def _start(
    start: ArrayLike | Mapping[str, float], names: Sequence[str] | None
) -> tuple[list[str], Array]:
    if isinstance(start, Mapping):
        if names is not None:
            raise InputError("the start names the parameters already", help="leave out names")
        names, start = list(start), list(start.values())
    first = np.array(start, dtype=float)
    if first.ndim != 1:
        raise InputError(f"the start has the shape {first.shape}", help="give one number a parameter")
    names = [f"p{k}" for k in range(first.size)] if names is None else list(names)
    if len(names) != first.size or len(set(names)) != len(names):
        raise InputError(
            f"{len(names)} names for {first.size} parameters", help="give each parameter a name of its own"
        )
    return names, first


def _bounds(bounds: Bounds | None, names: list[str]) -> tuple[list[float] | None, list[float] | None]:
    if bounds is None:
        return None, None
    n = len(names)
    if isinstance(bounds, Mapping):
        unknown = [name for name in bounds if name not in names]
        if unknown:
            raise InputError(f"bounds for {unknown[0]!r}", help=f"the parameters are {', '.join(names)}")
        pairs = [bounds.get(name, (None, None)) for name in names]
        lower = [-math.inf if low is None else float(low) for low, _ in pairs]
        upper = [math.inf if high is None else float(high) for _, high in pairs]
        return lower, upper
    low, high = bounds
    return (
        np.broadcast_to(np.asarray(low, dtype=float), n).tolist(),
        np.broadcast_to(np.asarray(high, dtype=float), n).tolist(),
    )


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
