"""What a fit found."""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _plot
from .quantity import Covariance, Quantities, Quantity
from .quantity import to_gtc as _to_gtc
from .quantity import to_uncertainties as _to_uncertainties

Array = NDArray[np.float64]


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


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
