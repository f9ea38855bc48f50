"""CSV: a header of names, a column of time, one row a sample."""

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import TrialsError
from ..source import NO_CLOCK, Channel, Clock, Conventions, Progress, Series, check_count, unknown_channel
from ..units import UNITS, canonical_unit

Array = NDArray[np.float64]

#: Rows that are parsed at once.
CHUNK = 50_000
#: Names of a column of time, in lower case, without unit.
TIME_NAMES = ("t", "time", "timestamp", "stamp", "time_s", "seconds")
_UNIT = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]\s*$")


def name_and_unit(header: str) -> tuple[str, str]:
    """``fx [kN]`` or ``fx (kN)`` as name and unit."""
    found = _UNIT.match(header.strip())
    return (found["name"].strip(), found["unit"].strip()) if found else (header.strip(), "")


def time_column(path: Path, names: Sequence[str], units: Sequence[str], clock: Clock) -> tuple[str, float]:
    """The column of time and the factor to seconds."""
    name = clock.channel
    if name and name not in names:
        raise unknown_channel(path, "time.channel", name, [Channel(name) for name in names])
    if not name:
        candidates = [n for n in names if n.lower() in TIME_NAMES]
        candidates += [n for n in names if re.fullmatch(r"(t|time|timestamp|stamp)_(s|ms|us|ns)", n.lower())]
        if not candidates:
            raise TrialsError(
                path,
                "time.channel",
                f"no column is named t, time or timestamp: write time.channel = NAME; there are: {', '.join(names)}",
            )
        name = candidates[0]
    if clock.rate_hz:
        return name, 1 / clock.rate_hz
    text = clock.unit or units[list(names).index(name)]
    if not text:
        end = name.lower().rsplit("_", 1)[-1]
        text = end if end in UNITS["time"] and "_" in name else "s"
    unit = canonical_unit("time", text)
    if unit is None:
        raise TrialsError(path, "time.unit", f'"{text}" is no unit of time: s, ms, us or ns')
    return name, UNITS["time"][unit]


def without_origin(path: Path, name: str, t: Array, factor: float) -> Array:
    """Time from the first stamp [s]; NaN stays."""
    finite = t[np.isfinite(t)]
    if not len(finite):
        raise TrialsError(path, name, "the column of time has no number")
    return np.asarray((t - finite[0]) * factor)


class TableSource:
    """A CSV file."""

    format = "CSV"

    def __init__(self, path: Path, clock: Clock = NO_CLOCK) -> None:
        self.path, self.conventions = path, Conventions()
        self.lines_before, header, self.delimiter = self._header()
        pairs = [name_and_unit(cell) for cell in header]
        self.names, self.units = [name for name, _ in pairs], [unit for _, unit in pairs]
        twice = next((name for at, name in enumerate(self.names) if name in self.names[:at]), None)
        if twice is not None:
            raise TrialsError(path, twice, "two columns have this name: rename one of them")
        self.time, self.factor = time_column(path, self.names, self.units, clock)

    def _header(self) -> tuple[int, list[str], str]:
        with self.path.open(encoding="utf-8-sig", errors="replace") as file:
            for number, line in enumerate(file):
                if line.strip() and not line.startswith("#"):
                    delimiter = max(",;\t", key=line.count)
                    cells = next(csv.reader([line], delimiter=delimiter))
                    if all(_is_number(cell) for cell in cells):
                        raise TrialsError(self.path, "", "the first line holds numbers: add a header with the names")
                    return number + 1, cells, delimiter
        raise TrialsError(self.path, "", "the file is empty: its first line names the columns")

    def channels(self) -> list[Channel]:
        pairs = zip(self.names, self.units, strict=True)
        return [Channel(name, unit) for name, unit in pairs if name and name != self.time]

    def read(self, names: Sequence[str], progress: Progress) -> dict[str, Series]:
        wanted = [self.time, *names]
        columns = [self.names.index(name) for name in wanted]
        table = read_numbers(Layout(self.path, self.lines_before, self.delimiter, columns, wanted), progress)
        t = without_origin(self.path, self.time, table[0], self.factor)
        return {name: Series(t, values) for name, values in zip(names, table[1:], strict=True)}


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


@dataclass(frozen=True)
class Layout:
    """Where the wanted columns of a text file stand."""

    path: Path
    #: Lines above the numbers.
    skip: int
    delimiter: str
    columns: Sequence[int]
    names: Sequence[str]


def read_numbers(layout: Layout, progress: Progress) -> list[Array]:
    """Some columns of numbers; an empty cell is NaN. A chunk of the file is held at a time, and the numbers."""
    path = layout.path
    size = max(path.stat().st_size, 1)
    parts: list[Array] = []
    count, first_row, done = 0, layout.skip + 1, 0
    with path.open(encoding="utf-8-sig", errors="replace", newline=None) as file:
        for _ in range(layout.skip):
            done += len(file.readline())
        while lines := list(islice(file, CHUNK)):
            done += sum(map(len, lines))
            rows = [line for line in lines if line.strip() and not line.startswith("#")]
            if rows:
                parts.append(_parsed(layout, lines, rows, first_row))
                count += len(rows)
                check_count(path, count)
            first_row += len(lines)
            progress(min(done / size, 1.0))
    if not parts:
        raise TrialsError(path, "", "there is no row of numbers below the header")
    return [np.concatenate([part[:, at] for part in parts]) for at in range(len(layout.columns))]


def _with_points(text: str, delimiter: str) -> str:
    """Decimal commas as points, where commas do not separate cells."""
    return text if delimiter == "," else text.replace(",", ".")


def _parsed(layout: Layout, lines: list[str], rows: list[str], first_row: int) -> Array:
    text, delimiter = _with_points("".join(rows), layout.delimiter), layout.delimiter
    pair = delimiter * 2
    if pair in text or delimiter + "\n" in text or text.startswith(delimiter) or "\n" + delimiter in text:
        gap = f"{delimiter}nan{delimiter}"
        text = text.replace(pair, gap).replace(pair, gap)
        text = text.replace(delimiter + "\n", delimiter + "nan\n").replace("\n" + delimiter, "\nnan" + delimiter)
        text = "nan" + text if text.startswith(delimiter) else text
    text = text + "nan" if text.endswith(delimiter) else text
    try:
        return np.loadtxt(
            io.StringIO(text), delimiter=delimiter, usecols=list(layout.columns), ndmin=2, comments=None, quotechar='"'
        )
    except (ValueError, IndexError):
        raise _bad_cell(layout, lines, first_row) from None


def _bad_cell(layout: Layout, lines: list[str], first_row: int) -> TrialsError:
    path = layout.path
    for number, line in enumerate(lines):
        if not line.strip() or line.startswith("#"):
            continue
        cells = next(csv.reader([line], delimiter=layout.delimiter))
        for column, name in zip(layout.columns, layout.names, strict=True):
            row = f"row {first_row + number}"
            if column >= len(cells):
                return TrialsError(path, row, f"it has {len(cells)} cells, so column {name} is missing")
            if cells[column].strip() and not _is_number(_with_points(cells[column], layout.delimiter)):
                message = "is no number: correct the cell, or leave it empty where nothing was measured"
                return TrialsError(path, f"{row}, column {name}", f'"{cells[column].strip()}" {message}')
    return TrialsError(path, f"rows {first_row} to {first_row + len(lines) - 1}", "they are no table of numbers")
