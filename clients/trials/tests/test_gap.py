"""Promise: ``wade gap`` and ``wade validate`` read what was written, and a planted load comes back from it."""

import json
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import generated
import numpy as np
import pytest
from helpers import Array, columns_of, mapping_of

from wade_trials import import_trials
from wade_trials.mapping import Column, Trial
from wade_trials.source import Clock

#: The generated trials of the guide.
WADING = Path(__file__).resolve().parents[3] / "tests" / "data" / "wading"
#: A load that acts in the recordings and that no model contains [N s/m].
PLANTED = 40.0


def _predicted(wade: str, tmp_path: Path, recording: generated.Recording) -> tuple[Array, Array]:
    """What the model predicts along a recording: fx and fz."""
    states, out = tmp_path / "states.csv", tmp_path / "forces.csv"
    zero = np.zeros_like(recording.t)
    columns = {"t": recording.t, "vx": recording.speed, "vy": zero, "vz": zero, "wx": zero, "wy": zero, "wz": zero}
    generated.write_csv(states, columns | {"depth": zero + generated.DEPTH})
    command = [wade, "predict", "--vehicle", "warthog", "--states", str(states), "--out", str(out)]
    subprocess.run(command, check=True, capture_output=True, text=True)
    with out.open() as file:
        names = file.readline().strip().split(",")
        rows = [line.strip().split(",") for line in file]
    at = [names.index("fx"), names.index("fz")]
    table = np.array([[float(row[i]) for i in at] for row in rows])
    return table[:, 0], table[:, 1]


def test_wade_gap_finds_a_planted_load_in_a_folder_from_cameras_and_a_cell(wade: str, tmp_path: Path) -> None:
    trials = {}
    random = np.random.default_rng(4)
    for run in range(6):
        recording = generated.record(seconds=16, heading=0.5 * run, turn=0.0, seed=run, noise=5e-5)
        # the same way at another speed
        scale = 0.25 + 0.1 * run
        recording.speed = recording.speed * scale
        recording.position = recording.position[0] + (recording.position - recording.position[0]) * scale
        fx, fz = _predicted(wade, tmp_path, recording)
        noise = random.normal(scale=2.0, size=(2, len(fx)))
        recording.force[:, 0] = fx - PLANTED * recording.speed + noise[0]
        recording.force[:, 2] = fz + noise[1]
        file = generated.write_csv(tmp_path / f"generated-{run}.csv", generated.table(recording))
        trials[file.stem] = Trial(file.name, generated.WATER_LEVEL, generated.DEPTH)
    mapping = mapping_of(tmp_path / "x.csv", trials=trials, columns={"fx": Column("fx", "N"), "fz": Column("fz", "N")})
    mapping = replace(mapping, manifest={"channel_width": 6.0, "sensor_noise": {"fx": 2.0, "fz": 2.0}})
    import_trials(mapping, tmp_path / "trials")
    report, said = _gap(wade, "warthog", tmp_path)
    # the gap is the planted load and nothing that the import added
    speed = np.concatenate([columns_of(path)["vx"] for path in (tmp_path / "trials").glob("*.csv")])
    before = report["gap"]["held_out"]["fx"]["before"]
    assert before == pytest.approx(PLANTED * np.sqrt(np.mean(speed**2)), rel=0.1)
    assert report["gap"]["held_out"]["fz"]["before"] < 3.0
    assert not any(remark in said for remark in ("not used", "stands alone", "a gap of")), said


def test_trials_that_were_exported_in_other_units_are_the_same_trials(wade: str, tmp_path: Path) -> None:
    """The generated trials of the guide, as a logger would export them: the current in them is found again."""
    names = ("t", "vx", "vy", "vz", "wx", "wy", "wz", "yaw", "depth", "fx")
    trials = {}
    for source in sorted(WADING.glob("*.csv")):
        columns = dict(zip(names, columns_of(source).values(), strict=True))
        exported = {
            "time": columns["t"] * 1e3,
            "speed": columns["vx"] * 3.6,
            "heading": np.degrees(columns["yaw"]),
            "gauge": columns["depth"] * 1e3,
            "cell": -columns["fx"] / 1e3,
        }
        generated.write_csv(tmp_path / source.name, exported)
        trials[source.stem] = Trial(source.name)
    zero = {name: Column(constant=0.0) for name in ("vy", "vz", "wx", "wy", "wz")}
    used = {
        "vx": Column("speed", "km/h"),
        "yaw": Column("heading", "deg"),
        "depth": Column("gauge", "mm"),
        "fx": Column("cell", "kN", -1.0),
    }
    mapping = mapping_of(tmp_path / "x.csv", trials=trials, pose=None, columns=zero | used)
    manifest = {"measured": {"columns": ["fx"], "method": "load_cell"}, "sensor_noise": {"fx": 1.5}}
    mapping = replace(mapping, vehicle="husky", body=None, clock=Clock("time", "ms"), manifest=manifest)
    import_trials(mapping, tmp_path / "trials")
    for source in sorted(WADING.glob("*.csv")):
        theirs, ours = columns_of(source), columns_of(tmp_path / "trials" / source.name)
        assert all(np.abs(theirs[name] - ours[name]).max() < 2e-5 for name in ("t", "vx", "yaw", "depth", "fx"))
    report, _ = _gap(wade, "husky", tmp_path)
    assert report["verdict"] == "named" and [effect["name"] for effect in report["effects"]] == ["current"]
    assert abs(report["effects"][0]["parameters"]["east"]["value"] - 0.26) < 0.05, report["effects"]


def _gap(wade: str, vehicle: str, folder: Path) -> tuple[Any, str]:
    """The report of ``wade gap``, and what it said."""
    command = [wade, "gap", "--vehicle", vehicle, "--trials", str(folder / "trials"), "--out", str(folder / "gap")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads((folder / "gap" / "report.json").read_text()), done.stdout + done.stderr


def test_wade_validate_reads_a_folder_without_forces(wade: str, tmp_path: Path) -> None:
    file = generated.write_csv(tmp_path / "generated.csv", generated.table(generated.record()))
    import_trials(mapping_of(file, columns={}), tmp_path / "trials")
    command = [wade, "validate", "--vehicle", "warthog", "--trials", str(tmp_path / "trials"), "--json"]
    done = subprocess.run([*command, "--out", str(tmp_path / "v")], capture_output=True, text=True)
    # one trial is too little to judge, and enough to be read
    assert "generated.csv" not in done.stderr and "trials.toml" not in done.stderr, done.stderr
