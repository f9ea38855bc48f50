"""Readers, one module a format. Each imports its library when a file of the format is opened."""

from pathlib import Path

from ..errors import TrialsError
from ..source import NO_CLOCK, Clock, Source


def open_source(path: Path, clock: Clock = NO_CLOCK) -> Source:
    """The source of a file or of a folder (a ROS 2 bag), by its ending and its first bytes."""
    if not path.exists():
        raise TrialsError(path, "", "there is no such file: correct the path")
    if path.is_dir():
        from .rosbag import RosbagSource

        if not (path / "metadata.yaml").exists():
            raise TrialsError(path, "", "the folder has no metadata.yaml, so it is no ROS 2 bag: give the file itself")
        return RosbagSource(path)
    ending = path.suffix.lower()
    if ending in (".bag", ".db3"):
        from .rosbag import RosbagSource

        return RosbagSource(path)
    if ending == ".mcap":
        from .mcap_file import McapSource

        return McapSource(path)
    if ending in (".mf4", ".mdf", ".dat"):
        from .mdf import MdfSource

        return MdfSource(path)
    if ending in (".npz", ".npy"):
        from .arrays import ArraySource

        return ArraySource(path, clock)
    if ending in (".csv", ".txt", ".tsv"):
        from .motive import MotiveSource, is_motive
        from .table import TableSource

        return MotiveSource(path) if is_motive(path) else TableSource(path, clock)
    raise TrialsError(
        path, "", f'the ending "{ending}" is of no known format: .csv, .npz, .npy, .bag, .db3, .mcap, .mf4, .mdf'
    )


def missing_extra(path: Path, package: str, extra: str) -> TrialsError:
    """The error of a library that is not installed."""
    return TrialsError(path, "", f"reading it needs {package}: pip install 'wade-trials[{extra}]'")
