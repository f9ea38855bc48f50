"""Resampling, smoothing and differentiating: the same steps as ``wade validate --mocap``."""

from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: A step of more than this many median steps is a hole: nothing is interpolated or differentiated across it.
GAP_STEPS = 5.0


def pieces(t: Array) -> list[slice]:
    """Runs of stamps between holes."""
    if len(t) < 2:
        return [slice(0, len(t))]
    steps = np.diff(t)
    ends = np.flatnonzero(steps > GAP_STEPS * float(np.median(steps))) + 1
    bounds = [0, *ends.tolist(), len(t)]
    return [slice(a, b) for a, b in pairwise(bounds)]


def grid(first: float, last: float, rate: float) -> Array:
    """Evenly spaced instants from ``first`` on that do not lie after ``last``."""
    count = int(max(np.floor((last - first) * rate + 1e-9), 0.0)) + 1
    return np.asarray(first + np.arange(count) / rate)


@cache
def weights(window: int, order: int, derivative: int) -> Array:
    """Weights of a window's samples at each of its places, ``[window, window]``, for a step of 1 (Savitzky and Golay,
    Analytical Chemistry 1964)."""
    half = window // 2
    u = np.arange(-half, half + 1) / half
    coefficients = np.linalg.pinv(np.vander(u, order + 1, increasing=True))
    powers = np.arange(order + 1)
    factors = np.array([np.prod([p - k for k in range(derivative)]) for p in powers], dtype=float)
    basis = factors * u[:, None] ** np.maximum(powers - derivative, 0)
    return np.asarray(basis @ coefficients / half**derivative)


def savitzky_golay(samples: Array, window: int, order: int, derivative: int, step: float) -> Array:
    """A derivative of evenly spaced samples; at the ends the polynomial of the first or last full window answers."""
    table = weights(window, order, derivative) / step**derivative
    half = window // 2
    out = np.empty_like(samples)
    out[half : len(samples) - half] = np.correlate(samples, table[half], "valid")
    out[:half] = table[:half] @ samples[:window]
    out[len(samples) - half :] = table[half + 1 :] @ samples[-window:]
    return out


def slerp(t: Array, quaternion: Array, at: Array) -> Array:
    """Rotations (w x y z) at each instant, along the shorter way between two stamps (Shoemake, SIGGRAPH 1985)."""
    unit = quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
    after = np.clip(np.searchsorted(t, at, side="right"), 1, len(t) - 1)
    before = after - 1
    share = np.clip((at - t[before]) / (t[after] - t[before]), 0.0, 1.0)
    a, b = unit[before], unit[after]
    cosine = np.sum(a * b, axis=1)
    b = np.where(cosine[:, None] < 0, -b, b)
    angle = np.arccos(np.clip(np.abs(cosine), 0.0, 1.0))
    sine = np.where(angle < 1e-6, 1.0, np.sin(angle))
    wa = np.where(angle < 1e-6, 1 - share, np.sin((1 - share) * angle) / sine)
    wb = np.where(angle < 1e-6, share, np.sin(share * angle) / sine)
    return np.asarray(wa[:, None] * a + wb[:, None] * b)


def without_sign_flips(quaternion: Array) -> Array:
    """The same rotations with each sign chosen to be nearest to the one before."""
    dots = np.sum(quaternion[1:] * quaternion[:-1], axis=1)
    signs = np.concatenate([[1.0], np.cumprod(np.where(dots < 0, -1.0, 1.0))])
    return np.asarray(quaternion * signs[:, None])


def body_rate(quaternion: Array, rate: Array) -> Array:
    """Angular velocity in the body frame [rad/s]: ``2 vec(q* dq/dt) / |q|^2``."""
    w, v = quaternion[:, :1], quaternion[:, 1:]
    dw, dv = rate[:, :1], rate[:, 1:]
    vector = w * dv - dw * v - np.cross(v, dv)
    return np.asarray(2.0 * vector / np.sum(quaternion**2, axis=1, keepdims=True))


def resample(t: Array, values: Array, at: Array) -> Array:
    """Values at each instant, linear between two samples; NaN in a hole and beyond the ends.

    Where the channel was sampled more than twice as fast, it is the mean over a step of the grid, so that noise above
    the new rate does not fold back.
    """
    out = np.interp(at, t, values)
    step = float(np.median(np.diff(at))) if len(at) > 1 else 0.0
    own = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
    if own > 0 and step > 2 * own:
        sums = np.concatenate([[0.0], np.cumsum(values)])
        low = np.searchsorted(t, at - 0.5 * step)
        high = np.searchsorted(t, at + 0.5 * step)
        full = high > low
        out = np.where(full, (sums[high] - sums[low]) / np.maximum(high - low, 1), out)
    if len(t) > 1:
        after = np.clip(np.searchsorted(t, at, side="left"), 1, len(t) - 1)
        hole = (t[after] - t[after - 1] > GAP_STEPS * own) & (at > t[after - 1]) & (at < t[after])
        out = np.where(hole | (at < t[0] - own) | (at > t[-1] + own), np.nan, out)
    return np.asarray(out)
