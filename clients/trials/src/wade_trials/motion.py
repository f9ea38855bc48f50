"""From a recording to the columns of a trial, by the source paper's processing.

Resampling to a uniform rate (positions linearly, rotations by slerp), a Savitzky-Golay filter for smoothing and
derivatives, and the lever arm from the tracked point to the body origin: ``v_origin = v_point + omega x r``.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .axes import matrix, rotations, turned
from .errors import TrialsError
from .mapping import WRENCH, Body, Mapping, Pose, Processing, Trial
from .signal import body_rate, grid, pieces, resample, savitzky_golay, slerp, without_sign_flips
from .source import Series
from .units import UNITS, quantity_of

Array = NDArray[np.float64]

#: How far from 1 the length of a quaternion may be: what a few decimals lose, and no more.
LENGTH_TOLERANCE = 0.02
#: Samples of the grid that are processed at once.
BLOCK = 50_000


@dataclass(frozen=True)
class Track:
    """A tracked pose as it was recorded: time [s], position in the unit of the file, the four channels as listed."""

    t: Array
    position: Array
    quaternion: Array

    def in_our_axes(self, pose: Pose) -> tuple[Array, Array]:
        """Positions [m] and quaternions w x y z in our axes."""
        order = [0, 1, 2, 3] if pose.quaternion_order == "wxyz" else [3, 0, 1, 2]
        scale = UNITS["length"][pose.position_unit]
        quaternion = self.quaternion[:, order]
        if pose.is_conjugate:
            quaternion = quaternion * np.array([1.0, -1.0, -1.0, -1.0])
        return turned(self.position * scale, quaternion, pose.axes, pose.body_axes)


def window(series: Series, trial: Trial) -> Series:
    """The samples within the stated window, without those that are left out and without NaN."""
    keep = np.isfinite(series.t) & np.isfinite(series.values)
    if trial.start_s is not None:
        keep &= series.t >= trial.start_s
    if trial.end_s is not None:
        keep &= series.t <= trial.end_s
    for start, end in trial.leave_out_s:
        keep &= (series.t < start) | (series.t > end)
    return series if keep.all() else Series(series.t[keep], series.values[keep])


def increasing(path: Path, channel: str, series: Series) -> Series:
    """The series without repeated stamps; time that goes back is an error."""
    steps = np.diff(series.t)
    if len(series.t) < 2:
        raise TrialsError(path, channel, f"it has {len(series.t)} samples in the window: at least 2 are needed")
    if np.any(steps < 0):
        at = int(np.argmax(steps < 0))
        raise TrialsError(
            path, channel, f"time goes back from {series.t[at]:.4f} s to {series.t[at + 1]:.4f} s: sort the recording"
        )
    keep = np.concatenate([[True], steps > 0])
    return series if keep.all() else Series(series.t[keep], series.values[keep])


def track_of(path: Path, mapping: Mapping, trial: Trial, series: dict[str, Series]) -> Track:
    """The tracked pose of a trial, with frames in which tracking was lost left out."""
    assert mapping.pose is not None
    channels = [*mapping.pose.position, *mapping.pose.quaternion]
    parts = [series[name] for name in channels]
    t = parts[0].t
    for name, part in zip(channels, parts, strict=True):
        if part.t is not t and not np.array_equal(part.t, t):
            raise TrialsError(path, name, f"it was not sampled together with {channels[0]}: map channels of one topic")
    values = np.stack([part.values for part in parts], axis=1)
    keep = np.isfinite(values).all(axis=1) & (np.abs(values[:, 3:]).max(axis=1) > 0)
    kept = window(Series(t, np.where(keep, 0.0, np.nan)), trial)
    if len(kept.t) < 2:
        raise TrialsError(path, "pose", "there is no frame with position and rotation in the window")
    inside = np.isin(t, kept.t) & keep
    clean = increasing(path, channels[0], Series(t[inside], np.arange(len(t))[inside].astype(float)))
    rows = values[clean.values.astype(int)]
    length = np.linalg.norm(rows[:, 3:], axis=1)
    off = np.abs(length - 1) > LENGTH_TOLERANCE
    if off.any():
        at = int(np.argmax(off))
        raise TrialsError(
            path,
            "pose.quaternion",
            f"at {clean.t[at]:.3f} s its length is {length[at]:.3f} instead of 1: map the four components of a unit "
            "quaternion, not angles",
        )
    return Track(clean.t, rows[:, :3], rows[:, 3:])


def depth_of(level: float, altitude: Array, up: Array, pose: Pose, body: Body) -> Array:
    """Depth from the altitude of the tracked point: the body origin lies ``up . r`` above it, and the water plane
    crosses body z at ``(level - altitude of the origin) / up_z``."""
    origin = altitude + up @ np.array(pose.tracked_point_to_origin_m)
    return np.asarray((level - origin) / up[:, 2] - body.ground_contact_z_m)


@dataclass(frozen=True)
class Rig:
    """What the processing of a pose needs beside the recording."""

    pose: Pose
    body: Body
    #: Altitude of the still water [m]; without it there is no depth.
    water_level_m: float | None
    how: Processing


def from_pose(path: Path, track: Track, rig: Rig) -> dict[str, Array]:
    """Columns of the motion on the new grid.

    Pieces between holes are processed apart; those shorter than the filter's window are left out.
    """
    how = rig.how
    parts: list[dict[str, Array]] = []
    longest = 0
    for piece in pieces(track.t):
        part = Track(track.t[piece], track.position[piece], track.quaternion[piece])
        at = grid(part.t[0], part.t[-1], how.rate_hz)
        longest = max(longest, len(at))
        if len(at) >= how.window:
            parts.extend(_block(part, at, start, rig) for start in range(0, len(at), BLOCK))
    if not parts:
        raise TrialsError(
            path,
            "processing.window",
            f"the longest piece without a hole has {longest} samples at {how.rate_hz:g} Hz, fewer than the window of "
            f"{how.window}: is t in another unit, or are the stamps those of receipt in bursts?",
        )
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _block(track: Track, at: Array, start: int, rig: Rig) -> dict[str, Array]:
    """A block of a piece's grid, processed with a window more on both sides, so that blocks leave no trace."""
    end = min(start + BLOCK, len(at))
    low, high = max(start - rig.how.window, 0), min(end + rig.how.window, len(at))
    first = max(int(np.searchsorted(track.t, at[low], side="right")) - 1, 0)
    last = int(np.searchsorted(track.t, at[high - 1], side="left")) + 1
    rows = Track(track.t[first:last], track.position[first:last], track.quaternion[first:last])
    return {name: values[start - low : end - low] for name, values in _columns(rows, at[low:high], rig).items()}


