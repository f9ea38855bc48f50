"""A pose, by the depth at rest, the attitude, the direction of motion and the speed."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .. import limits
from ..mapping import DIRECTIONS, Body, Mapping, Pose, Trial
from ..motion import Track
from ..signal import GAP_STEPS
from .finding import Finding
from .readings import Figures, faults, figures, named, readings

Array = NDArray[np.float64]


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
    elif found.astray > limits.ASTRAY and (other := _conjugate(track, pose, trial, body, max_speed, found.astray)):
        likely = other
        off = np.degrees(np.arcsin(found.astray))
        message = f"it moves {off:.0f} degrees off the vehicle's x axis, but wheels roll along it"
        message += f"; the recording fits {named(pose, other)}"
        write = f'quaternion_direction = "{other.quaternion_direction}" under [pose]'
        findings.append(Finding("motion", "wrong", name, "pose.quaternion_direction", message, write))
    elif found.forward < -0.5:
        findings.append(_backward(name, track, pose, trial, body, max_speed))
    findings.extend(_jumps(name, track, likely or pose, max_speed))
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
    # the one that drives forward, and of those the one that goes straightest
    fitting.sort(key=lambda item: (not item[2].forward > 0, np.round(np.nan_to_num(item[2].astray), 1)))
    return fitting


def _jumps(name: str, track: Track, pose: Pose, max_speed: float) -> list[Finding]:
    """Steps between two frames that no vehicle makes: one marker was taken for another."""
    position, quaternion = track.in_our_axes(pose)
    steps = np.diff(track.t)
    way = np.linalg.norm(np.diff(position, axis=0), axis=1)
    turn = 2 * np.arccos(np.clip(np.abs(np.sum(quaternion[1:] * quaternion[:-1], axis=1)), 0, 1))
    whole = steps <= GAP_STEPS * float(np.median(steps))
    far = way > max_speed * steps + limits.MARKER_NOISE
    far |= turn > limits.MAX_TURN * steps + limits.MARKER_NOISE_TURN
    at = np.flatnonzero(whole & far)
    if not len(at):
        return []
    first, last = at[0], at[-1]
    message = (
        f"from {track.t[first]:.3f} s to {track.t[first + 1]:.3f} s it moves by {way[first]:.3f} m and turns by "
        f"{np.degrees(turn[first]):.0f} degrees, faster than any vehicle"
    )
    message += f", and {len(at) - 1} times more up to {track.t[last + 1]:.3f} s" if len(at) > 1 else ""
    write = f"start_s or end_s, or leave_out_s = [[FROM, TO]], under [trials.{name}], without the frames that are wrong"
    return [Finding("jump", "wrong", name, "pose.position", message, write)]


def _conjugate(track: Track, pose: Pose, trial: Trial, body: Body, max_speed: float, astray: float) -> Pose | None:
    """The pose with the other direction of the quaternion, where the vehicle then goes far straighter."""
    other = replace(pose, quaternion_direction=DIRECTIONS[0 if pose.is_conjugate else 1])
    looks = figures(track, other, trial, body)
    goes_straight = looks.astray <= max(limits.ASTRAY, astray / 2)
    return other if goes_straight and not faults(looks, trial, max_speed) else None


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
