"""The factor between two signals that say the same."""

import numpy as np
from numpy.typing import NDArray

from .. import limits

Array = NDArray[np.float64]


#: Degrees in a radian.
DEGREES = 180 / np.pi


def factor_between(x: Array, y: Array) -> float | None:
    """The factor y / x of two signals that say the same, from the ratio of their spreads, with its sign."""
    x, y = x - x.mean(), y - y.mean()
    sx, sy = float(np.std(x)), float(np.std(y))
    if min(sx, sy) < limits.MIN_MOTION / 100 or max(sx, sy) < limits.MIN_MOTION:
        return None
    correlation = float(np.mean(x * y)) / (sx * sy)
    return float(np.sign(correlation)) * sy / sx if abs(correlation) > limits.MIN_CORRELATION else None


def near(value: float, factor: float) -> bool:
    """True where a factor is another but for what noise bends."""
    return abs(value / factor - 1) < limits.FACTOR_TOLERANCE
