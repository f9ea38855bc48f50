"""ROS 1 bags and ROS 2 bags, by rosbags: no ROS is needed."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..errors import TrialsError
from ..source import Channel, Conventions, Progress, Series
from . import missing_extra
from .messages import Topics, by_topic, counted, number_fields


class RosbagSource:
    """A bag: a ``.bag`` file, a ``.db3`` file or a folder with ``metadata.yaml``."""

    format = "ROS bag"

    def __init__(self, path: Path) -> None:
        self.path, self.conventions = path, Conventions()
        try:
            from rosbags.highlevel import AnyReader, AnyReaderError
            from rosbags.typesys import Stores, get_typestore
        except ImportError:
            raise missing_extra(path, "rosbags", "ros") from None
        self._failures: tuple[type[Exception], ...] = (AnyReaderError, OSError, ValueError)
        try:
            # the types of a bag stand in it; bags before ROS 2 Iron have none, and these are the standard ones
            self._reader = AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE))
            self._reader.open()
        except self._failures as error:
            raise TrialsError(path, "", f"rosbags cannot read it: {error}") from None
        self._first: dict[str, dict[str, float]] | None = None

    def _numbers(self) -> dict[str, dict[str, float]]:
        """The numbers in the first message of each topic."""
        if self._first is None:
            self._first = {}
            for connection in self._reader.connections:
                try:
                    first = next(iter(self._reader.messages(connections=[connection])), None)
                    if first is None:
                        continue
                    message = self._reader.deserialize(first[2], connection.msgtype)
                except self._failures:
                    continue
                self._first.setdefault(connection.topic, number_fields(message))
        return self._first

    def channels(self) -> list[Channel]:
        counts: dict[str, int] = {}
        for connection in self._reader.connections:
            counts[connection.topic] = counts.get(connection.topic, 0) + connection.msgcount
        return [
            Channel(f"{topic}/{field}", "", counts[topic])
            for topic, fields in self._numbers().items()
            for field in fields
        ]

    def read(self, names: Sequence[str], progress: Progress) -> dict[str, Series]:
        topics = Topics(self.path, by_topic(list(names), list(self._numbers())), self._reader.start_time)
        connections = [c for c in self._reader.connections if c.topic in topics.wanted]
        total = sum(connection.msgcount for connection in connections)
        messages: Any = self._reader.messages(connections=connections)
        try:
            for connection, received, raw in counted(messages, total, progress):
                topics.add(connection.topic, received, self._reader.deserialize(raw, connection.msgtype))
        except self._failures as error:
            raise TrialsError(self.path, "", f"the bag is damaged: {error}") from None
        return topics.series()
