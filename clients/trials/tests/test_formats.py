"""Promise: a recording is the same trial in every format, by files that the kept libraries wrote."""

import re
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import generated
import numpy as np
import pytest
from helpers import columns_of

from wade_trials.axes import PRESETS
from wade_trials.cli import main

Y_UP = PRESETS["y up"]


def _npz(path: Path, recording: generated.Recording) -> Path:
    np.savez(path, **generated.table(recording))  # type: ignore[arg-type]
    return path


def _motive(path: Path, recording: generated.Recording) -> Path:
    return generated.write_motive(path, replace(recording, axes=Y_UP, body_axes=Y_UP), unit="Millimeters", scale=1e3)


FORMATS: dict[str, Callable[[Path, generated.Recording], Path]] = {
    "run.csv": lambda path, recording: generated.write_csv(path, generated.table(recording)),
    "run.npz": _npz,
    "take.csv": _motive,
    "run.bag": generated.write_ros1,
    "run": generated.write_ros2,
    "run.mcap": generated.write_mcap,
    "json.mcap": lambda path, recording: generated.write_mcap(path, recording, "json"),
    "run.mf4": generated.write_mdf,
}
ARGUMENTS = ["--vehicle", "warthog", "--water-level", "1.7", "--depth", "0.2", "--point-to-origin=0.2,0,-0.572"]


