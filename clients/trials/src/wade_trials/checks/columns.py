"""Speed, depth, angles and wheel speeds."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .. import limits
from ..mapping import Mapping, Trial
from ..units import UNITS, quantity_of
from .factors import DEGREES, factor_between, near
from .finding import Finding
from .load import check_drag, check_lift

Array = NDArray[np.float64]


def rest_of(columns: dict[str, Array], trial: Trial) -> NDArray[np.bool_]:
    """The samples at rest: as stated, else spans in which nothing moves."""
    t = columns["t"]
    if trial.rest_s is not None:
        return np.asarray((t >= trial.rest_s[0]) & (t <= trial.rest_s[1]))
    speed = np.sqrt(sum(columns[name] ** 2 for name in ("vx", "vy", "vz")))
    rate = np.sqrt(sum(columns[name] ** 2 for name in ("wx", "wy", "wz")))
    still = (speed < limits.REST_SPEED) & (rate < limits.REST_RATE)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(np.int8), [0]])))
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        if t[end - 1] - t[start] < limits.REST_DURATION:
            still[start:end] = False
    return np.asarray(still)


def check_columns(name: str, mapping: Mapping, trial: Trial, columns: dict[str, Array]) -> Iterator[Finding]:
    """Speed, depth, angles and wheel speeds that come as columns, and the lift at rest."""
    rest = rest_of(columns, trial)
    if mapping.pose is None:
        yield from _check_speed(name, mapping, columns)
        yield from _check_depth(name, mapping, trial, columns, rest)
        yield from _check_angles(name, mapping, columns)
    yield from _check_wheels(name, mapping, columns)
    yield from check_drag(name, mapping, columns)
    yield from check_lift(name, mapping, columns, rest)


def _units_that(column: str, mapping: Mapping, ratio_low: float, ratio_high: float) -> list[str]:
    """Units of a column's quantity that scale it by a ratio in a range."""
    stated = mapping.columns.get(column)
    if stated is None or not stated.channel:
        return []
    table = UNITS[quantity_of(column)]
    return [u for u, f in table.items() if u != stated.unit and ratio_low <= f / table[stated.unit] <= ratio_high]


def _unit_text(column: str, unit: str) -> str:
    return f'unit = "{unit}" in [columns] {column}'


def _check_speed(name: str, mapping: Mapping, columns: dict[str, Array]) -> Iterator[Finding]:
    speed = np.sqrt(sum(columns[axis] ** 2 for axis in ("vx", "vy", "vz")))
    fast = float(np.quantile(speed, 0.99))
    if fast <= mapping.max_speed_mps:
        yield Finding("speed", "ok", name, "columns.vx", f"up to {fast:.2f} m/s")
        return
    units = _units_that("vx", mapping, 0.0, mapping.max_speed_mps / fast)
    message = f"the speed reaches {fast:.3g} m/s, above max_speed_mps = {mapping.max_speed_mps:g}"
    write = " or ".join(f'"{unit}"' for unit in units)
    yield Finding("speed", "wrong", name, "columns.vx", message, f"unit = {write} in [columns] vx" if units else "")


def _check_depth(
    name: str, mapping: Mapping, trial: Trial, columns: dict[str, Array], rest: NDArray[np.bool_]
) -> Iterator[Finding]:
    stated = mapping.columns.get("depth")
    if stated is None or not stated.channel:
        return
    if trial.depth_m is None:
        message = "the depth was not checked: state depth_m, the water depth measured at rest"
        yield Finding("depth", "skipped", name, f"trials.{name}.depth_m", message)
        return
    depth = columns["depth"][rest] if rest.any() else columns["depth"]
    near = np.abs(depth - trial.depth_m) < limits.DEPTH_TOLERANCE
    if near.mean() >= limits.MIN_SHARE_AT_DEPTH:
        yield Finding("depth", "ok", name, "columns.depth", f"{near.mean():.0%} at the stated {trial.depth_m} m")
        return
    median = float(np.median(depth))
    message = f"the recording gives a depth of {median:.3f} m, depth_m states {trial.depth_m:g} m at rest"
    write = ""
    if abs(median + trial.depth_m) < limits.DEPTH_TOLERANCE:
        message += "; it is positive downward or NED"
        write = "factor = -1 in [columns] depth"
    elif median > 0:
        slack = limits.DEPTH_TOLERANCE / trial.depth_m
        ratio = trial.depth_m / median
        units = _units_that("depth", mapping, ratio * (1 - slack), ratio * (1 + slack))
        write = _unit_text("depth", units[0]) if units else ""
    yield Finding("depth", "wrong", name, "columns.depth", message, write)


def _check_angles(name: str, mapping: Mapping, columns: dict[str, Array]) -> Iterator[Finding]:
    t = columns["t"]
    for angle, rate in (("roll", "wx"), ("pitch", "wy"), ("yaw", "wz")):
        if angle not in columns:
            continue
        turned = np.concatenate([[0.0], np.cumsum(0.5 * (columns[rate][1:] + columns[rate][:-1]) * np.diff(t))])
        largest = float(np.abs(columns[angle]).max())
        ratio = factor_between(turned, np.unwrap(columns[angle], period=360 if largest > 2 * np.pi else 2 * np.pi))
        beyond = largest > (1.6 if angle == "pitch" else 4 * np.pi)
        if (ratio is not None and near(abs(ratio), DEGREES)) or (ratio is None and beyond):
            message = f"{angle} reaches {largest:.3g}, which are degrees"
            yield Finding("angles", "wrong", name, f"columns.{angle}", message, _unit_text(angle, "deg"))
        elif ratio is not None and near(abs(ratio), 1 / DEGREES):
            message = f"{rate} is 57 times the rate of {angle}: degrees per second"
            yield Finding("angles", "wrong", name, f"columns.{rate}", message, _unit_text(rate, "deg/s"))
        elif ratio is not None and ratio < 0 and near(-ratio, 1):
            message = f"{angle} turns against {rate}: one of the two has another axis (NED turns y and z over)"
            yield Finding("angles", "wrong", name, f"columns.{angle}", message, f"factor = -1 in [columns] {angle}")


def _check_wheels(name: str, mapping: Mapping, columns: dict[str, Array]) -> Iterator[Finding]:
    low, high = limits.WHEEL_RADIUS
    for wheel in (column for column in columns if column.startswith("wheel_")):
        turning = (np.abs(columns["vx"]) > limits.MOVING) & (np.abs(columns[wheel]) > 1e-6)
        if np.count_nonzero(turning) < limits.FROZEN_SAMPLES:
            continue
        radius = float(np.median(columns["vx"][turning] / columns[wheel][turning]))
        if low <= radius <= high:
            yield Finding("wheels", "ok", name, f"columns.{wheel}", f"rolls with a radius of {radius:.2f} m")
            continue
        if low <= -radius <= high:
            message = f"{wheel} turns backward while the vehicle drives forward"
            yield Finding("wheels", "wrong", name, f"columns.{wheel}", message, f"factor = -1 in [columns] {wheel}")
            continue
        message = f"{wheel} and vx make a wheel of {abs(radius):.3g} m radius"
        # the radius is divided by what the unit multiplies
        units = _units_that(wheel, mapping, abs(radius) / high, abs(radius) / low)
        write = " or ".join(f'"{unit}"' for unit in units)
        write = f"unit = {write} in [columns] {wheel}" if units else ""
        yield Finding("wheels", "wrong", name, f"columns.{wheel}", message, write)
