"""Promise: an error names the file, the field and the way out, and nothing is half written."""

from dataclasses import replace
from pathlib import Path

import generated
import numpy as np
import pytest
from helpers import FORCES, POSE, mapping_of

from wade_trials import Mapping, TrialsError, import_trials
from wade_trials.cli import main
from wade_trials.mapping import Trial
from wade_trials.readers import open_source
from wade_trials.write import mapping_text


def _written(tmp_path: Path) -> tuple[Path, Path]:
    """A recording and its mapping on disk."""
    file = generated.write_csv(tmp_path / "run.csv", generated.table(generated.record(seconds=6)))
    path = tmp_path / "mapping.toml"
    path.write_text(mapping_text(mapping_of(file), tmp_path))
    return file, path


def test_a_mapping_comes_back_as_it_was_written(tmp_path: Path) -> None:
    file, path = _written(tmp_path)
    back = Mapping.read(path)
    assert replace(back, trials={}) == replace(mapping_of(file), trials={}, path=path)
    assert back.trials["run"].file == "run.csv" and back.trials["run"].depth_m == generated.DEPTH


def test_the_mapping_of_the_readme_is_one(tmp_path: Path) -> None:
    text = (Path(__file__).parents[1] / "README.md").read_text()
    block = text.split("```toml\n", 1)[1].split("```", 1)[0]
    (tmp_path / "mapping.toml").write_text(block)
    mapping = Mapping.read(tmp_path / "mapping.toml")
    assert mapping.pose and mapping.wrench and mapping.columns and mapping.manifest
    # and it comes back from what would be written beside the trials
    (tmp_path / "again.toml").write_text(mapping_text(mapping, tmp_path))
    again = Mapping.read(tmp_path / "again.toml")
    assert replace(again, path=mapping.path) == mapping


FAULTS = {
    'vehicle = "warthog"': ("", ["vehicle", "it is missing"]),
    "format = 1": ("format = 2", ["format", "must be 1"]),
    'axes = "z up"': ('axes = "up"', ["pose.axes", '"z up", "y up", "NED"']),
    'body_axes = "z up"': ('body_axes = ["x", "-y", "z"]', ["pose.axes", "left-handed"]),
    'quaternion_order = "wxyz"': ('quaternion_order = "wzyx"', ["pose.quaternion_order", "xyzw"]),
    'position_unit = "m"': ('position_unit = "yard"', ["pose.position_unit", "mm"]),
    "tracked_point_to_origin_m = ": ("origin_m = ", ["pose.origin_m", "there is no such field", "tracked_point"]),
    "water_level_m = 1.7": ("", ["trials.run.water_level_m", "altitude of the still water"]),
    "depth_m = 0.2": ("depth_m = -0.2", ["trials.run.depth_m", "must be between"]),
    'file = "run.csv"': ('file = "no.csv"', ["no.csv", "there is no such file"]),
    '"qw"': ('"quw"', ["run.csv", "pose.quaternion", 'no channel "quw"', "did you mean"]),
    "window = 9": ("window = 8", ["processing.window", "odd"]),
    "order = 2": ("order = 9", ["processing.order", "less than the window"]),
    "[columns]": ('[columns]\nvx = "x"', ["columns.vx", "the pose gives this column, too"]),
    "ground_contact_z_m = -0.413": ("", ["body.ground_contact_z_m", "it is missing"]),
    "fluid_density_kgpm3 = 1000.0": ("fluid_density_kgpm3 = 1.0", ["fluid_density_kgpm3", "500"]),
    "[processing]": ("processing", ["it is not TOML"]),
}


