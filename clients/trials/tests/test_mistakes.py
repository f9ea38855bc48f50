"""Promise: each mistake is refused with its likely cause and with what to write; the corrected mapping is accepted."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import generated
import numpy as np
import pytest
from helpers import FORCES, NED, POSE, Y_UP, accepted, mapping_of, refusal

from wade_trials import TrialsError, import_trials
from wade_trials.axes import quaternions, rotations, turned_about_up
from wade_trials.mapping import Column, Imu, Trial, Wrench
from wade_trials.source import Clock

POSES: dict[str, tuple[dict[str, Any], float, dict[str, Any], list[str]]] = {
    # name: what the recording is, scale of its position, what corrects the mapping, words of the message
    "y up": (Y_UP, 1.0, Y_UP, ["y up, the default of OptiTrack's export", 'write axes = "y up" under [pose]']),
    "NED": (NED, 1.0, NED, ["NED: north, east, down", 'write axes = "NED" under [pose]']),
    "order x y z w": (
        {"quaternion_order": "xyzw"},
        1.0,
        {"quaternion_order": "xyzw"},
        ["a quaternion in the order x y z w", 'write quaternion_order = "xyzw" under [pose]'],
    ),
    "millimeters": ({}, 1e3, {"position_unit": "mm"}, ["millimeters", 'write position_unit = "mm" under [pose]']),
    "inches": ({}, 1 / 0.0254, {"position_unit": "in"}, ["inches", 'position_unit = "in"']),
    "y up in millimeters": (
        Y_UP,
        1e3,
        Y_UP | {"position_unit": "mm"},
        ["y up, the default of OptiTrack's export and millimeters", 'axes = "y up" and position_unit = "mm"'],
    ),
    "y up and the order": (
        Y_UP | {"quaternion_order": "xyzw"},
        1.0,
        Y_UP | {"quaternion_order": "xyzw"},
        ["y up", "order x y z w"],
    ),
    "a body that was made facing left": (
        {"body_axes": turned_about_up(POSE.axes, 1)},
        1.0,
        {"body_axes": turned_about_up(POSE.axes, 1)},
        ["sideways", "whose axes are not the vehicle's", 'body_axes = ["y", "-x", "z"]'],
    ),
    "a body that was made facing z, y up": (
        {"axes": Y_UP["axes"], "body_axes": ("z", "x", "y")},
        1.0,
        {"axes": Y_UP["axes"], "body_axes": ("z", "x", "y")},
        ['axes = "y up" and body_axes = ["z", "x", "y"]'],
    ),
}


@pytest.mark.parametrize("mistake", POSES)
def test_a_pose_that_was_read_wrongly(mistake: str, tmp_path: Path) -> None:
    changes, scale, correction, words = POSES[mistake]
    recording = replace(generated.record(heading=2.4), **changes)
    columns = generated.table(recording)
    columns |= {name: columns[name] * scale for name in "xyz"}
    file = generated.write_csv(tmp_path / "run.csv", columns)
    # forces of a column are in our axes whatever the cameras' are
    message = refusal(mapping_of(file))
    assert "run: pose." in message and all(word in message for word in words), message
    accepted(mapping_of(file, pose=replace(POSE, **correction)))


def test_several_mistakes_are_named_at_once(wade: str, tmp_path: Path) -> None:
    """The other checks go on with the reading that the pose fits."""
    recording = generated.record()
    recording.axes = recording.body_axes = Y_UP["axes"]
    recording.force = -recording.force
    columns = generated.table(recording)
    columns |= {name: recording.specific_force[:, at] / 9.81 for at, name in enumerate(("sx", "sy", "sz"))}
    file = generated.write_csv(tmp_path / "run.csv", columns)
    message = refusal(mapping_of(file, imu=Imu(("sx", "sy", "sz"))))
    for word in ('axes = "y up" under [pose]', 'force_unit = "g" under [imu]', "factor = -1 in [columns] fz"):
        assert word in message, message


def test_the_recording_as_it_is_is_accepted(tmp_path: Path) -> None:
    for heading in (0.0, 1.0, 3.1, -2.0):
        file = generated.write_csv(tmp_path / "run.csv", generated.table(generated.record(heading=heading)))
        result = accepted(mapping_of(file))
        assert {f.check for f in result.findings if f.level == "ok"} == {
            "depth",
            "upright",
            "motion",
            "speed",
            "lift",
            "drag",
        }


def test_a_straight_run_along_x_hides_the_order_and_is_doubted(tmp_path: Path) -> None:
    """At heading 0 both orders stand upright: the wrong one drives backward."""
    recording = replace(generated.record(heading=0.0, turn=0.0), quaternion_order="xyzw")
    file = generated.write_csv(tmp_path / "run.csv", generated.table(recording))
    mapping = mapping_of(file, columns={})
    doubts = [f for f in import_trials(mapping, None).findings if f.level == "doubt"]
    assert len(doubts) == 1 and "backward" in str(doubts[0]) and 'quaternion_order = "xyzw"' in str(doubts[0])


def test_a_water_level_that_is_wrong_is_no_matter_of_axes(tmp_path: Path) -> None:
    file = generated.write_csv(tmp_path / "run.csv", generated.table(generated.record()))
    trial = Trial(str(file), generated.WATER_LEVEL + 0.15, generated.DEPTH)
    message = refusal(mapping_of(file, trials={"run": trial}))
    assert "a depth of 0.35" in message and "correct water_level_m (lower by 0.15" in message


def test_without_a_measured_depth_the_check_says_what_it_needs(tmp_path: Path) -> None:
    file = generated.write_csv(tmp_path / "run.csv", generated.table(generated.record()))
    result = accepted(mapping_of(file, trials={"run": Trial(str(file), generated.WATER_LEVEL)}))
    skipped = [str(f) for f in result.findings if f.level == "skipped"]
    assert any("state depth_m" in text for text in skipped), skipped


FROZEN = {
    "fx": ("channel fx has been frozen from 3.2 s on", "end_s = 3.2"),
    "z": ("channel z has been frozen from 3.2 s on", "end_s = 3.2"),
    "pose": ("channel x, y, z and 4 more have been frozen from 3.2 s on", "end_s = 3.2"),
}


@pytest.mark.parametrize("which", FROZEN)
def test_a_channel_that_freezes(which: str, tmp_path: Path) -> None:
    columns = generated.table(generated.record())
    start = int(3.2 * 120)
    for name in ("x", "y", "z", "qw", "qx", "qy", "qz") if which == "pose" else (which,):
        columns[name][start:] = columns[name][start]
    file = generated.write_csv(tmp_path / "run.csv", columns)
    message = refusal(mapping_of(file))
    assert all(word in message for word in FROZEN[which]), message
    trial = Trial(str(file), generated.WATER_LEVEL, generated.DEPTH, end_s=3.19)
    accepted(mapping_of(file, trials={"run": trial}))


def test_a_force_that_drops_to_zero(tmp_path: Path) -> None:
    columns = generated.table(generated.record())
    columns["fx"][900:] = 0.0
    message = refusal(mapping_of(generated.write_csv(tmp_path / "run.csv", columns)))
    assert "columns.fx" in message and "channel fx has been frozen from 7.5 s on" in message


def test_a_channel_that_freezes_for_a_while(tmp_path: Path) -> None:
    columns = generated.table(generated.record())
    columns["fz"][400:520] = columns["fz"][400]
    file = generated.write_csv(tmp_path / "run.csv", columns)
    message = refusal(mapping_of(file))
    assert "channel fz has been frozen from 3.3 s to 4.3 s" in message and "leave_out_s = [[3.333, 4.325]]" in message
    trial = Trial(str(file), generated.WATER_LEVEL, generated.DEPTH, leave_out_s=((3.333, 4.325),))
    accepted(mapping_of(file, trials={"run": trial}))


def test_a_load_along_the_motion_is_doubted(tmp_path: Path) -> None:
    columns = generated.table(generated.record())
    columns["fx"] = -columns["fx"]
    file = generated.write_csv(tmp_path / "run.csv", columns)
    doubts = [str(f) for f in import_trials(mapping_of(file), None).findings if f.level == "doubt"]
    assert len(doubts) == 1 and "fx is along the motion" in doubts[0] and "factor = -1 in [columns] fx" in doubts[0]


def test_a_simulator_at_rest_is_not_frozen(tmp_path: Path) -> None:
    """Its pose stands still to the last bit between two drives."""
    first = generated.table(generated.record(noise=0.0))
    columns = {name: np.concatenate([values, values[-1:] + values - values[0]]) for name, values in first.items()}
    columns["t"][len(first["t"]) :] += 1 / 120
    for name in ("qw", "qx", "qy", "qz", "fx", "fy", "fz"):
        columns[name] = np.concatenate([first[name], first[name][::-1]])
    for name in ("x", "y", "z"):
        columns[name] = np.concatenate([first[name], first[name][::-1]])
    accepted(mapping_of(generated.write_csv(tmp_path / "run.csv", columns)))


def test_a_channel_of_few_counts_is_not_frozen(tmp_path: Path) -> None:
    columns = generated.table(generated.record())
    columns["fy"] = np.round(columns["fy"] / 10) * 10
    accepted(mapping_of(generated.write_csv(tmp_path / "run.csv", columns)))


def test_a_force_that_is_not_connected(tmp_path: Path) -> None:
    columns = generated.table(generated.record())
    columns["fy"][:] = 0.0
    message = refusal(mapping_of(generated.write_csv(tmp_path / "run.csv", columns)))
    assert "columns.fy" in message and "0 throughout" in message


CELL = Wrench(("fx", "fy", "fz"))
CELLS: dict[str, tuple[Any, dict[str, Any], list[str]]] = {
    # name: force as the cell states it, what corrects the mapping, words of the message
    "reversed": (lambda f: -f, {"sign": -1}, ["the reaction on the cell", "write sign = -1 under"]),
    "NED": (lambda f: f * [1, -1, -1], {"axes": NED["axes"]}, ["(NED)", 'write axes = "NED" under']),
    "kN": (lambda f: f / 1e3, {"force_unit": "kN"}, ["it fits kN", 'force_unit = "kN"']),
    "lbf": (lambda f: f / 4.4482216, {"force_unit": "lbf"}, ["it fits lbf", 'force_unit = "lbf"']),
    "y up": (
        lambda f: f[:, [0, 2, 1]] * [1, 1, -1],
        {"axes": Y_UP["axes"]},
        ["y of the cell points up", 'axes = "y up"'],
    ),
    "with the weight": (lambda f: f - [0, 0, 280 * 9.81], {"weight_n": 280 * 9.81}, ["weight", "weight_n = 2746.8"]),
}


@pytest.mark.parametrize("mistake", CELLS)
def test_a_load_cell_that_does_not_measure_the_lift_at_rest(mistake: str, wade: str, tmp_path: Path) -> None:
    change, correction, words = CELLS[mistake]
    recording = generated.record()
    recording.force = change(recording.force)
    file = generated.write_csv(tmp_path / "run.csv", generated.table(recording))
    message = refusal(mapping_of(file, columns={}, wrench=CELL))
    assert "rho g V at 0.200 m is 726.4 N" in message and all(word in message for word in words), message
    accepted(mapping_of(file, columns={}, wrench=replace(CELL, **correction)))


IMUS: dict[str, tuple[float, Any, float, dict[str, Any], list[str]]] = {
    "in g": (1 / 9.81, POSE.axes, 1.0, {"force_unit": "g"}, ["it fits the unit g", 'force_unit = "g"']),
    "NED": (1.0, NED["axes"], 1.0, {"axes": NED["axes"]}, ["NED", 'axes = "NED"']),
    "y up": (1.0, Y_UP["axes"], 1.0, {"axes": Y_UP["axes"]}, ["y up", 'axes = "y up"']),
    "degrees": (1.0, POSE.axes, 180 / np.pi, {"rate_unit": "deg/s"}, ["degrees per second", 'rate_unit = "deg/s"']),
}


@pytest.mark.parametrize("mistake", IMUS)
def test_an_inertial_sensor_that_does_not_feel_gravity(mistake: str, tmp_path: Path) -> None:
    from wade_trials.axes import matrix

    force, axes, rate, correction, words = IMUS[mistake]
    recording = generated.record()
    columns = generated.table(recording)
    columns |= {
        name: value
        for name, value in zip(("sx", "sy", "sz"), (recording.specific_force @ matrix(axes) * force).T, strict=True)
    }
    columns |= {
        name: value for name, value in zip(("gx", "gy", "gz"), (recording.rate @ matrix(axes) * rate).T, strict=True)
    }
    file = generated.write_csv(tmp_path / "run.csv", columns)
    imu = Imu(("sx", "sy", "sz"), ("gx", "gy", "gz"))
    message = refusal(mapping_of(file, imu=imu))
    assert "imu." in message and all(word in message for word in words), message
    result = accepted(mapping_of(file, imu=replace(imu, **correction)))
    assert {"gravity", "rates"} <= {f.check for f in result.findings}


def test_an_inertial_sensor_without_gravity(tmp_path: Path) -> None:
    recording = generated.record()
    columns = generated.table(recording) | {
        n: recording.specific_force[:, at] for at, n in enumerate(("sx", "sy", "sz"))
    }
    columns["sz"] -= 9.81
    file = generated.write_csv(tmp_path / "run.csv", columns)
    assert "gravity was taken off" in refusal(mapping_of(file, imu=Imu(("sx", "sy", "sz"))))


def _towed(recording: generated.Recording) -> dict[str, Any]:
    """A recording without cameras: a carriage, a gauge of depth, angles and wheel speeds."""
    random = np.random.default_rng(2)
    yaw = np.unwrap(2 * np.arctan2(recording.quaternion[:, 3], recording.quaternion[:, 0]))
    level = random.normal(scale=1e-3, size=len(recording.t))
    return {
        "t": recording.t,
        "vx": recording.speed + random.normal(scale=1e-3, size=len(recording.t)),
        "wz": recording.rate[:, 2],
        "yaw": yaw,
        "depth": generated.DEPTH + level,
        "wheel": recording.wheel,
        "fx": recording.force[:, 0],
        "fz": recording.force[:, 2],
    }


TOWED = {
    "vx": Column("vx", "m/s"),
    "vy": Column(constant=0.0),
    "vz": Column(constant=0.0),
    "wx": Column(constant=0.0),
    "wy": Column(constant=0.0),
    "wz": Column("wz", "rad/s"),
    "yaw": Column("yaw", "rad"),
    "depth": Column("depth", "m"),
    "wheel_fl": Column("wheel", "rad/s"),
    "fx": FORCES["fx"],
    "fz": FORCES["fz"],
}
COLUMNS: dict[str, tuple[str, str, float, Column, list[str]]] = {
    # name: channel, column, factor of the mistake, what corrects it, words of the message
    "mm/s": ("vx", "vx", 1e3, Column("vx", "mm/s"), ["columns.vx: the speed reaches", '"mm/s"']),
    "degrees": ("yaw", "yaw", 57.29578, Column("yaw", "deg"), ["columns.yaw", "degrees", 'unit = "deg"']),
    "degrees a second": ("wz", "wz", 57.29578, Column("wz", "deg/s"), ["columns.wz", 'unit = "deg/s"']),
    "yaw of NED": ("yaw", "yaw", -1.0, Column("yaw", "rad", -1.0), ["columns.yaw", "NED", "factor = -1"]),
    "depth in mm": ("depth", "depth", 1e3, Column("depth", "mm"), ["columns.depth", 'unit = "mm"']),
    "depth of NED": ("depth", "depth", -1.0, Column("depth", "m", -1.0), ["columns.depth", "NED", "factor = -1"]),
    "rpm": ("wheel", "wheel_fl", 30 / np.pi, Column("wheel", "rpm"), ["columns.wheel_fl", '"rpm"']),
    "wheel reversed": ("wheel", "wheel_fl", -1.0, Column("wheel", "rad/s", -1.0), ["turns backward", "factor = -1"]),
    "kN": ("fz", "fz", 1e-3, Column("fz", "kN"), ["columns.fz", "it fits kN", 'unit = "kN"']),
    "fz of NED": ("fz", "fz", -1.0, Column("fz", "N", -1.0), ["columns.fz", "(NED)", "factor = -1"]),
}


@pytest.mark.parametrize("mistake", COLUMNS)
def test_a_column_in_another_unit_or_with_another_sign(mistake: str, wade: str, tmp_path: Path) -> None:
    channel, column, factor, correction, words = COLUMNS[mistake]
    columns = _towed(generated.record())
    columns[channel] = columns[channel] * factor
    file = generated.write_csv(tmp_path / "run.csv", columns)
    message = refusal(mapping_of(file, pose=None, columns=TOWED))
    assert all(word in message for word in words), message
    accepted(mapping_of(file, pose=None, columns=TOWED | {column: correction}))


def test_a_clock_in_milliseconds(tmp_path: Path) -> None:
    columns = generated.table(generated.record(rate=100))
    columns["t"] = columns["t"] * 1e3
    file = generated.write_csv(tmp_path / "run.csv", columns)
    with pytest.raises(
        TrialsError, match=r"time.unit: the samples of x are 10 s apart.*write unit = \"ms\" under \[time\]"
    ):
        import_trials(mapping_of(file), None)
    accepted(mapping_of(file, clock=Clock("t", "ms")))


def test_a_clock_that_counts_frames_or_whole_seconds(tmp_path: Path) -> None:
    columns = generated.table(generated.record(rate=120))
    seconds = np.floor(columns["t"]).astype(np.float64)
    columns["t"] = np.arange(len(seconds), dtype=np.float64) + 17
    file = generated.write_csv(tmp_path / "run.csv", columns)
    with pytest.raises(TrialsError, match=r"time.rate_hz: .*counts frames: write rate_hz = .* under \[time\]"):
        import_trials(mapping_of(file), None)
    accepted(mapping_of(file, clock=Clock(rate_hz=120.0)))
    columns["t"] = seconds
    file = generated.write_csv(tmp_path / "run.csv", columns)
    with pytest.raises(TrialsError, match=r"time.channel: 99% of the samples of x have the stamp of the one before"):
        import_trials(mapping_of(file), None)


@pytest.mark.parametrize("heading", [0.0, 0.4, 2.4])
def test_a_conjugate_quaternion(heading: float, tmp_path: Path) -> None:
    """Where the vehicle drives along the cameras' x axis its bends show it."""
    columns = generated.table(generated.record(heading=heading))
    columns |= {name: -columns[name] for name in ("qx", "qy", "qz")}
    file = generated.write_csv(tmp_path / "run.csv", columns)
    message = refusal(mapping_of(file))
    assert "conjugate" in message and 'write quaternion_direction = "body_from_world" under [pose]' in message, message
    accepted(mapping_of(file, pose=replace(POSE, quaternion_direction="body_from_world")))


