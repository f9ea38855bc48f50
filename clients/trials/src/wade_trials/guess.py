"""A first mapping from the names of channels. What no file states is marked as a guess, with the reason."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from . import wade
from .axes import PRESETS, parse_axes
from .errors import TrialsError
from .mapping import COLUMNS, Column, Imu, Mapping, Pose, Trial, Triple, Wrench
from .readers import open_source
from .source import NO_CLOCK, Channel, Clock, Source
from .units import canonical_unit, quantity_of, si_unit

#: Endings of a pose: of the position and of the quaternion's components, w first. ``*`` is a prefix that all share.
POSES = [
    (("pose.position.", "xyz"), ("pose.orientation.", "wxyz")),
    (("transform.translation.", "xyz"), ("transform.rotation.", "wxyz")),
    (("position.", "xyz"), ("orientation.", "wxyz")),
    (("position.", "xyz"), ("rotation.", "wxyz")),
    (("translation.", "xyz"), ("rotation.", "wxyz")),
    (("pos_", "xyz"), ("quat_", "wxyz")),
    (("p", "xyz"), ("q", "wxyz")),
    (("", "xyz"), ("q", "wxyz")),
]
WRENCHES = [(("wrench.force.", "xyz"), ("wrench.torque.", "xyz")), (("force.", "xyz"), ("torque.", "xyz"))]
IMUS = [(("linear_acceleration.", "xyz"), ("angular_velocity.", "xyz"))]

_SUFFIXES = {
    "mps": "m/s", "radps": "rad/s", "degps": "deg/s", "rad": "rad", "deg": "deg", "m": "m", "mm": "mm", "n": "N",
    "kn": "kN", "nm": "N m", "mps2": "m/s2", "rpm": "rpm", "kgpm3": "kg/m3",
}  # fmt: skip


def _group(names: dict[str, str], stems: Any) -> list[tuple[str, list[list[str]]]]:
    """Prefixes under which all channels of the stems exist, with the channels of each stem."""
    first = stems[0][0] + stems[0][1][0]
    found = []
    for lower in names:
        if not lower.endswith(first):
            continue
        prefix = lower[: len(lower) - len(first)]
        # a stem is a name of its own or follows a separator
        if prefix and prefix[-1] not in "./_ ":
            continue
        groups = [[prefix + stem + letter for letter in letters] for stem, letters in stems]
        if all(name in names for group in groups for name in group):
            found.append((prefix, [[names[name] for name in group] for group in groups]))
    return found


@dataclass(frozen=True)
class Known:
    """What the caller states, so that it is no guess."""

    clock: Clock = NO_CLOCK
    #: Name of the tracked body, where there are several.
    body_name: str = ""
    tracked_point_to_origin_m: Triple | None = None
    water_level_m: float | None = None
    depth_m: float | None = None


NOTHING_KNOWN = Known()


def guess(files: Sequence[Path], vehicle: str, path: Path, known: Known = NOTHING_KNOWN) -> Mapping:
    """A mapping of files that have the same channels; ``path`` is where it will be written."""
    source = open_source(files[0], known.clock)
    channels = source.channels()
    mapping = Mapping(path=path.resolve(), vehicle=vehicle, trials={}, clock=known.clock)
    _trials(mapping, files, known)
    try:
        mapping.body = wade.body(vehicle)
    except TrialsError as error:
        raise TrialsError(path, "body", f"the vehicle is not known: {error}") from None
    names = {channel.name.lower(): channel.name for channel in channels}
    _pose(mapping, source, names, known)
    _wrench_and_imu(mapping, channels, names)
    _columns(mapping, channels)
    if mapping.pose is None and not mapping.columns:
        listed = ", ".join(channel.name for channel in channels[:12])
        raise TrialsError(
            files[0],
            "",
            f"no channel looks like a pose or a column of a trial: write the mapping by hand; it has {listed}",
        )
    if mapping.pose is None:
        for name in ("vx", "vy", "vz", "wx", "wy", "wz"):
            if name not in mapping.columns:
                mapping.columns[name] = Column(constant=0.0)
                mapping.guesses[f"columns.{name}"] = "no channel has this name; 0 is that of a vehicle that was held"
        if "depth" not in mapping.columns and "water_level" not in mapping.columns and known.depth_m is None:
            raise TrialsError(files[0], "depth", "no channel states it: give --depth, the water depth at rest [m]")
    return mapping


def _trials(mapping: Mapping, files: Sequence[Path], known: Known) -> None:
    for file in files:
        stem = file.name if file.is_dir() else file.stem
        name = re.sub(r"[^A-Za-z0-9_-]+", "-", stem).strip("-") or "trial"
        if name in mapping.trials:
            raise TrialsError(file, "", f"two files would become the trial {name}: rename one of them")
        mapping.trials[name] = Trial(file=str(file.resolve()), water_level_m=known.water_level_m, depth_m=known.depth_m)


def _pose(mapping: Mapping, source: Source, names: dict[str, str], known: Known) -> None:
    body_name, arm = known.body_name, known.tracked_point_to_origin_m
    found: list[tuple[str, list[list[str]]]] = []
    for stems in POSES:
        for prefix, groups in _group(names, stems):
            if all(groups != other for _, other in found) and body_name.lower() in prefix:
                found.append((prefix, groups))
        if found:
            break
    if not found:
        if body_name:
            raise TrialsError(mapping.path, "pose", f'no pose of a body "{body_name}" is in the recording')
        return
    position, quaternion = found[0][1]
    w, x, y, z = quaternion
    guesses = mapping.guesses
    if len(found) > 1:
        others = ", ".join(prefix.rstrip("./_ ") for prefix, _ in found[1:4])
        guesses["pose.position"] = f"the first of several bodies; the others are {others}"
    pose = Pose((position[0], position[1], position[2]), (w, x, y, z))
    stated, unsure = source.conventions.stated, source.conventions.guessed
    unit = stated.get("pose.position_unit")
    texts = [channel.unit for channel in source.channels() if channel.name == position[0]]
    own = canonical_unit("length", texts[0]) if texts and texts[0] else None
    if unit or own:
        pose = replace(pose, position_unit=str(unit[0]) if unit else str(own))
    else:
        guesses["pose.position_unit"] = "the file states no unit"
    axes = stated.get("pose.axes") or unsure.get("pose.axes")
    if axes:
        parsed = parse_axes(axes[0]) or PRESETS["z up"]
        pose = replace(pose, axes=parsed, body_axes=parsed)
    if "pose.axes" not in stated:
        reason = axes[1] if axes else "the file states no axes; z up is the convention of ROS"
        guesses["pose.axes"] = reason
        guesses["pose.body_axes"] = "those of the world, as when the body was made while the vehicle faced along x"
    if arm is None:
        guesses["pose.tracked_point_to_origin_m"] = "not given; measure it from the tracked point to the hull's middle"
    else:
        pose = replace(pose, tracked_point_to_origin_m=arm)
    mapping.pose = pose
    for name, trial in mapping.trials.items():
        if trial.water_level_m is None:
            raise TrialsError(
                Path(trial.file),
                f"trials.{name}.water_level_m",
                "the depth needs it: give --water-level, the altitude of the still water in the frame of the cameras",
            )


def _wrench_and_imu(mapping: Mapping, channels: Sequence[Channel], names: dict[str, str]) -> None:
    for stems in WRENCHES:
        for _, (force, moment) in _group(names, stems)[:1]:
            if mapping.wrench is None:
                mapping.wrench = Wrench((force[0], force[1], force[2]), (moment[0], moment[1], moment[2]))
                for key, why in (
                    ("axes", "those of the vehicle"),
                    ("sign", "what the water does to the vehicle"),
                    ("point_m", "moments about the body origin"),
                ):
                    mapping.guesses[f"wrench.{key}"] = why
    for stems in IMUS:
        for _, (force, rate) in _group(names, stems)[:1]:
            mapping.imu = Imu((force[0], force[1], force[2]), (rate[0], rate[1], rate[2]))
            mapping.guesses["imu.axes"] = "those of the vehicle"


def _columns(mapping: Mapping, channels: Sequence[Channel]) -> None:
    """Channels that are named like a column of a trial, with or without a unit."""
    made = set()
    if mapping.pose:
        made |= {"vx", "vy", "vz", "wx", "wy", "wz", "roll", "pitch", "yaw", "depth", "water_level", "ax", "ay", "az"}
    if mapping.wrench:
        made |= {"fx", "fy", "fz", "mx", "my", "mz"}
    for channel in channels:
        base = re.split(r"[/.@]", channel.name)[-1] if "/" in channel.name else channel.name.split("@")[0]
        lower = base.strip().lower()
        name, _, suffix = lower.rpartition("_")
        unit = _SUFFIXES.get(suffix, "") if name in COLUMNS else ""
        name = name if unit else lower
        if name not in COLUMNS or name in made or name in mapping.columns:
            continue
        quantity = quantity_of(name)
        text = channel.unit or unit
        known = canonical_unit(quantity, text) if text else None
        if text and known is None:
            raise TrialsError(
                mapping.trials[next(iter(mapping.trials))].file,
                channel.name,
                f'its unit "{text}" is no unit of {quantity} that is known: write the mapping by hand',
            )
        mapping.columns[name] = Column(channel.name, known or si_unit(quantity))
        if not text:
            mapping.guesses[f"columns.{name}"] = (
                f"the file states no unit; {si_unit(quantity)}, body axes x forward, z up"
            )
