"""Numbers in messages of ROS: ``/topic/field.field`` names a channel."""

from array import array
from collections.abc import Callable, Iterator
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from ..source import Progress, Series, check_count

#: A stamp in the header that is this far from the time of receipt belongs to another clock [s].
SAME_CLOCK = 10.0
#: Longest array in a message whose elements become channels: a covariance of 36 does not.
LONGEST_ARRAY = 8


def number_fields(message: object, prefix: str = "") -> dict[str, float]:
    """All numbers of a message, by dotted name; ``header.stamp`` is left out, since it is the clock."""
    found: dict[str, float] = {}
    names = getattr(message, "__dataclass_fields__", None)
    items = (
        [(name, getattr(message, name)) for name in names if name != "__msgtype__"]
        if names is not None
        else list(message.items())
        if isinstance(message, dict)
        else []
    )
    for name, value in items:
        full = f"{prefix}{name}"
        if full in ("header", "stamp"):
            continue
        if isinstance(value, bool):
            continue
        if isinstance(value, int | float | np.number):
            found[full] = float(value)
        elif isinstance(value, np.ndarray | list | tuple):
            if 0 < len(value) <= LONGEST_ARRAY and all(isinstance(v, int | float | np.number) for v in value):
                found.update({f"{full}.{at}": float(v) for at, v in enumerate(value)})
        else:
            found.update(number_fields(value, f"{full}."))
    return found


def getter(field: str) -> Callable[[Any], float]:
    """A function that takes one number out of a message."""
    parts = field.split(".")
    if parts[-1].isdigit():
        index, inner = int(parts[-1]), attrgetter(".".join(parts[:-1]))
        return lambda message: float(inner(message)[index])
    return attrgetter(field)


def stamp_ns(message: Any) -> int | None:
    """The stamp of the header [ns]; ``None`` where there is none or where it was left at 0."""
    header = getattr(message, "header", None)
    stamp = getattr(header, "stamp", None)
    if stamp is None:
        return None
    return (int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)) or None


class Topics:
    """Collects numbers of some topics, message by message."""

    def __init__(self, path: Path, wanted: dict[str, list[str]], start_ns: int) -> None:
        self.path, self.start = path, start_ns
        self.getters = {topic: [getter(field) for field in fields] for topic, fields in wanted.items()}
        self.wanted = wanted
        self.times: dict[str, array[float]] = {topic: array("d") for topic in wanted}
        self.values = {topic: [array("d") for _ in fields] for topic, fields in wanted.items()}
        self.by_header: dict[str, bool] = {}

    def add(self, topic: str, received_ns: int, message: Any) -> None:
        stamp = stamp_ns(message)
        by_header = self.by_header.get(topic)
        if by_header is None:
            by_header = stamp is not None and abs(stamp - received_ns) < SAME_CLOCK * 1e9
            self.by_header[topic] = by_header
        ns = stamp if by_header and stamp is not None else received_ns
        times = self.times[topic]
        times.append((ns - self.start) * 1e-9)
        for get, values in zip(self.getters[topic], self.values[topic], strict=True):
            values.append(get(message))
        if len(times) % 1_000_000 == 0:
            check_count(self.path, len(times))

    def series(self) -> dict[str, Series]:
        """In the order of the stamps: receipt can be out of order."""
        out = {}
        for topic, fields in self.wanted.items():
            t = np.array(self.times[topic])
            order = np.argsort(t, kind="stable") if np.any(np.diff(t) < 0) else slice(None)
            t = t[order]
            for field, values in zip(fields, self.values[topic], strict=True):
                out[f"{topic}/{field}"] = Series(t, np.array(values)[order])
        return out


def by_topic(names: list[str], topics: list[str]) -> dict[str, list[str]]:
    """Channels grouped by topic; of two topics that fit, the longer one."""
    grouped: dict[str, list[str]] = {}
    for name in names:
        fitting = [topic for topic in topics if name.startswith(topic + "/")]
        topic = max(fitting, key=len)
        grouped.setdefault(topic, []).append(name[len(topic) + 1 :])
    return grouped


def counted(messages: Iterator[Any], total: int, progress: Progress) -> Iterator[Any]:
    """The messages, with a report of progress each ten thousand."""
    for at, message in enumerate(messages):
        if at % 10_000 == 0:
            progress(at / max(total, 1))
        yield message
    progress(1.0)