def _columns(track: Track, at: Array, rig: Rig) -> dict[str, Array]:
    """Resampled, smoothed, differentiated, and moved to the body origin."""
    how, pose = rig.how, rig.pose

    def filtered(samples: Array, derivative: int) -> Array:
        return savitzky_golay(samples, how.window, how.order, derivative, 1 / how.rate_hz)

    position, quaternion = track.in_our_axes(pose)
    places = [np.interp(at, track.t, position[:, axis]) for axis in range(3)]
    turns = without_sign_flips(slerp(track.t, quaternion, at))
    smooth = np.stack([filtered(turns[:, i], 0) for i in range(4)], axis=1)
    omega = body_rate(smooth, np.stack([filtered(turns[:, i], 1) for i in range(4)], axis=1))
    rotation = rotations(smooth)
    velocity = np.einsum("nji,nj->ni", rotation, np.stack([filtered(place, 1) for place in places], axis=1))
    velocity += np.cross(omega, np.array(pose.tracked_point_to_origin_m))
    up = rotation[:, 2, :]
    columns = {"t": at}
    columns |= {name: velocity[:, axis] for axis, name in enumerate(("vx", "vy", "vz"))}
    columns |= {name: omega[:, axis] for axis, name in enumerate(("wx", "wy", "wz"))}
    columns["roll"] = np.arctan2(rotation[:, 2, 1], rotation[:, 2, 2])
    columns["pitch"] = -np.arcsin(np.clip(rotation[:, 2, 0], -1, 1))
    columns["yaw"] = np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])
    if rig.water_level_m is not None:
        columns["depth"] = depth_of(rig.water_level_m, filtered(places[2], 0), up, pose, rig.body)
    return columns


