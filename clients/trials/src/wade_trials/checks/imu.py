"""The inertial sensor: 9.81 m/s2 along up at rest, and the rates of the pose."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .. import limits
from ..axes import (
    MEANING,
    PRESETS,
    SINGLE_TURNS,
    axes_text,
    matrix,
)
from ..mapping import Imu, Trial
from ..motion import up_of
from ..signal import resample
from ..source import Series
from ..units import UNITS
from .columns import rest_of
from .factors import DEGREES, factor_between, near
from .finding import Finding

Array = NDArray[np.float64]


def check_imu(
    name: str, imu: Imu, trial: Trial, series: dict[str, Series], columns: dict[str, Array]
) -> Iterator[Finding]:
    """The specific force at rest is 9.81 m/s2 along up, and the rates are those of the pose."""
    t, field = columns["t"], "imu.specific_force"
    raw = np.stack([resample(series[n].t, series[n].values, t) for n in imu.specific_force], axis=1)
    rest = rest_of(columns, trial) & np.isfinite(raw).all(axis=1)
    still = rest if rest.any() else np.isfinite(raw).all(axis=1)
    if not still.any():
        yield Finding("gravity", "skipped", name, field, "it has no sample in common with the motion")
        return
    mean, up = np.median(raw[still], axis=0), np.median(up_of(columns)[still], axis=0)
    slack = 1.0 if rest.any() else 2.0

    def fits(force: Array) -> bool:
        size_ok = abs(float(np.linalg.norm(force)) - limits.GRAVITY) < slack * limits.GRAVITY_TOLERANCE
        return size_ok and float(np.linalg.norm(force - limits.GRAVITY * up)) < slack * limits.DIRECTION_TOLERANCE

    scale = UNITS["acceleration"][imu.force_unit]
    force = matrix(imu.axes) @ mean * scale
    if fits(force):
        yield Finding("gravity", "ok", name, field, f"{float(force @ up):.2f} m/s2 along up at rest")
    else:
        shown = ", ".join(f"{value:.2f}" for value in force)
        message = f"the specific force at rest is ({shown}) m/s2 instead of 9.81 m/s2 along up"
        likely, write = "", ""
        if np.linalg.norm(force) < limits.GRAVITY_TOLERANCE:
            likely = "; gravity was taken off: map the raw accelerometer, or leave [imu] out"
        for unit, factor in UNITS["acceleration"].items():
            for axes in (imu.axes, *PRESETS.values(), *SINGLE_TURNS):
                if not write and fits(matrix(axes) @ mean * factor):
                    changed = [f'force_unit = "{unit}"'] if unit != imu.force_unit else []
                    changed += [f"axes = {axes_text(axes)}"] if axes != imu.axes else []
                    write = " and ".join(changed) + " under [imu]"
                    preset = next((key for key, value in PRESETS.items() if value == axes and axes != imu.axes), "")
                    likely = f"; it fits {MEANING[preset]}" if preset else f"; it fits the unit {unit}"
                    if preset == "NED" and np.linalg.norm(force + limits.GRAVITY * up) < 2 * limits.DIRECTION_TOLERANCE:
                        likely += ", or an acceleration of gravity in place of the specific force"
        yield Finding("gravity", "wrong", name, field, message + likely, write)
    if all(imu.angular_velocity):
        yield from _check_rates(name, imu, series, columns)


def _check_rates(name: str, imu: Imu, series: dict[str, Series], columns: dict[str, Array]) -> Iterator[Finding]:
    t, scale = columns["t"], UNITS["angular velocity"][imu.rate_unit]
    raw = np.stack([resample(series[n].t, series[n].values, t) for n in imu.angular_velocity], axis=1)
    rate = np.nan_to_num(raw) * scale @ matrix(imu.axes).T
    for axis, column in enumerate(("wx", "wy", "wz")):
        factor = factor_between(columns[column], rate[:, axis])
        if factor is None:
            continue
        field = "imu.angular_velocity"
        if near(abs(factor), DEGREES):
            message = f"it is 57 times {column} of the pose: degrees per second"
            yield Finding("rates", "wrong", name, field, message, 'rate_unit = "deg/s" under [imu]')
            return
        if factor < 0:
            message = f"it turns against {column} of the pose: the sensor, or the tracked body, has other axes"
            yield Finding("rates", "wrong", name, field, message, "the axes of the sensor as axes under [imu]")
            return
        if near(factor, 1):
            yield Finding("rates", "ok", name, field, f"{column} agrees within {abs(factor - 1):.0%}")
            return
