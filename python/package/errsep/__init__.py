"""errsep separates a machine tool's geometric errors from those of the artefact, the sensors and the
set-up, with uncertainty.

Each command of the program ``errsep`` is a function; `least_squares` is the engine on residuals of one's
own. Angles are in rad, positions in mm, readings and forms in µm.

>>> import errsep
>>> made = errsep.simulate("reversal", alpha=40, noise=0.02, seed=7)
>>> answer = errsep.reversal(made["data"])
>>> answer.tilts["alpha"].unit
'rad'
"""

from ._errsep import __version__
from .batches import Batch, batch
from .commands import (
    anova,
    circle,
    four_sensor,
    fourier,
    machine,
    reversal,
    simulate,
    step_diagonal,
    straightness,
)
from .diagnosing import check, diagnose, plan
from .engine import State, least_squares
from .errors import Error, InputError, NotConverged, NotDetermined
from .fit import Fit, Interval
from .quantity import Covariance, Quantities, Quantity
from .result import Result

__all__ = [
    "Batch",
    "Covariance",
    "Error",
    "Fit",
    "InputError",
    "Interval",
    "NotConverged",
    "NotDetermined",
    "Quantities",
    "Quantity",
    "Result",
    "State",
    "__version__",
    "anova",
    "batch",
    "check",
    "circle",
    "diagnose",
    "four_sensor",
    "fourier",
    "least_squares",
    "machine",
    "plan",
    "reversal",
    "simulate",
    "step_diagonal",
    "straightness",
]
