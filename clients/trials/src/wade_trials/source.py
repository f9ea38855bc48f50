"""A recording as named channels, whatever its format."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .errors import TrialsError

Array = NDArray[np.float64]

#: Called with the share that was read, 0 to 1.
Progress = Callable[[float], None]

#: Samples of one channel above which a file is refused: eight bytes each, for every channel that is read.
MOST_SAMPLES = 20_000_000


@dataclass(frozen=True)
class Channel:
    """One quantity of a recording."""

    name: str
    #: As the file states it; empty where it does not.
    unit: str = ""
    #: Number of samples; ``None`` where counting would mean reading.
    samples: int | None = None


@dataclass(frozen=True)
class Series:
    """The samples of a channel, in the unit of the file."""

    #: Time [s] from the start of the recording.
    t: Array
    values: Array


@dataclass
class Conventions:
    """What the file itself states or what its maker's default is: fields of a mapping with value and reason."""

    stated: dict[str, tuple[object, str]] = field(default_factory=dict)
    guessed: dict[str, tuple[object, str]] = field(default_factory=dict)


class Source(Protocol):
    """A file, or a folder, of channels."""

    path: Path
    #: Name of the format, for people.
    format: str
    conventions: Conventions

    def channels(self) -> list[Channel]:
        """All channels of numbers."""

    def read(self, names: Sequence[str], progress: Progress) -> dict[str, Series]:
        """The samples of some channels. Channels that were sampled together share their array of time."""


@dataclass(frozen=True)
class Clock:
    """The column of time, for formats that have no clock of their own."""

    channel: str = ""
    unit: str = ""
    #: Frames a second, where the column counts frames; 0 where it states time [1/s].
    rate_hz: float = 0.0


#: Where the recording has a clock of its own, or a column with a usual name.
NO_CLOCK = Clock()


def check_count(path: Path, count: int) -> None:
    """Refuses a recording that does not fit into memory."""
    if count > MOST_SAMPLES:
        raise TrialsError(
            path,
            "",
            f"a channel has more than {MOST_SAMPLES:,} samples: split the recording into one file a trial",
        )


def unknown_channel(path: Path, field_name: str, name: str, channels: Sequence[Channel]) -> TrialsError:
    """The error of a mapping that names a channel that is not there, with those that are nearest."""
    import difflib

    names = [channel.name for channel in channels]
    near = difflib.get_close_matches(name, names, n=3, cutoff=0.5)
    hint = f"did you mean {' or '.join(near)}?" if near else f"there are: {', '.join(names[:12])}"
    return TrialsError(path, field_name, f'there is no channel "{name}"; {hint} (list all with: wade-trials inspect)')
