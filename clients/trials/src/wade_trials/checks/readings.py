"""Readings of a pose: axes, order of the quaternion, unit, and what each makes of a recording."""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from .. import limits
from ..axes import (
    MEANING,
    PRESETS,
    axes_text,
    is_left_handed,
    rotations,
    turned_about_up,
)
from ..mapping import DIRECTIONS, Body, Pose, Trial
from ..motion import Track, depth_of
from ..units import UNITS

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Figures:
    """What a reading of the pose makes of a recording."""

    up: float
    speed: float
    #: Median shares of the velocity along body x, y and z while the vehicle moves; NaN where it does not.
    forward: float
    lateral: float
    vertical: float
    #: Sine of the angle between velocity and body x, rms; NaN likewise.
    astray: float
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
    astray = float(np.sqrt(np.mean(np.clip(1 - share[:, 0] ** 2, 0, 1))))
    fast = float(np.quantile(speed[whole], 0.99)) if whole.any() else 0.0
    return Figures(float(np.median(up[:, 2])), fast, along, across, upward, astray, depth, near)


def faults(found: Figures, trial: Trial, max_speed: float) -> list[str]:
    """The checks that a reading fails, the most specific one last."""
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


def readings(pose: Pose) -> list[tuple[Pose, list[str]]]:
    """Other readings of a pose with the fields that they change, those that change least first."""
    bodies = [turned_about_up(axes, quarters) for axes in PRESETS.values() for quarters in range(4)]
    orders = ("wxyz", "xyzw")
    out = []
    for order, way, (world, axes), body, unit in product(orders, DIRECTIONS, PRESETS.items(), bodies, UNITS["length"]):
        other = replace(
            pose, quaternion_order=order, quaternion_direction=way, axes=axes, body_axes=body, position_unit=unit
        )
        if is_left_handed(axes) != is_left_handed(body):
            continue
        changed = []
        if other.quaternion_order != pose.quaternion_order:
            changed.append(f'quaternion_order = "{order}"')
        if way != pose.quaternion_direction:
            changed.append(f'quaternion_direction = "{way}"')
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
    if other.quaternion_direction != pose.quaternion_direction:
        words.append("the conjugate quaternion, which turns the world into the body")
    if other.position_unit != pose.position_unit:
        long = {"m": "meters", "mm": "millimeters", "cm": "centimeters", "in": "inches", "ft": "feet"}
        words.append(long[other.position_unit])
    if other.body_axes != pose.body_axes and (other.body_axes != other.axes or not words):
        words.append("a tracked body whose axes are not the vehicle's")
    return " and ".join(words)
