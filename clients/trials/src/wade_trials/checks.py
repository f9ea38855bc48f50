"""Axes, units, the order of quaternions and frozen channels, compared with what is known of the vehicle and the trial.

A finding names the check, the field, what is wrong and what to write. ``wrong`` stops the import unless the mapping
accepts the check; ``doubt`` does not; ``skipped`` says what is needed for the check.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from . import limits, wade
from .axes import MEANING, PRESETS, Axes, axes_text, is_left_handed, matrix, rotations
from .errors import TrialsError
from .mapping import WRENCH, Body, Imu, Mapping, Pose, Trial
from .motion import Track, depth_of, up_of
from .signal import resample
from .source import Series
from .units import UNITS, quantity_of

Array = NDArray[np.float64]
#: The checks that a mapping may accept.
CHECKS = ("frozen", "depth", "upright", "motion", "speed", "direction", "lift", "gravity", "rates", "angles", "wheels")
Level = Literal["ok", "doubt", "wrong", "skipped"]


#: Right-handed axes with another axis up, beside the presets.
SINGLE_TURNS: list[Axes] = [("y", "z", "x"), ("z", "y", "-x"), ("x", "z", "-y"), ("-x", "-y", "z")]


@dataclass(frozen=True)
class Finding:
    """What a check found in a trial."""

    check: str
    level: Level
    trial: str
    #: Field of the mapping.
    field: str
    message: str
    #: What corrects it, in the words of the mapping; empty where nothing does.
    write: str = ""

    def __str__(self) -> str:
        way_out = f": write {self.write}" if self.write else ""
        return f"{self.trial}: {self.field}: {self.message}{way_out}"


# --- the clock and frozen channels -----------------------------------------------------------------------------------


def check_clock(path: Path, channel: str, series: Series) -> None:
    """Refuses steps that look like another unit of time: no other check would mean anything."""
    step = float(np.median(np.diff(series.t)))
    if step > limits.LONG_STEP:
        unit = "ms" if step < 1e3 else "us" if step < 1e6 else "ns"
        message = f"the samples of {channel} are {step:g} s apart, too long for seconds"
        raise TrialsError(path, "time.unit", f'{message}: write unit = "{unit}" under [time]')


def frozen_run(series: Series) -> tuple[float, float] | None:
    """The longest span in which a live channel keeps one value to the last bit; ``None`` where there is none."""
    change = np.diff(series.values) != 0
    edges = np.flatnonzero(np.concatenate([[True], change, [True]]))
    runs = np.diff(edges)
    at = int(np.argmax(runs))
    first, last = int(edges[at]), int(edges[at + 1]) - 1
    start, end = float(series.t[first]), float(series.t[last])
    others = len(change) - (last - first)
    if runs[at] < limits.FROZEN_SAMPLES or end - start < limits.FROZEN_DURATION or others < limits.FROZEN_SAMPLES:
        return None
    live = np.count_nonzero(change) / others
    return (start, end) if live >= limits.LIVE_SHARE else None


def check_frozen(name: str, mapping: Mapping, series: dict[str, Series]) -> Iterator[Finding]:
    """Channels that stop, and channels of forces and inertial sensors that never move."""
    reported: dict[tuple[float, float], list[str]] = {}
    for channel in mapping.channels():
        own, field = series[channel], mapping.field_of(channel)
        if np.all(own.values == own.values[0]):
            if field.startswith(("wrench.", "imu.")) or field.split(".")[1] in WRENCH:
                message = f"channel {channel} is {own.values[0]:g} throughout: it is not connected"
                yield Finding("frozen", "wrong", name, field, message, 'the channel that was measured, or ""')
            continue
        span = frozen_run(own)
        # wheels and carriages stand still at exactly 0
        if span is None or (field.startswith("columns.") and own.values[np.searchsorted(own.t, span[0])] == 0):
            continue
        # channels that stop together: one may move a sample longer than another
        near = [other for other in reported if np.allclose(other, span, atol=limits.DIFFERENCE)]
        group = reported.pop(near[0]) if near else []
        joint = (max(span[0], near[0][0]), min(span[1], near[0][1])) if near else span
        reported[joint] = [*group, channel]
    for (start, end), channels in reported.items():
        if mapping.pose and _is_rest(mapping.pose, series, start, end, channels):
            continue
        last = max(float(series[channel].t[-1]) for channel in channels)
        names = ", ".join(channels[:3]) + (f" and {len(channels) - 3} more" if len(channels) > 3 else "")
        verb = "has" if len(channels) == 1 else "have"
        if end >= last - 1e-9:
            message = f"channel {names} {verb} been frozen from {start:.1f} s on"
            write = f"end_s = {start:.3f} under [trials.{name}]"
        else:
            message = f"channel {names} {verb} been frozen from {start:.1f} s to {end:.1f} s"
            write = f"leave_out_s = [[{start:.3f}, {end:.3f}]] under [trials.{name}]"
        yield Finding("frozen", "wrong", name, mapping.field_of(channels[0]), message, write)


def _is_rest(pose: Pose, series: dict[str, Series], start: float, end: float, channels: list[str]) -> bool:
    """True where the whole pose stands still and the vehicle did so before and after: a simulator has no noise."""
    live = {name for name in (*pose.position, *pose.quaternion) if np.ptp(series[name].values) > 0}
    if not live <= set(channels):
        return False
    scale = UNITS["length"][pose.position_unit]
    for at, other in ((start, start - limits.DIFFERENCE), (end, end + limits.DIFFERENCE)):
        way = [
            np.interp(at, series[n].t, series[n].values) - np.interp(other, series[n].t, series[n].values)
            for n in pose.position
        ]
        if float(np.linalg.norm(way)) * scale > 2 * limits.REST_SPEED * limits.DIFFERENCE:
            return False
    return end < float(series[pose.position[0]].t[-1]) - limits.DIFFERENCE


# --- the pose --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Figures:
    """What a reading of the pose makes of a recording."""

    up: float
    speed: float
    #: Median shares of the velocity along body x, y and z while the vehicle moves; NaN where it does not.
    forward: float
    lateral: float
    vertical: float
    #: Largest depth but for a twentieth [m], and the share of the frames at the stated depth; NaN where none is stated.
    depth: float
    share_at_depth: float


def figures(track: Track, pose: Pose, trial: Trial, body: Body) -> Figures:
    """The figures of one reading, from a few thousand frames."""
    count = len(track.t)
    span = max(round(limits.DIFFERENCE / max(float(np.median(np.diff(track.t))), 1e-9)), 1)
    span = min(span, count - 1)
    first = np.arange(0, count - span, max((count - span) // limits.MOST_FRAMES, 1))
    rows = np.concatenate([first, first + span, first + span // 2])
    position, quaternion = Track(track.t[rows], track.position[rows], track.quaternion[rows]).in_our_axes(pose)
    n = len(first)
    seconds = track.t[first + span] - track.t[first]
    velocity = (position[n : 2 * n] - position[:n]) / seconds[:, None]
    rotation = rotations(quaternion[2 * n :])
    in_body = np.einsum("nji,nj->ni", rotation, velocity)
    speed = np.linalg.norm(in_body, axis=1)
    whole = seconds < 5 * limits.DIFFERENCE
    moving = whole & (speed > limits.MOVING)
    share = np.full((1, 3), np.nan)
    if np.count_nonzero(moving) > max(0.02 * n, 3):
        share = in_body[moving] / speed[moving, None]
    up = rotation[:, 2, :]
    depth, near = np.nan, np.nan
    if trial.water_level_m is not None:
        upright = up[:, 2] > 0.1
        deep = depth_of(trial.water_level_m, position[2 * n :, 2][upright], up[upright], pose, body)
        depth = float(np.quantile(deep, 0.95)) if len(deep) else np.nan
        if trial.depth_m is not None:
            level = up[upright, 2] >= limits.LEVEL
            near = float(np.count_nonzero(level & (np.abs(deep - trial.depth_m) < limits.DEPTH_TOLERANCE))) / n
    along = float(np.median(share[:, 0]))
    across, upward = (float(np.median(np.abs(share[:, axis]))) for axis in (1, 2))
    fast = float(np.quantile(speed[whole], 0.99)) if whole.any() else 0.0
    return Figures(float(np.median(up[:, 2])), fast, along, across, upward, depth, near)


def faults(found: Figures, trial: Trial, max_speed: float) -> list[str]:
    """The checks that a reading fails, the most telling one last."""
    out = []
    if found.speed > max_speed:
        out.append("speed")
    if found.vertical > limits.MAX_VERTICAL or found.lateral > limits.MAX_LATERAL:
        out.append("motion")
    if found.up < limits.MIN_UP:
        out.append("upright")
    if trial.depth_m is not None and trial.water_level_m is not None:
        deepest = trial.depth_m + limits.DEPTH_TOLERANCE
        if not (found.share_at_depth >= limits.MIN_SHARE_AT_DEPTH and found.depth <= deepest):
            out.append("depth")
    return out


def opposite(axis: str) -> str:
    """The other direction of a signed axis."""
    return axis[1:] if axis.startswith("-") else "-" + axis


def turned_about_up(axes: Axes, quarters: int) -> Axes:
    """Body axes of a tracked body that was turned about its up axis by quarters of a turn."""
    x, y, z = axes
    return [(x, y, z), (y, opposite(x), z), (opposite(x), opposite(y), z), (opposite(y), x, z)][quarters]


def readings(pose: Pose) -> list[tuple[Pose, list[str]]]:
    """Other readings of a pose with the fields that they change, those that change least first."""
    bodies = [turned_about_up(axes, quarters) for axes in PRESETS.values() for quarters in range(4)]
    orders = ("wxyz", "xyzw")
    out = []
    for order, (world, axes), body, unit in product(orders, PRESETS.items(), bodies, UNITS["length"]):
        other = replace(pose, quaternion_order=order, axes=axes, body_axes=body, position_unit=unit)
        if is_left_handed(axes) != is_left_handed(body):
            continue
        changed = []
        if other.quaternion_order != pose.quaternion_order:
            changed.append(f'quaternion_order = "{order}"')
        if other.axes != pose.axes:
            changed.append(f"axes = {axes_text(axes)}")
        # body axes that are left out are the world's
        follows = body == axes and pose.body_axes == pose.axes
        if other.body_axes != pose.body_axes and not follows:
            changed.append(f"body_axes = {axes_text(body)}")
        if other.position_unit != pose.position_unit:
            changed.append(f'position_unit = "{unit}"')
        if changed:
            out.append((other, changed, world))
    # body axes that are no preset, and turned by half, come late among equals
    order_of = {axes: at for at, axes in enumerate(PRESETS.values())}
    out.sort(key=lambda item: (len(item[1]), order_of.get(item[0].body_axes, 9)))
    return [(other, changed) for other, changed, _ in out]


def named(pose: Pose, other: Pose) -> str:
    """The mistake that another reading corrects, in words."""
    words = []
    if other.axes != pose.axes:
        preset = next((name for name, axes in PRESETS.items() if axes == other.axes), "")
        words.append(MEANING.get(preset, "other axes"))
    if other.quaternion_order != pose.quaternion_order:
        words.append(f"a quaternion in the order {' '.join(other.quaternion_order)}")
    if other.position_unit != pose.position_unit:
        long = {"m": "meters", "mm": "millimeters", "cm": "centimeters", "in": "inches", "ft": "feet"}
        words.append(long[other.position_unit])
    if other.body_axes != pose.body_axes and (other.body_axes != other.axes or not words):
        words.append("a tracked body whose axes are not the vehicle's")
    return " and ".join(words)


def complaint(check: str, found: Figures, trial: Trial, max_speed: float) -> tuple[str, str]:
    """The field and the figure of a failed check."""
    tilt = float(np.degrees(np.arccos(np.clip(found.up, -1, 1))))
    if check == "depth":
        if np.isnan(found.depth):
            return "pose.axes", f"the vehicle lies upside down, tilted by {tilt:.0f} degrees; it stands on its wheels"
        text = f"the recording gives a depth of {found.depth:.3f} m, depth_m states {trial.depth_m:g} m at rest"
        if found.up < limits.MIN_UP:
            text += f", and the vehicle is tilted by {tilt:.0f} degrees instead of standing on its wheels"
        return "pose.axes", text
    if check == "upright":
        return "pose.axes", f"the vehicle is tilted by {tilt:.0f} degrees; it stands on its wheels"
    if check == "motion":
        return (
            "pose.body_axes",
            f"while it moves, {found.lateral:.0%} of the velocity is sideways and {found.vertical:.0%} vertical; "
            "wheels roll forward",
        )
    return "pose.position_unit", f"the speed reaches {found.speed:.3g} m/s, above max_speed_mps = {max_speed:g}"


def check_pose(name: str, mapping: Mapping, trial: Trial, track: Track) -> tuple[list[Finding], Pose | None]:
    """Checks a pose by depth, attitude, direction of motion and speed; also the reading that fits all four."""
    pose, body, max_speed = mapping.pose, mapping.body, mapping.max_speed_mps
    assert pose is not None and body is not None
    found = figures(track, pose, trial, body)
    failed = faults(found, trial, max_speed)
    findings: list[Finding] = []
    likely: Pose | None = None if failed else pose
    for check in ("depth", "upright", "motion", "speed"):
        if check in failed:
            continue
        if check == "depth" and (trial.depth_m is None or trial.water_level_m is None):
            message = "the depth was not checked: state depth_m, the water depth measured at rest"
            findings.append(Finding("depth", "skipped", name, f"trials.{name}.depth_m", message))
        elif check == "motion" and np.isnan(found.forward):
            message = f"the vehicle never moves faster than {limits.MOVING} m/s: its direction was not checked"
            findings.append(Finding("motion", "skipped", name, "pose.body_axes", message))
        else:
            findings.append(Finding(check, "ok", name, "pose", _passed(check, found, trial)))
    if failed:
        fitting = _fitting(track, pose, trial, body, max_speed)
        check = failed[-1]
        field, message = complaint(check, found, trial, max_speed)
        write = ""
        if fitting:
            likely, changed, _ = fitting[0]
            message += f"; the recording fits {named(pose, likely)}"
            write = " and ".join(changed) + " under [pose]"
        elif check == "depth" and not np.isnan(found.depth) and trial.depth_m is not None:
            off = found.depth - trial.depth_m
            message += (
                f"; no axes, unit or order explain it: correct water_level_m (lower by {off:.3f} m would agree), "
                "tracked_point_to_origin_m or depth_m, or leave depth_m out where the trial never reaches that depth"
            )
        findings.append(Finding(check, "wrong", name, field, message, write))
    elif found.forward < -0.5:
        findings.append(_backward(name, track, pose, trial, body, max_speed))
    return findings, likely


def _fitting(
    track: Track, pose: Pose, trial: Trial, body: Body, max_speed: float
) -> list[tuple[Pose, list[str], Figures]]:
    """The readings that pass every check with the fewest changed fields; those that drive forward come first."""
    fitting: list[tuple[Pose, list[str], Figures]] = []
    for other, changed in readings(pose):
        if fitting and len(changed) > len(fitting[0][1]):
            break
        looks = figures(track, other, trial, body)
        if not faults(looks, trial, max_speed):
            fitting.append((other, changed, looks))
    fitting.sort(key=lambda item: not item[2].forward > 0)
    return fitting


def _passed(check: str, found: Figures, trial: Trial) -> str:
    return {
        "depth": f"{found.share_at_depth:.0%} of the frames lie at the stated {trial.depth_m} m",
        "upright": f"the vehicle stands on its wheels, up_z = {found.up:.3f}",
        "motion": f"{abs(found.forward):.0%} of the velocity is along body x",
        "speed": f"up to {found.speed:.2f} m/s",
    }[check]


def _backward(name: str, track: Track, pose: Pose, trial: Trial, body: Body, max_speed: float) -> Finding:
    fitting = _fitting(track, pose, trial, body, max_speed)
    forward = [" and ".join(changed) for _, changed, looks in fitting if looks.forward > 0.5]
    choice = " or ".join(forward[:2])
    message = "the vehicle drives backward throughout; if it did not, its axes or the order of its quaternion are wrong"
    return Finding("direction", "doubt", name, "pose.body_axes", message, f"{choice} under [pose]" if choice else "")


# --- columns ---------------------------------------------------------------------------------------------------------


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


def factor_between(x: Array, y: Array) -> float | None:
    """The factor y / x of two signals that say the same, from the ratio of their spreads, with its sign."""
    x, y = x - x.mean(), y - y.mean()
    sx, sy = float(np.std(x)), float(np.std(y))
    if min(sx, sy) < limits.MIN_MOTION / 100 or max(sx, sy) < limits.MIN_MOTION:
        return None
    correlation = float(np.mean(x * y)) / (sx * sy)
    return float(np.sign(correlation)) * sy / sx if abs(correlation) > limits.MIN_CORRELATION else None


def _near(value: float, factor: float) -> bool:
    return abs(value / factor - 1) < limits.FACTOR_TOLERANCE


DEGREES = 180 / np.pi


def _check_angles(name: str, mapping: Mapping, columns: dict[str, Array]) -> Iterator[Finding]:
    t = columns["t"]
    for angle, rate in (("roll", "wx"), ("pitch", "wy"), ("yaw", "wz")):
        if angle not in columns:
            continue
        turned = np.concatenate([[0.0], np.cumsum(0.5 * (columns[rate][1:] + columns[rate][:-1]) * np.diff(t))])
        largest = float(np.abs(columns[angle]).max())
        ratio = factor_between(turned, np.unwrap(columns[angle], period=360 if largest > 2 * np.pi else 2 * np.pi))
        beyond = largest > (1.6 if angle == "pitch" else 4 * np.pi)
        if (ratio is not None and _near(abs(ratio), DEGREES)) or (ratio is None and beyond):
            message = f"{angle} reaches {largest:.3g}, which are degrees"
            yield Finding("angles", "wrong", name, f"columns.{angle}", message, _unit_text(angle, "deg"))
        elif ratio is not None and _near(abs(ratio), 1 / DEGREES):
            message = f"{rate} is 57 times the rate of {angle}: degrees per second"
            yield Finding("angles", "wrong", name, f"columns.{rate}", message, _unit_text(rate, "deg/s"))
        elif ratio is not None and ratio < 0 and _near(-ratio, 1):
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


def check_lift(name: str, mapping: Mapping, columns: dict[str, Array], rest: NDArray[np.bool_]) -> Iterator[Finding]:
    """The measured vertical force at rest is rho g V."""
    if "fz" not in columns:
        return
    field = "wrench.force" if mapping.wrench else "columns.fz"
    if not rest.any():
        message = "the lift was not checked: no half second at rest was found; state rest_s where there is one"
        yield Finding("lift", "skipped", name, f"trials.{name}.rest_s", message)
        return
    if "depth" not in columns:
        yield Finding("lift", "skipped", name, field, "the lift was not checked: it needs a depth")
        return
    depth = float(np.median(columns["depth"][rest]))
    density = mapping.fluid_density_kgpm3
    if depth <= 0:
        yield Finding("lift", "skipped", name, field, "the lift was not checked: the vehicle rests on dry ground")
        return
    try:
        lift, low, high = (
            wade.buoyancy(mapping.vehicle, round(max(d, 1e-3), 4), density)
            for d in (depth, depth - limits.LIFT_DEPTH, depth + limits.LIFT_DEPTH)
        )
    except TrialsError as error:
        yield Finding("lift", "skipped", name, field, f"the lift was not checked: {error}")
        return
    low, high = low * (1 - limits.LIFT_SHARE), high * (1 + limits.LIFT_SHARE)

    def fits(value: float) -> bool:
        return low <= value <= high

    fz = float(np.mean(columns["fz"][rest]))
    if fits(fz):
        yield Finding("lift", "ok", name, field, f"{fz:.0f} N at rest, rho g V is {lift:.0f} N")
        return
    message = f"fz at rest is {fz:.4g} N, rho g V at {depth:.3f} m is {lift:.4g} N"
    likely, write = _likely_lift(mapping, columns, rest, fz, fits)
    yield Finding("lift", "wrong", name, field, message + likely, write)


def drag_of(columns: dict[str, Array]) -> float | None:
    """Mean of fx against the motion [N]; ``None`` where the vehicle hardly moves or fx was not measured."""
    moving = np.abs(columns["vx"]) > limits.MOVING
    if "fx" not in columns or np.count_nonzero(moving) < limits.FROZEN_SAMPLES:
        return None
    return -float(np.mean(columns["fx"][moving] * np.sign(columns["vx"][moving])))


def check_drag(name: str, mapping: Mapping, columns: dict[str, Array]) -> Iterator[Finding]:
    """The load along x opposes the motion; a cell that also bears the drive may not show it."""
    drag = drag_of(columns)
    if drag is None:
        return
    field = "wrench.force" if mapping.wrench else "columns.fx"
    noise = float(np.std(columns["fx"])) / 10
    if drag > -noise:
        yield Finding("drag", "ok", name, field, f"fx opposes the motion by {drag:.1f} N on average")
        return
    message = f"fx is along the motion, by {-drag:.1f} N on average, and drag opposes it"
    stated = mapping.columns.get("fx")
    write = f"factor = {-stated.factor:g} in [columns] fx" if stated else "axes with the other sign under [wrench]"
    yield Finding("drag", "doubt", name, field, message, write)


def _likely_lift(
    mapping: Mapping,
    columns: dict[str, Array],
    rest: NDArray[np.bool_],
    fz: float,
    fits: Callable[[float], bool],
) -> tuple[str, str]:
    """What explains a wrong lift, and what to write."""
    wrench = mapping.wrench
    weight = (mapping.body.mass_kg or 0.0) * limits.GRAVITY if mapping.body else 0.0
    where = "under [wrench]" if wrench else "in [columns] fz"
    if wrench:
        unit_key, stated, reverse = "force_unit", wrench.force_unit, f"sign = {-wrench.sign}"
    else:
        column = mapping.columns["fz"]
        unit_key, stated, reverse = "unit", column.unit or "N", f"factor = {-column.factor:g}"
    if fits(-fz):
        message = "; the sign is reversed: "
        drag = drag_of(columns)
        if not wrench or drag is None:
            message += "it is the reaction on the cell, or z points down (NED)"
            return message, f'{reverse}, or axes = "NED", {where}' if wrench else f"{reverse} {where}"
        if drag > 0:
            return message + "z points down (NED), since fx opposes the motion", f'axes = "NED" {where}'
        return message + "it is the reaction on the cell, since fx is along the motion, too", f"{reverse} {where}"
    for unit, scale in UNITS["force"].items():
        for sign, also in ((1, ""), (-1, f" and {reverse}")):
            if unit != stated and fits(sign * fz * scale / UNITS["force"][stated]):
                return f"; it fits {unit}", f'{unit_key} = "{unit}"{also} {where}'
    for at, axis in enumerate(("fx", "fy")):
        value = float(np.mean(columns[axis][rest])) if axis in columns else 0.0
        if wrench and fits(abs(value)):
            up = wrench.axes[at] if value * wrench.sign > 0 else opposite(wrench.axes[at])
            axes = next((a for a in (*PRESETS.values(), *SINGLE_TURNS) if a[2] == up), PRESETS["z up"])
            return (
                f"; {axis} has that value, so {up} of the cell points up",
                f"axes = {axes_text(axes)} {where}",
            )
    if weight and fits(fz + weight):
        message = "; the reading holds the weight of the vehicle"
        return message, f"weight_n = {weight:.1f} {where}" if wrench else ""
    return "; neither sign, unit, axis nor weight explain it: was the cell zeroed in air?", ""


# --- the inertial sensor ---------------------------------------------------------------------------------------------


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
        if _near(abs(factor), DEGREES):
            message = f"it is 57 times {column} of the pose: degrees per second"
            yield Finding("rates", "wrong", name, field, message, 'rate_unit = "deg/s" under [imu]')
            return
        if factor < 0:
            message = f"it turns against {column} of the pose: the sensor, or the tracked body, has other axes"
            yield Finding("rates", "wrong", name, field, message, "the axes of the sensor as axes under [imu]")
            return
        if _near(factor, 1):
            yield Finding("rates", "ok", name, field, f"{column} agrees within {abs(factor - 1):.0%}")
            return
