"""Motive's CSV export (OptiTrack): a line of settings, four or five lines of names, then one row a frame.

The settings state the unit of length and the kind of rotation. The export can turn the axes, and the file does not
state how: y up is the default of the program, so the axes are a guess unless the settings name them.
"""

import csv
from collections.abc import Sequence
from pathlib import Path

from ..errors import TrialsError
from ..source import Channel, Conventions, Progress, Series
from ..units import canonical_unit
from .table import Layout, read_numbers, without_origin

#: Lines in which the names must end.
MOST_HEADER_LINES = 12


def is_motive(path: Path) -> bool:
    """True where the first line is that of Motive's export."""
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        return file.readline().lstrip('"').startswith("Format Version")


class MotiveSource:
    """An export of Motive with rigid bodies."""

    format = "Motive CSV"

    def __init__(self, path: Path) -> None:
        self.path, self.conventions = path, Conventions()
        with path.open(encoding="utf-8-sig", errors="replace") as file:
            lines = [line for _, line in zip(range(MOST_HEADER_LINES), file, strict=False)]
        rows = list(csv.reader(lines))
        cells = rows[0]
        self.settings = {key.strip(): value.strip() for key, value in zip(cells[::2], cells[1::2], strict=False)}
        last = next((at for at, row in enumerate(rows) if row and row[0].strip() == "Frame"), None)
        if last is None:
            raise TrialsError(path, "", 'no line starts with "Frame": export with the header on')
        self.lines_before = last + 1
        self._name_columns(rows[1:last], rows[last])
        self._state_conventions()

    def _name_columns(self, above: list[list[str]], axes: list[str]) -> None:
        """A column is named ``Body.position.x``; markers, errors and times of day are left out."""
        labels = {"type": [], "name": []}  # type: dict[str, list[str]]
        kinds: list[str] = []
        for row in above:
            words = [cell.strip() for cell in row]
            label = next((word.lower() for word in words[:2] if word), "")
            if label in labels:
                labels[label] = words
            elif not label and any(word in ("Position", "Rotation") for word in words):
                kinds = words
        # earlier versions of the format have no labels: type, name, ID, kind in this order
        unlabeled = [row for row in above if any(cell.strip() for cell in row)]
        if not labels["name"] and len(unlabeled) >= 3:
            labels["type"], labels["name"] = ([c.strip() for c in row] for row in unlabeled[:2])
        self.columns: dict[str, int] = {}
        self.time = next((at for at, name in enumerate(axes) if name.strip().startswith("Time (")), 1)
        for at, axis in enumerate(axes):
            cell = [row[at] if at < len(row) else "" for row in (labels["type"], labels["name"], kinds)]
            if cell[0] == "Rigid Body" and cell[2] in ("Position", "Rotation") and axis.strip():
                self.columns[f"{cell[1]}.{cell[2].lower()}.{axis.strip().lower()}"] = at
        if not self.columns:
            raise TrialsError(self.path, "", "there is no rigid body in it: export with Rigid Bodies on")

    def _state_conventions(self) -> None:
        stated, guessed = self.conventions.stated, self.conventions.guessed
        length = self.settings.get("Length Units", "")
        unit = canonical_unit("length", length) if length else None
        if unit:
            stated["pose.position_unit"] = (unit, f"Length Units is {length} in the header")
        rotation = self.settings.get("Rotation Type", "Quaternion")
        if rotation != "Quaternion":
            raise TrialsError(
                self.path, "Rotation Type", f"rotations are Euler angles ({rotation}): export with Quaternion"
            )
        axis = next((value for key, value in self.settings.items() if "axis" in key.lower()), "")
        if "z" in axis.lower() and "up" in axis.lower():
            stated["pose.axes"] = ("z up", f"the header states {axis}")
        elif "y" in axis.lower() and "up" in axis.lower():
            stated["pose.axes"] = ("y up", f"the header states {axis}")
        else:
            guessed["pose.axes"] = ("y up", "the header does not state it; y up is the default of the export")

    def channels(self) -> list[Channel]:
        unit = str(self.conventions.stated.get("pose.position_unit", ("", ""))[0])
        return [Channel(name, unit if ".position." in name else "1") for name in self.columns]

    def read(self, names: Sequence[str], progress: Progress) -> dict[str, Series]:
        at = [self.time, *(self.columns[name] for name in names)]
        table = read_numbers(Layout(self.path, self.lines_before, ",", at, ["Time", *names]), progress)
        t = without_origin(self.path, "Time", table[0], 1.0)
        return {name: Series(t, values) for name, values in zip(names, table[1:], strict=True)}