@pytest.mark.parametrize("name", FORMATS)
def test_a_format_is_mapped_imported_and_repeated(
    name: str, wade: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = generated.record(seconds=8, noise=3e-5)
    file = FORMATS[name](tmp_path / name, recording)
    assert main(["inspect", str(file)]) == 0
    mapping, out = tmp_path / "mapping.toml", tmp_path / "out"
    assert main(["map", str(file), *ARGUMENTS, "--out", str(mapping)]) == 0
    shown = capsys.readouterr().out
    assert re.search(r"vx vy vz, depth +m", shown) or "mm" in shown
    assert "guess 1: " in shown and "guesses to confirm" in shown
    assert main(["check", str(mapping)]) == 0 and not out.exists()
    assert main(["import", str(mapping), "--out", str(out)]) == 0
    trial = next(out.glob("*.csv"))
    found = columns_of(trial)
    speed = np.interp(found["t"], recording.t, recording.speed)
    assert np.abs(found["vx"] - speed).max() < 0.012 and np.abs(found["depth"] - generated.DEPTH).max() < 2e-3
    if name != "take.csv":
        assert abs(found["fz"].mean() - generated.LIFT) < 2 and abs(found["fx"].min() + 60 * 1.2**2) < 12
    # the mapping beside the trials repeats them
    written = tomllib.loads((out / "mapping.toml").read_text())
    assert written["guesses"] and all(len(trial["sha256"]) == 64 for trial in written["trials"].values())
    again = tmp_path / "again"
    assert main(["import", str(out / "mapping.toml"), "--out", str(again)]) == 0
    assert trial.read_bytes() == (again / trial.name).read_bytes()
    assert (out / "trials.toml").read_bytes() == (again / "trials.toml").read_bytes()


def test_the_stamp_of_the_header_is_the_clock_and_receipt_is_not(wade: str, tmp_path: Path) -> None:
    """The header's stamps are exact; receipt is up to 3 ms uneven."""
    recording = generated.record(seconds=6, noise=3e-5)
    mapping = tmp_path / "mapping.toml"
    assert main(["map", str(generated.write_ros2(tmp_path / "run", recording)), *ARGUMENTS, "--out", str(mapping)]) == 0
    assert main(["import", str(mapping), "--out", str(tmp_path / "out")]) == 0
    found = columns_of(tmp_path / "out" / "run.csv")
    assert np.abs(found["vx"] - np.interp(found["t"], recording.t, recording.speed)).max() < 0.012


def test_frames_in_which_tracking_was_lost_are_a_hole(wade: str, tmp_path: Path) -> None:
    recording = replace(generated.record(seconds=8), axes=Y_UP, body_axes=Y_UP)
    file = generated.write_motive(tmp_path / "take.csv", recording, lost=slice(400, 520))
    mapping = tmp_path / "mapping.toml"
    assert main(["map", str(file), *ARGUMENTS, "--body", "Warthog", "--out", str(mapping)]) == 0
    assert main(["import", str(mapping), "--out", str(tmp_path / "out")]) == 0
    t = columns_of(tmp_path / "out" / "take.csv")["t"]
    assert np.diff(t).max() == pytest.approx(1.0, abs=0.03)


def test_an_axis_that_the_header_states_is_no_guess(tmp_path: Path) -> None:
    from wade_trials.readers import open_source

    file = generated.write_motive(tmp_path / "take.csv", generated.record(seconds=4))
    file.write_text(
        file.read_text().replace("Coordinate Space,Global", "Coordinate Space,Global,Axis Convention,Z up", 1)
    )
    conventions = open_source(file).conventions
    assert conventions.stated["pose.axes"][0] == "z up" and not conventions.guessed
    assert conventions.stated["pose.position_unit"][0] == "m"


def test_both_readers_of_mcap_agree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from wade_trials.readers.mcap_file import McapSource

    source = McapSource(generated.write_mcap(tmp_path / "run.mcap", generated.record(seconds=5)))
    names = [channel.name for channel in source.channels()]
    assert len(names) == 23
    fast = source.read(names, lambda share: None)
    monkeypatch.setattr(McapSource, "_is_ros2", lambda self, topics: False)
    slow = source.read(names, lambda share: None)
    for name in names:
        assert np.array_equal(fast[name].t, slow[name].t) and np.array_equal(fast[name].values, slow[name].values)


HEADERS = {
    "labels, a column with the time of day, and markers behind": (
        """Format Version,1.25,Take Name,x,Rotation Type,Quaternion,Length Units,Millimeters,Coordinate Space,Global

,Type,,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Marker
,Name,,"Hog, front","Hog, front","Hog, front","Hog, front","Hog, front","Hog, front","Hog, front","Hog, front",m
,ID,,A,A,A,A,A,A,A,A,B
,Parent,,,,,,,,,,
,,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker Error,Position
Frame,Time (Seconds),TimeCode,X,Y,Z,W,X,Y,Z,,X
0,0.000000,15:26:46:12.02,0,0,0,1,10,20,30,0.1,5
1,0.008333,15:26:46:12.03,0,0,0,1,11,20,30,0.1,
""",
        "Hog, front",
        "mm",
        [10.0, 11.0],
    ),
    "no labels": (
        """Format Version,1.2,Take Name,x,Rotation Type,Quaternion,Length Units,Meters
,,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body
,,Hog,Hog,Hog,Hog,Hog,Hog,Hog
,,1,1,1,1,1,1,1
,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position
Frame,Time,X,Y,Z,W,X,Y,Z
0,0.0,0,0,0,1,1.5,2,3
1,0.1,0,0,0,1,1.6,2,3
""",
        "Hog",
        "m",
        [1.5, 1.6],
    ),
}


@pytest.mark.parametrize("kind", HEADERS)
def test_the_headers_of_motive_s_versions(kind: str, tmp_path: Path) -> None:
    from wade_trials.readers import open_source

    text, body, unit, values = HEADERS[kind]
    file = tmp_path / "take.csv"
    file.write_text(text)
    source = open_source(file)
    assert {channel.name for channel in source.channels()} == {
        f"{body}.{part}" for part in ("position.x", "position.y", "position.z", *(f"rotation.{c}" for c in "xyzw"))
    }
    assert source.conventions.stated["pose.position_unit"][0] == unit
    found = source.read([f"{body}.position.x"], lambda share: None)[f"{body}.position.x"]
    assert found.values.tolist() == values and found.t[0] == 0.0