@pytest.mark.parametrize("text", FAULTS)
def test_a_fault_in_a_mapping(text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _, path = _written(tmp_path)
    good, (instead, words) = path.read_text(), FAULTS[text]
    assert text in good
    path.write_text(good.replace(text, instead, 1))
    before = sorted(p.name for p in tmp_path.iterdir())
    assert main(["import", str(path), "--out", str(tmp_path / "out")]) == 1
    error = capsys.readouterr().err
    assert error.startswith("error: ") and all(word in error for word in [*words, str(tmp_path)]), error
    assert sorted(p.name for p in tmp_path.iterdir()) == before


CELLS = {
    "a word": ("nan.0x", ["row 101, column fz", "is no number", "leave it empty"]),
    "a short row": (None, ["row 101", "it has 3 cells"]),
}


@pytest.mark.parametrize("case", CELLS)
def test_a_bad_cell_is_named_by_row_and_column(case: str, tmp_path: Path) -> None:
    file, path = _written(tmp_path)
    cell, words = CELLS[case]
    lines = file.read_text().splitlines()
    cells = lines[100].split(",")
    lines[100] = ",".join(cells[:3] if cell is None else [*cells[:-1], cell])
    file.write_text("\n".join(lines))
    with pytest.raises(TrialsError) as raised:
        import_trials(Mapping.read(path), tmp_path / "out")
    assert all(word in str(raised.value) for word in [*words, str(file)]), raised.value


def test_an_empty_cell_was_not_measured(tmp_path: Path) -> None:
    """A lone frame without a pose, and a force that came late, are no fault."""
    file, path = _written(tmp_path)
    lines = file.read_text().splitlines()
    lines[100] = ",".join([*lines[100].split(",")[:1], *([""] * 10)])
    lines[1] = lines[1].rsplit(",", 1)[0] + ","
    file.write_text("\r\n".join(lines))
    assert import_trials(Mapping.read(path), tmp_path / "out").rows["run"] > 500


def test_semicolons_with_decimal_commas_and_quotes(tmp_path: Path) -> None:
    file, path = _written(tmp_path)
    import_trials(Mapping.read(path), tmp_path / "points")
    head, *rows = file.read_text().splitlines()
    cells = [[f'"{cell}"'.replace(".", ",") for cell in row.split(",")] for row in rows]
    file.write_text("\n".join([head.replace(",", ";"), *(";".join(row) for row in cells)]), encoding="utf-8-sig")
    import_trials(Mapping.read(path), tmp_path / "commas")
    assert (tmp_path / "commas" / "run.csv").read_bytes() == (tmp_path / "points" / "run.csv").read_bytes()


def test_time_that_goes_back(tmp_path: Path) -> None:
    file, path = _written(tmp_path)
    lines = file.read_text().splitlines()
    lines[100], lines[200] = lines[200], lines[100]
    file.write_text("\n".join(lines))
    with pytest.raises(TrialsError, match=r"time goes back from .* sort the recording"):
        import_trials(Mapping.read(path), tmp_path / "out")


def test_angles_in_place_of_a_quaternion(tmp_path: Path) -> None:
    columns = generated.table(generated.record(seconds=6))
    columns["qx"] = columns["qx"] + 0.5
    file = generated.write_csv(tmp_path / "run.csv", columns)
    with pytest.raises(TrialsError, match=r"pose.quaternion: at 0.000 s its length is 1.1"):
        import_trials(mapping_of(file), tmp_path / "out")


def test_a_refused_import_leaves_nothing_and_the_first_trial_neither(tmp_path: Path) -> None:
    file, _ = _written(tmp_path)
    trials = {
        "right": Trial(str(file), generated.WATER_LEVEL, generated.DEPTH),
        "wrong": Trial(str(file), generated.WATER_LEVEL + 1, generated.DEPTH),
    }
    before = sorted(p.name for p in tmp_path.iterdir())
    with pytest.raises(TrialsError, match=r"nothing was written, since 1 of the checks failed"):
        import_trials(mapping_of(file, trials=trials), tmp_path / "out")
    assert sorted(p.name for p in tmp_path.iterdir()) == before


def test_a_folder_that_is_there_is_left_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _, path = _written(tmp_path)
    out = tmp_path / "out"
    out.mkdir()
    (out / "mine.txt").write_text("mine")
    assert main(["import", str(path), "--out", str(out)]) == 1
    assert "remove it or name another folder" in capsys.readouterr().err
    assert [p.name for p in out.iterdir()] == ["mine.txt"]
    assert main(["map", str(tmp_path / "run.csv"), "--vehicle", "warthog", "--out", str(path)]) == 1
    assert "it is there already" in capsys.readouterr().err


def test_a_recording_that_changed_is_not_the_one_of_the_mapping(tmp_path: Path) -> None:
    file, path = _written(tmp_path)
    import_trials(Mapping.read(path), tmp_path / "out")
    file.write_text(file.read_text() + "\n")
    with pytest.raises(TrialsError, match=r"trials.run.sha256: the file is not the one"):
        import_trials(Mapping.read(tmp_path / "out" / "mapping.toml"), tmp_path / "again")


DAMAGED = {
    "run.bag": "rosbags cannot read it",
    "run.db3": "rosbags cannot read it",
    "run.mcap": "mcap cannot read it",
    "run.mf4": "asammdf cannot read it",
    "run.npz": "numpy cannot read it",
    "run.csv": "the file is empty",
    "run.c3d": "is of no known format",
}


@pytest.mark.parametrize("name", DAMAGED)
def test_a_file_that_is_none(name: str, tmp_path: Path) -> None:
    file = tmp_path / name
    file.write_bytes(b"" if name == "run.csv" else b"no such format at all" * 50)
    with pytest.raises(TrialsError) as raised:
        open_source(file).channels()
    assert DAMAGED[name] in str(raised.value) and str(file) in str(raised.value)


@pytest.mark.parametrize("share", [0.3, 0.9])
def test_a_file_that_was_cut_off(share: float, tmp_path: Path) -> None:
    whole = generated.write_mcap(tmp_path / "whole.mcap", generated.record(seconds=5)).read_bytes()
    file = tmp_path / "cut.mcap"
    file.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(TrialsError, match=r"cut.mcap"):
        source = open_source(file)
        source.read([channel.name for channel in source.channels()], lambda share: None)


def test_no_rigid_body_and_euler_angles_in_motive(tmp_path: Path) -> None:
    file = generated.write_motive(tmp_path / "take.csv", generated.record(seconds=4))
    text = file.read_text()
    file.write_text(text.replace("Rotation Type,Quaternion", "Rotation Type,XYZ"))
    with pytest.raises(TrialsError, match=r"Euler angles .*export with Quaternion"):
        open_source(file)
    file.write_text(text.replace("Rigid Body", "Marker"))
    with pytest.raises(TrialsError, match=r"export with Rigid Bodies on"):
        open_source(file)


def test_channels_without_a_common_span(tmp_path: Path) -> None:
    columns = generated.table(generated.record(seconds=6))
    columns["fz"] = np.where(columns["t"] < 0, 0.0, np.nan)
    file = generated.write_csv(tmp_path / "run.csv", columns)
    with pytest.raises(TrialsError, match=r"fz: it has 0 samples in the window"):
        import_trials(mapping_of(file, pose=POSE, columns=FORCES), None)
