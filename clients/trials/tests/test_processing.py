"""Promise: the columns are the motion that was recorded, and those that ``wade validate --mocap`` makes."""

import subprocess
import tomllib
from dataclasses import replace
from pathlib import Path

import generated
import numpy as np
import pytest
from helpers import BODY, POSE, columns_of, mapping_of

from wade_trials import import_trials, motion
from wade_trials.axes import PRESETS, quaternions, rotations
from wade_trials.mapping import Pose, Trial
from wade_trials.signal import resample, weights


def test_the_weights_are_the_published_ones() -> None:
    """The tables of Savitzky and Golay 1964 for 9 points and a quadratic: divisors 231 and, for the slope, 60."""
    smooth = np.array([-21, 14, 39, 54, 59, 54, 39, 14, -21]) / 231
    slope = np.arange(-4, 5) / 60
    assert np.allclose(weights(9, 2, 0)[4], smooth) and np.allclose(weights(9, 2, 1)[4], slope)


def test_quaternions_come_back_from_their_matrices() -> None:
    random = np.random.default_rng(1)
    turns = random.normal(size=(500, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    back = quaternions(rotations(turns))
    assert np.allclose(np.abs(np.sum(turns * back, axis=1)), 1)


def test_a_fast_channel_is_averaged_and_a_hole_stays_one() -> None:
    t = np.arange(0, 4, 1e-3)
    values = np.sin(t) + np.where(np.arange(len(t)) % 2 == 0, 5.0, -5.0)
    at = np.arange(0.1, 3.9, 0.01)
    assert np.abs(resample(t, values, at) - np.sin(at)).max() < 1.1
    kept = (t < 1) | (t > 2)
    holes = resample(t[kept], values[kept], at)
    assert np.isnan(holes[(at > 1.01) & (at < 1.99)]).all() and np.isfinite(holes[(at < 0.99) | (at > 2.01)]).all()


def test_the_motion_comes_back(tmp_path: Path) -> None:
    recording = generated.record(noise=1e-5)
    file = generated.write_csv(tmp_path / "run.csv", generated.table(recording))
    import_trials(mapping_of(file), tmp_path / "out")
    found = columns_of(tmp_path / "out" / "run.csv")
    assert np.allclose(np.diff(found["t"]), 1 / 111, atol=2e-6)
    # the lever arm of 0.2 m swings sideways in the bend, and the body origin does not
    assert np.abs(found["vy"]).max() < 5e-3 and np.abs(found["vz"]).max() < 5e-3
    assert np.abs(found["vx"] - np.interp(found["t"], recording.t, recording.speed)).max() < 5e-3
    assert np.abs(found["depth"] - generated.DEPTH).max() < 1e-3
    assert np.abs(found["fz"].mean() - generated.LIFT) < 1
    assert (tmp_path / "out" / "run.csv").read_text().startswith("# generated, not measured\n")


def test_the_columns_are_those_of_wade_validate(wade: str, tmp_path: Path) -> None:
    """The other implementation of the paper's processing, on the same recordings."""
    command = [wade, "validate", "--vehicle", "warthog", "--generated", "3", "--out", str(tmp_path / "v")]
    subprocess.run(command, check=True, capture_output=True)
    described = tomllib.loads((tmp_path / "v" / "recordings" / "recordings.toml").read_text())
    # its velocity is that of the center of mass
    to_center = described["center_of_mass_from_marker_m"]
    to_origin = [a - b for a, b in zip(to_center, BODY.center_of_mass_m, strict=True)]
    names = list(described["recording"])[::7]
    stated = {name: described["recording"][name] for name in names}
    for arm, columns in (
        (to_center, ["t", "vx", "vy", "vz", "wx", "wy", "wz", "roll", "pitch", "yaw"]),
        (to_origin, ["depth"]),
    ):
        trials = {
            name: Trial(str(tmp_path / "v" / "recordings" / f"{name}.csv"), value["water_level_m"])
            for name, value in stated.items()
        }
        pose: Pose = replace(POSE, tracked_point_to_origin_m=(arm[0], arm[1], arm[2]))
        mapping = mapping_of(tmp_path / "none.csv", trials=trials, pose=pose, columns={})
        out = tmp_path / columns[0]
        import_trials(mapping, out)
        for name in names:
            ours, theirs = columns_of(out / f"{name}.csv"), columns_of(tmp_path / "v" / "trials" / f"{name}.csv")
            assert len(ours["t"]) == len(theirs["t"])
            for column in columns:
                start = theirs["t"][0] if column == "t" else 0.0
                assert np.abs(ours[column] - theirs[column] + start).max() < 2e-6, (name, column)


def test_blocks_leave_no_trace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A long recording is processed block by block."""
    columns = generated.table(generated.record(seconds=8))
    keep = (columns["t"] < 3.0) | (columns["t"] > 3.7)
    file = generated.write_csv(tmp_path / "run.csv", {name: values[keep] for name, values in columns.items()})
    import_trials(mapping_of(file), tmp_path / "whole")
    for size in (5, 100, 333):
        monkeypatch.setattr(motion, "BLOCK", size)
        import_trials(mapping_of(file), tmp_path / f"blocks{size}")
        assert (tmp_path / f"blocks{size}" / "run.csv").read_bytes() == (tmp_path / "whole" / "run.csv").read_bytes()


def test_every_preset_of_axes_gives_the_same_columns(tmp_path: Path) -> None:
    recording = generated.record(seconds=6)
    out = []
    for name, axes in PRESETS.items():
        for order in ("wxyz", "xyzw"):
            made = replace(recording, axes=axes, body_axes=axes, quaternion_order=order)
            file = generated.write_csv(tmp_path / "run.csv", generated.table(made))
            pose = replace(POSE, axes=axes, body_axes=axes, quaternion_order=order)
            folder = tmp_path / f"{name} {order}"
            import_trials(mapping_of(file, pose=pose), folder)
            out.append(columns_of(folder / "run.csv"))
    for other in out[1:]:
        assert all(np.abs(out[0][name] - other[name]).max() < 1e-5 for name in out[0])
