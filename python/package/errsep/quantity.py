"""A measured quantity in the vocabulary of the GUM, and several of them with their covariance."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Factors to the units that people read.
_SHOWN = {"rad": (1e6, "µrad"), "um": (1.0, "µm"), "1": (1.0, "")}


@dataclass(frozen=True)
class Quantity:
    """A value with its standard uncertainty (k = 1).

    ``dof`` are the degrees of freedom of the standard uncertainty, infinite where it is known.
    ``expanded`` is the expanded uncertainty at ``coverage_probability``, ``coverage_factor`` standard
    uncertainties; where the answer gives none, all three are None, as ``dof`` may be.
    """

    label: str
    value: float
    std: float
    unit: str = ""
    dof: float | None = None
    expanded: float | None = None
    coverage_factor: float | None = None
    coverage_probability: float | None = None

    @property
    def interval(self) -> tuple[float, float] | None:
        """The value less and plus its expanded uncertainty."""
        if self.expanded is None:
            return None
        return self.value - self.expanded, self.value + self.expanded

    def __float__(self) -> float:
        return self.value

    @property
    def words(self) -> str:
        """Value, standard uncertainty and unit for people, angles in µrad."""
        factor, unit = _SHOWN.get(self.unit, (1.0, self.unit))
        return f"{plus_minus(factor * self.value, factor * self.std)} {unit}".rstrip()

    def __str__(self) -> str:
        return f"{self.label} = {self.words}" if self.label else self.words


def plus_minus(value: float, std: float) -> str:
    """A value rounded to two digits of its standard uncertainty.

    >>> plus_minus(39.9968, 0.0168), plus_minus(-1.5e-4, 1.68e-8), plus_minus(3.0, 0.0)
    ('39.997 ± 0.017', '(-1.50000 ± 0.00017)e-04', '3 ± 0')
    """
    if not (math.isfinite(std) and math.isfinite(value)) or std <= 0:
        return f"{value:g} ± {std:g}"
    exponent = math.floor(math.log10(max(abs(value), std)))
    scale = 10.0**exponent if not -3 <= exponent <= 5 else 1.0
    value, std = value / scale, std / scale
    digits = max(0, 1 - math.floor(math.log10(std)))
    words = f"{value:.{digits}f} ± {std:.{digits}f}"
    return words if scale == 1.0 else f"({words})e{exponent:+03d}"


def quantity(
    value: Mapping[str, Any],
    expanded: Mapping[str, Any] | None = None,
    label: str = "",
    dof: float | None = None,
) -> Quantity:
    """A quantity as the answers write it; ``dof`` where it does not say its own degrees of freedom."""
    expanded = value.get("expanded") or expanded or {}
    dof = value.get("degrees_of_freedom", dof)
    return Quantity(
        label=value.get("label", label),
        value=value["value"],
        std=value["std"],
        unit=value.get("unit", ""),
        dof=None if dof is None else float(str(dof).replace("infinite", "inf")),
        expanded=expanded.get("expanded_uncertainty"),
        coverage_factor=expanded.get("coverage_factor"),
        coverage_probability=expanded.get("coverage_probability"),
    )


def is_quantity(value: Any) -> bool:
    """Whether a part of an answer is a single value with its uncertainty."""
    if not isinstance(value, Mapping) or not {"value", "std", "unit"} <= value.keys():
        return False
    return all(isinstance(value[key], (int, float)) for key in ("value", "std"))


class Quantities(Mapping[str, Quantity]):
    """Quantities by their names; those that are not determined are not among them."""

    def __init__(self, quantities: Mapping[str, Quantity]) -> None:
        self._quantities = dict(quantities)

    def __getitem__(self, name: str) -> Quantity:
        try:
            return self._quantities[name]
        except KeyError:
            known = ", ".join(self._quantities) or "none"
            raise KeyError(f"{name!r} is not among what is determined: {known}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._quantities)

    def __len__(self) -> int:
        return len(self._quantities)

    def __repr__(self) -> str:
        return "\n".join(f"{name} = {q.words}" for name, q in self._quantities.items()) or "none"


class Covariance:
    """A covariance matrix whose rows and columns have names.

    >>> c = Covariance(["a", "b"], [[4.0, 1.0], [1.0, 1.0]], "mm2")
    >>> c["a", "b"], c.correlation("a", "b")
    (1.0, 0.5)
    """

    def __init__(self, names: Sequence[str], matrix: Any, unit: str = "") -> None:
        self.names = list(names)
        self.matrix: NDArray[np.float64] = np.array(matrix, dtype=float)
        self.unit = unit

    def __getitem__(self, names: tuple[str, str]) -> float:
        i, j = (self.names.index(name) for name in names)
        return float(self.matrix[i, j])

    def correlation(self, one: str, other: str) -> float:
        """The correlation of two of them; not a number where either has no uncertainty."""
        product = self[one, one] * self[other, other]
        return self[one, other] / math.sqrt(product) if product > 0 else math.nan

    def to_dataframe(self) -> Any:
        """The matrix as a DataFrame of pandas."""
        import pandas

        return pandas.DataFrame(self.matrix, index=self.names, columns=self.names)

    def __repr__(self) -> str:
        return f"Covariance of {', '.join(self.names)} ({self.unit}):\n{self.matrix}"


def to_uncertainties(quantities: Mapping[str, Quantity], covariance: Covariance | None) -> dict[str, Any]:
    """As numbers of the package ``uncertainties``; those of the covariance are correlated."""
    import uncertainties

    numbers = {
        name: uncertainties.ufloat(q.value, q.std, tag=q.label or name) for name, q in quantities.items()
    }
    names = correlated(quantities, covariance)
    if covariance is not None and names:
        values = [quantities[name].value for name in names.values()]
        places = [covariance.names.index(name) for name in names]
        matrix = covariance.matrix[np.ix_(places, places)]
        made = uncertainties.correlated_values(values, matrix, tags=list(names))
        numbers.update(zip(names.values(), made, strict=True))
    return numbers


def to_gtc(quantities: Mapping[str, Quantity], covariance: Covariance | None) -> dict[str, Any]:
    """As uncertain numbers of the package ``GTC``; those of the covariance are correlated."""
    import GTC

    names = correlated(quantities, covariance)
    numbers = {
        name: GTC.ureal(q.value, q.std, _degrees(q), label=q.label or name) for name, q in quantities.items()
    }
    if covariance is None or not names:
        return numbers
    together = [quantities[name] for name in names.values()]
    made = GTC.multiple_ureal(
        [q.value for q in together],
        [q.std for q in together],
        _degrees(together[0]),
        [q.label for q in together],
    )
    numbers.update(zip(names.values(), made, strict=True))
    several = list(names.items())
    for k, (short, name) in enumerate(several):
        for other_short, other in several[:k]:
            r = covariance.correlation(short, other_short)
            if math.isfinite(r):
                GTC.set_correlation(r, numbers[name], numbers[other])
    return numbers


def _degrees(q: Quantity) -> float:
    return math.inf if q.dof is None else q.dof


def correlated(quantities: Mapping[str, Quantity], covariance: Covariance | None) -> dict[str, str]:
    """The names of the covariance that are quantities with an uncertainty, and their full names."""
    if covariance is None:
        return {}
    found = {}
    for short in covariance.names:
        effect, _, parameter = short.partition(".")
        full = (short, f"fit.{short}", f"tilts.{short}", f"effects.{effect}.parameters.{parameter}")
        for name, q in quantities.items():
            if name in full and q.std > 0 and math.isfinite(q.std):
                found[short] = name
    return found
