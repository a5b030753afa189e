"""The engine on residuals of one's own: for people who never see a machine tool."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _errsep
from ._inputs import Names, listed, whole
from .errors import InputError, NotConverged
from .fit import Array, Fit

#: Limits of the parameters: two sequences (lower, upper), or a pair for each name that has one.
Bounds = tuple[ArrayLike, ArrayLike] | Mapping[str, tuple[float | None, float | None]]


@dataclass(frozen=True)
class State:
    """What a callback is told after each iteration."""

    iteration: int
    cost: float
    parameters: Array


def least_squares(
    residuals: Callable[..., ArrayLike],
    start: ArrayLike | Mapping[str, float],
    *,
    jacobian: Callable[..., ArrayLike] | None = None,
    args: Sequence[Any] = (),
    names: Names = None,
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
        No minimum was found; ``partial`` of the exception holds how far the fit came.
    InputError
        The problem makes no sense as it is stated.

    >>> import numpy as np
    >>> from errsep import least_squares
    >>> x, y = np.array([0.0, 1.0, 2.0, 3.0]), np.array([1.1, 2.9, 5.2, 6.9])
    >>> fit = least_squares(lambda p: p[0] + p[1] * x - y, {"offset": 0.0, "slope": 1.0})
    >>> print(fit.parameters["slope"])
    slope = 1.970 ± 0.079
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
        "max_iterations": whole("max_iterations", max_iterations),
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


def _start(start: ArrayLike | Mapping[str, float], names: Names) -> tuple[list[str], Array]:
    if isinstance(start, Mapping):
        if names is not None:
            raise InputError("the start names the parameters already", help="leave out names")
        names, start = list(start), list(start.values())
    first = np.array(start, dtype=float)
    if first.ndim != 1:
        raise InputError(f"the start has the shape {first.shape}", help="give one number a parameter")
    names = [f"p{k}" for k in range(first.size)] if names is None else listed(names)
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