@pytest.mark.parametrize("turn", [0.0, 1.0])
def test_a_pose_that_jumps(turn: float, tmp_path: Path) -> None:
    recording = generated.record()
    middle = len(recording.t) // 2
    if turn:
        half = np.array([np.cos(turn / 2), 0, 0, np.sin(turn / 2)])
        recording.quaternion[middle:] = quaternions(rotations(recording.quaternion[middle:]) @ rotations(half[None])[0])
    else:
        recording.position[middle:, 1] += 0.1 + 12.0 / 120
    file = generated.write_csv(tmp_path / "run.csv", generated.table(recording))
    message = refusal(mapping_of(file, accept=["motion"]))
    assert f"from {recording.t[middle - 1]:.3f} s" in message and "faster than any vehicle" in message, message
    trial = Trial(str(file), generated.WATER_LEVEL, generated.DEPTH, end_s=float(recording.t[middle - 1]))
    accepted(mapping_of(file, trials={"run": trial}))


def test_a_finding_that_is_accepted_does_not_stop_the_import(tmp_path: Path) -> None:
    file = generated.write_csv(tmp_path / "run.csv", generated.table(generated.record()))
    trial = Trial(str(file), generated.WATER_LEVEL + 0.15, generated.DEPTH)
    mapping = mapping_of(file, trials={"run": trial}, columns={}, accept=["depth"])
    result = import_trials(mapping, tmp_path / "out")
    assert [f.check for f in result.findings if f.level == "wrong"] == ["depth"]
    assert (tmp_path / "out" / "run.csv").exists()
