"""The clock, and channels that stop."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .. import limits
from ..errors import TrialsError
from ..mapping import WRENCH, Mapping, Pose
from ..source import Series
from ..units import UNITS, quantity_of
from .finding import Finding

Array = NDArray[np.float64]


def check_clock(path: Path, channel: str, series: Series) -> None:
    """Refuses steps that look like another unit of time: no other check would mean anything."""
    steps = np.diff(series.t)
    repeated = np.mean(steps == 0)
    if repeated > limits.REPEATED_STAMPS:
        later = steps[steps > 0]
        message = f"{repeated:.0%} of the samples of {channel} have the stamp of the one before"
        if len(later):
            message += f", and the others come {np.median(later):g} s later"
        advice = "export stamps with fractions of a second, or the number of each frame and its rate_hz under [time]"
        raise TrialsError(path, "time.channel", f"{message}: {advice}")
    step = float(np.median(steps))
    if np.all(steps == 1):
        message = f"the samples of {channel} are 1 s apart throughout, as where the column counts frames"
        raise TrialsError(path, "time.rate_hz", f"{message}: write rate_hz = FRAMES A SECOND under [time]")
    if step >= limits.LONG_STEP:
        unit = "ms" if step < 1e3 else "us" if step < 1e6 else "ns"
        message = f"the samples of {channel} are {step:g} s apart, too long for seconds"
        raise TrialsError(path, "time.unit", f'{message}: write unit = "{unit}" under [time]')


def frozen_run(series: Series) -> tuple[float, float] | None:
    """The longest span in which a live channel keeps one value to the last bit; ``None`` where there is none."""
    change = np.diff(series.values) != 0
    edges = np.flatnonzero(np.concatenate([[True], change, [True]]))
    runs = np.diff(edges)
    at = int(np.argmax(runs))
    first, last = int(edges[at]), int(edges[at + 1]) - 1
    start, end = float(series.t[first]), float(series.t[last])
    others = len(change) - (last - first)
    if runs[at] < limits.FROZEN_SAMPLES or end - start < limits.FROZEN_DURATION or others < limits.FROZEN_SAMPLES:
        return None
    live = np.count_nonzero(change) / others
    return (start, end) if live >= limits.LIVE_SHARE else None


def check_frozen(name: str, mapping: Mapping, series: dict[str, Series]) -> Iterator[Finding]:
    """Channels that stop, and channels of forces and inertial sensors that never move."""
    reported: dict[tuple[float, float], list[str]] = {}
    for channel in mapping.channels():
        own, field = series[channel], mapping.field_of(channel)
        if np.all(own.values == own.values[0]):
            if field.startswith(("wrench.", "imu.")) or field.split(".")[1] in WRENCH:
                message = f"channel {channel} is {own.values[0]:g} throughout: it is not connected"
                yield Finding("frozen", "wrong", name, field, message, 'the channel that was measured, or ""')
            continue
        span = frozen_run(own)
        if span is None or (_may_be_zero(field) and own.values[np.searchsorted(own.t, span[0])] == 0):
            continue
        # channels that stop together: one may move a sample longer than another
        near = [other for other in reported if np.allclose(other, span, atol=limits.DIFFERENCE)]
        group = reported.pop(near[0]) if near else []
        joint = (max(span[0], near[0][0]), min(span[1], near[0][1])) if near else span
        reported[joint] = [*group, channel]
    for (start, end), channels in reported.items():
        if mapping.pose and _is_rest(mapping.pose, series, start, end, channels):
            continue
        last = max(float(series[channel].t[-1]) for channel in channels)
        names = ", ".join(channels[:3]) + (f" and {len(channels) - 3} more" if len(channels) > 3 else "")
        verb = "has" if len(channels) == 1 else "have"
        if end >= last - 1e-9:
            message = f"channel {names} {verb} been frozen from {start:.1f} s on"
            write = f"end_s = {start:.3f} under [trials.{name}]"
        else:
            message = f"channel {names} {verb} been frozen from {start:.1f} s to {end:.1f} s"
            write = f"leave_out_s = [[{start:.3f}, {end:.3f}]] under [trials.{name}]"
        yield Finding("frozen", "wrong", name, mapping.field_of(channels[0]), message, write)


def _may_be_zero(field: str) -> bool:
    """True for columns of things that stand still at exactly 0, such as wheels, carriages and simulators."""
    kind, _, rest = field.partition(".")
    column = rest.split(".")[0]
    return kind == "columns" and (column.startswith("sim_") or quantity_of(column) not in ("force", "moment"))


def _is_rest(pose: Pose, series: dict[str, Series], start: float, end: float, channels: list[str]) -> bool:
    """True where the whole pose stands still and the vehicle did so before and after: a simulator has no noise."""
    live = {name for name in (*pose.position, *pose.quaternion) if np.ptp(series[name].values) > 0}
    if not live <= set(channels):
        return False
    scale = UNITS["length"][pose.position_unit]
    for at, other in ((start, start - limits.DIFFERENCE), (end, end + limits.DIFFERENCE)):
        way = [
            np.interp(at, series[n].t, series[n].values) - np.interp(other, series[n].t, series[n].values)
            for n in pose.position
        ]
        if float(np.linalg.norm(way)) * scale > 2 * limits.REST_SPEED * limits.DIFFERENCE:
            return False
    return end < float(series[pose.position[0]].t[-1]) - limits.DIFFERENCE
