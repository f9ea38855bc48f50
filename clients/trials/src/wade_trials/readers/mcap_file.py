"""MCAP files with messages of ROS 1, ROS 2 or JSON."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from ..errors import TrialsError
from ..source import Channel, Conventions, Progress, Series
from . import missing_extra
from .messages import Topics, by_topic, counted, number_fields
from .rosbag import RosbagSource

Decode = Callable[[bytes], Any]


class McapSource:
    """An MCAP file."""

    format = "MCAP"

    def __init__(self, path: Path) -> None:
        self.path, self.conventions = path, Conventions()
        try:
            from mcap.exceptions import McapError
            from mcap.reader import make_reader
        except ImportError:
            raise missing_extra(path, "mcap", "mcap") from None
        self._failure: type[Exception] = McapError
        self._make_reader = make_reader
        self._file = path.open("rb")
        self._decoders: dict[int, Decode | None] = {}
        self._reasons: dict[str, str] = {}
        try:
            self._summary = make_reader(self._file).get_summary()
        except McapError as error:
            raise TrialsError(path, "", f"mcap cannot read it: {error or type(error).__name__}") from None
        self._first: dict[str, dict[str, float]] | None = None

    def _messages(self, topics: list[str] | None) -> Any:
        self._file.seek(0)
        return self._make_reader(self._file).iter_messages(topics=topics, log_time_order=False)

    def _decoder(self, schema: Any, channel: Any) -> Decode | None:
        if channel.id not in self._decoders:
            self._decoders[channel.id] = self._new_decoder(schema, channel)
        return self._decoders[channel.id]

    def _new_decoder(self, schema: Any, channel: Any) -> Decode | None:
        if channel.message_encoding == "json":
            return lambda data: json.loads(data, object_hook=lambda fields: SimpleNamespace(**fields))
        if channel.message_encoding not in ("cdr", "ros1") or schema is None:
            self._reasons[channel.topic] = f"its messages are encoded as {channel.message_encoding or 'nothing'}"
            return None
        try:
            from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
        except ImportError:
            raise missing_extra(self.path, "rosbags", "mcap") from None
        store = get_typestore(Stores.EMPTY)
        text = schema.data.decode()
        if schema.encoding in ("ros2msg", "ros1msg"):
            store.register(get_types_from_msg(text, schema.name))
        else:
            separator = "=" * 80 + "\n"
            for part in text.split(separator):
                body = part.split("\n", 1)[1] if part.startswith("IDL: ") else part
                if body.strip():
                    store.register(get_types_from_idl(body))
        name = schema.name if "/msg/" in schema.name else "/msg/".join(schema.name.rsplit("/", 1))
        if channel.message_encoding == "cdr":
            return lambda data: store.deserialize_cdr(data, name)
        return lambda data: store.deserialize_ros1(data, name)

    def _numbers(self) -> dict[str, dict[str, float]]:
        if self._first is None:
            self._first = {}
            topics = sorted({c.topic for c in self._summary.channels.values()}) if self._summary else None
            try:
                every: list[str | None] = [None]
                for topic in topics or every:
                    for schema, channel, message in self._messages([topic] if topic else None):
                        if channel.topic not in self._first:
                            decode = self._decoder(schema, channel)
                            self._first[channel.topic] = _plain(decode(message.data)) if decode else {}
                        if topic:
                            break
            except (self._failure, ValueError) as error:
                raise TrialsError(self.path, "", f"the file is damaged: {error}") from None
        return self._first

    def _is_ros2(self, topics: list[str]) -> bool:
        """True where rosbags can read the topics."""
        channels = self._summary.channels.values() if self._summary else []
        encodings = {channel.message_encoding for channel in channels if channel.topic in topics}
        return encodings == {"cdr"}

    def channels(self) -> list[Channel]:
        counts: dict[str, int] = {}
        statistics = self._summary.statistics if self._summary else None
        if self._summary and statistics:
            for number, count in statistics.channel_message_counts.items():
                topic = self._summary.channels[number].topic
                counts[topic] = counts.get(topic, 0) + count
        numbers = self._numbers()
        found = [
            Channel(f"{topic}/{name}", "", counts.get(topic)) for topic, names in numbers.items() for name in names
        ]
        if not found:
            reasons = "; ".join(f"{topic}: {why}" for topic, why in self._reasons.items())
            raise TrialsError(
                self.path, "", f"no topic holds numbers that can be read ({reasons or 'it is empty'}): "
                "record messages of ROS 1, ROS 2 or JSON",
            )  # fmt: skip
        return found

    def read(self, names: Sequence[str], progress: Progress) -> dict[str, Series]:
        statistics = self._summary.statistics if self._summary else None
        start = statistics.message_start_time if statistics else 0
        topics = Topics(self.path, by_topic(list(names), list(self._numbers())), start)
        if self._is_ros2(list(topics.wanted)):
            try:
                # six times as fast; it reads fewer kinds of files
                return RosbagSource(self.path).read(names, progress)
            except TrialsError:
                pass
        total = statistics.message_count if statistics else 0
        try:
            for schema, channel, message in counted(self._messages(list(topics.wanted)), total, progress):
                decode = self._decoder(schema, channel)
                if decode is not None:
                    topics.add(channel.topic, message.log_time, decode(message.data))
        except (self._failure, ValueError, AttributeError) as error:
            raise TrialsError(self.path, "", f"the file is damaged: {error or type(error).__name__}") from None
        return topics.series()


def _plain(message: Any) -> dict[str, float]:
    """Numbers of a message of ROS or of JSON."""
    return number_fields(_as_dict(message) if isinstance(message, SimpleNamespace) else message)


def _as_dict(value: Any) -> Any:
    if isinstance(value, SimpleNamespace):
        return {name: _as_dict(inner) for name, inner in vars(value).items()}
    return value
