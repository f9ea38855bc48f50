"""MDF and MF4 files, by asammdf."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..errors import TrialsError
from ..source import Channel, Conventions, Progress, Series, check_count
from . import missing_extra


class MdfSource:
    """A measurement file; a name that several groups have is written ``NAME@GROUP``."""

    format = "MDF"

    def __init__(self, path: Path) -> None:
        self.path, self.conventions = path, Conventions()
        try:
            from asammdf import MDF
        except ImportError:
            raise missing_extra(path, "asammdf", "mdf") from None
        try:
            self._mdf = MDF(path)
        except Exception as error:  # asammdf raises plain exceptions of many kinds for files that are none
            raise TrialsError(path, "", f"asammdf cannot read it: {error}") from None
        self._places: dict[str, tuple[int, int]] = {}
        self._channels: list[Channel] = []
        masters = self._mdf.masters_db
        for name, places in self._mdf.channels_db.items():
            places = [(group, index) for group, index in places if masters.get(group) != index]
            for group, index in places:
                full = name if len(places) == 1 else f"{name}@{group}"
                self._places[full] = (group, index)
                count = int(self._mdf.groups[group].channel_group.cycles_nr)
                self._channels.append(Channel(full, self._mdf.get_channel_unit(group=group, index=index), count))

    def channels(self) -> list[Channel]:
        return self._channels

    def read(self, names: Sequence[str], progress: Progress) -> dict[str, Series]:
        groups = {self._places[name][0] for name in names}
        masters = {group: np.asarray(self._mdf.get_master(group), dtype=np.float64) for group in groups}
        stamps = [master[0] for master in masters.values() if len(master)]
        if not stamps:
            raise TrialsError(self.path, "", "the channels of the mapping have no samples")
        start = min(stamps)
        times = {group: master - start for group, master in masters.items()}
        out = {}
        for at, name in enumerate(names):
            group, index = self._places[name]
            check_count(self.path, len(masters[group]))
            try:
                signal = self._mdf.get(group=group, index=index)
                samples = np.asarray(signal.samples, dtype=np.float64)
            except (ValueError, TypeError) as error:
                raise TrialsError(self.path, name, f"the channel holds no plain numbers: {error}") from None
            # samples that the file marks as invalid are left out of the signal
            all_there = len(samples) == len(masters[group])
            out[name] = Series(times[group] if all_there else np.asarray(signal.timestamps) - start, samples)
            progress((at + 1) / len(names))
        return out