def up_of(columns: dict[str, Array]) -> Array:
    """World up in the body frame, ``[n, 3]``."""
    zero = np.zeros_like(columns["t"])
    roll, pitch = columns.get("roll", zero), columns.get("pitch", zero)
    return np.stack([-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)], axis=1)


def base_grid(mapping: Mapping, series: dict[str, Series]) -> Array:
    """The instants of a trial without a pose: those of its fastest channel, at most the rate of the processing."""
    used = [series[name] for name in mapping.channels()]
    first, last = max(s.t[0] for s in used), min(s.t[-1] for s in used)
    rate = max(1 / float(np.median(np.diff(s.t))) for s in used)
    return grid(first, last, min(mapping.processing.rate_hz, rate))


def add_columns(
    path: Path, mapping: Mapping, trial: Trial, series: dict[str, Series], columns: dict[str, Array]
) -> None:
    """Adds the columns that channels become as they are, constants, and the wrench about the center of mass."""
    t = columns["t"]
    for name, column in mapping.columns.items():
        if column.constant is not None:
            columns[name] = np.full(len(t), column.constant)
            continue
        own = series[column.channel]
        scale = UNITS[quantity_of(name)][column.unit] * column.factor
        columns[name] = resample(own.t, own.values * scale, t)
    if mapping.wrench is not None:
        _add_wrench(mapping, series, columns)
    if not {"depth", "water_level"} & set(columns):
        assert trial.depth_m is not None
        columns["depth"] = np.full(len(t), trial.depth_m)
    keep = np.all([np.isfinite(values) for values in columns.values()], axis=0)
    if np.count_nonzero(keep) < 2:
        raise TrialsError(path, "", "the channels of the mapping have no span of time in common: check their clocks")
    if not keep.all():
        for name in columns:
            columns[name] = columns[name][keep]


def _add_wrench(mapping: Mapping, series: dict[str, Series], columns: dict[str, Array]) -> None:
    wrench, t = mapping.wrench, columns["t"]
    assert wrench is not None
    turn = matrix(wrench.axes) * wrench.sign

    def vector(channels: tuple[str, str, str], scale: float) -> tuple[Array, list[bool]]:
        raw = np.stack(
            [resample(series[n].t, series[n].values, t) if n else np.zeros(len(t)) for n in channels], axis=1
        )
        measured = np.abs(turn) @ np.array([bool(n) for n in channels]) > 0
        return raw * scale @ turn.T, measured.tolist()

    force, has_force = vector(wrench.force, UNITS["force"][wrench.force_unit])
    if wrench.weight_n:
        force = force + wrench.weight_n * up_of(columns)
    names = dict(zip(WRENCH[:3], range(3), strict=True))
    columns |= {name: force[:, at] for name, at in names.items() if has_force[at]}
    if any(wrench.moment):
        moment, has_moment = vector(wrench.moment, UNITS["moment"][wrench.moment_unit])
        assert mapping.body is not None
        arm = np.array(wrench.point_m) - np.array(mapping.body.center_of_mass_m)
        moment = moment + np.cross(arm, force)
        for at, name in enumerate(WRENCH[3:]):
            # the lever arm needs the other two components of the force
            others = [has_force[other] or arm[3 - at - other] == 0 for other in range(3) if other != at]
            if has_moment[at] and all(others):
                columns[name] = moment[:, at]
