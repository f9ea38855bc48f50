"""The import: every recording of a mapping, checked, as a folder of trials."""

import hashlib
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from .checks import CHECKS, Finding, check_clock, check_columns, check_frozen, check_imu, check_pose
from .errors import TrialsError
from .mapping import MAPPING_FILE, Mapping, Trial
from .motion import Rig, add_columns, base_grid, from_pose, increasing, track_of, window
from .readers import open_source
from .source import Progress, Series, unknown_channel
from .write import mapping_text, toml_text, whole_folder, write_csv

#: Called with a text and a share, 0 to 1.
Report = Callable[[str, float], None]


@dataclass
class Result:
    """What an import did, or would have done."""

    findings: list[Finding] = field(default_factory=list)
    #: Rows by trial.
    rows: dict[str, int] = field(default_factory=dict)
    seconds: float = 0.0

    def wrong(self, accept: list[str]) -> list[Finding]:
        """The findings that stop the import."""
        return [f for f in self.findings if f.level == "wrong" and f.check not in accept]


class Refused(TrialsError):
    """Findings that stop the import; nothing was written."""

    def __init__(self, path: Path, result: Result, wrong: list[Finding]) -> None:
        self.result, self.wrong = result, wrong
        checks = ", ".join(f'"{check}"' for check in dict.fromkeys(f.check for f in wrong))
        lines = "\n  ".join(str(finding) for finding in wrong)
        message = (
            f"nothing was written, since {len(wrong)} of the checks failed\n  {lines}\n"
            f"correct {path}, or write accept = [{checks}] in it where the recording is right"
        )
        super().__init__(path, "", message)


def import_trials(mapping: Mapping, out: Path | None, report: Report = lambda text, share: None) -> Result:
    """Imports every trial of a mapping into a new folder ``out``; without one everything but the writing is done."""
    unknown = next((check for check in mapping.accept if check not in CHECKS), None)
    if unknown is not None:
        raise TrialsError(mapping.path, "accept", f'there is no check "{unknown}"; there are: {", ".join(CHECKS)}')
    if not mapping.channels():
        raise TrialsError(mapping.path, "columns", "no channel is mapped: a trial of constants alone measures nothing")
    result = Result()
    started = time.monotonic()
    if out is None:
        for name, trial in mapping.trials.items():
            _columns(mapping, name, trial, result, report)
    else:
        with whole_folder(out) as folder:
            hashes = {}
            for name, trial in mapping.trials.items():
                columns = _columns(mapping, name, trial, result, report)
                hashes[name] = _sha256(mapping.path.parent / trial.file)
                if trial.sha256 and trial.sha256 != hashes[name]:
                    raise TrialsError(
                        mapping.path.parent / trial.file,
                        f"trials.{name}.sha256",
                        "the file is not the one that the mapping was made for: correct the path or remove sha256",
                    )
                report(f"{name}: writing", 0.0)
                write_csv(folder / f"{name}.csv", columns, "generated, not measured" if mapping.generated else "")
            _refuse(mapping, result)
            repeated = replace(mapping, trials={n: replace(t, sha256=hashes[n]) for n, t in mapping.trials.items()})
            (folder / MAPPING_FILE).write_text(mapping_text(repeated, out), encoding="utf-8")
            (folder / "trials.toml").write_text(manifest_text(mapping), encoding="utf-8")
    _refuse(mapping, result)
    result.seconds = time.monotonic() - started
    return result


def _refuse(mapping: Mapping, result: Result) -> None:
    wrong = result.wrong(mapping.accept)
    if wrong:
        raise Refused(mapping.path, result, wrong)


def _columns(mapping: Mapping, name: str, trial: Trial, result: Result, report: Report) -> dict[str, Any]:
    """The columns of one trial; what the checks find goes into the result."""
    path = mapping.path.parent / trial.file
    series = _read(mapping, name, trial, path, lambda share: report(f"{name}: reading", share))
    report(f"{name}: checking", 0.0)
    findings = result.findings
    check_clock(path, *next(iter(series.items())))
    findings.extend(check_frozen(name, mapping, {channel: window(own, trial) for channel, own in series.items()}))
    is_checked = True
    if mapping.pose is not None:
        assert mapping.body is not None
        track = track_of(path, mapping, trial, series)
        of_pose, likely = check_pose(name, mapping, trial, track)
        findings.extend(of_pose)
        pose = mapping.pose
        if any(f.level == "wrong" and f.check not in mapping.accept for f in of_pose):
            # nothing will be written: the other checks go on with the reading that is likely right
            pose, is_checked = likely or pose, likely is not None
        columns = from_pose(path, track, Rig(pose, mapping.body, trial.water_level_m, mapping.processing))
    else:
        columns = {"t": base_grid(mapping, series)}
    add_columns(path, mapping, trial, series, columns)
    if mapping.imu is not None and is_checked:
        findings.extend(check_imu(name, mapping.imu, trial, series, columns))
    if is_checked:
        findings.extend(check_columns(name, mapping, trial, columns))
    result.rows[name] = len(columns["t"])
    return columns


def _read(mapping: Mapping, name: str, trial: Trial, path: Path, progress: Progress) -> dict[str, Series]:
    source = open_source(path, mapping.clock)
    channels = source.channels()
    known = {channel.name for channel in channels}
    wanted = mapping.channels()
    for channel in wanted:
        if channel not in known:
            raise unknown_channel(path, mapping.field_of(channel), channel, channels)
    series = source.read(wanted, progress)
    posed = {*mapping.pose.position, *mapping.pose.quaternion} if mapping.pose else set()
    out = {}
    for channel in wanted:
        # a frame without a pose is left out as a whole, later
        own = series[channel] if channel in posed else increasing(path, channel, window(series[channel], trial))
        if len(own.t) < 2:
            raise TrialsError(path, channel, f"it has {len(own.t)} samples: at least 2 are needed")
        out[channel] = own
    return out


def _sha256(path: Path) -> str:
    """Of a file, or of the files of a folder by name."""
    files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
    digest = hashlib.sha256()
    for file in files:
        with file.open("rb") as stream:
            while block := stream.read(1 << 20):
                digest.update(block)
    return digest.hexdigest()


def manifest_text(mapping: Mapping) -> str:
    """``trials.toml``."""
    table: dict[str, Any] = {"vehicle": mapping.vehicle}
    if mapping.generated:
        table["generated"] = mapping.generated
    table["fluid_density"] = mapping.fluid_density_kgpm3
    depths = {name: trial.depth_m for name, trial in mapping.trials.items() if trial.depth_m is not None}
    widths = {name: t.channel_width_m for name, t in mapping.trials.items() if t.channel_width_m is not None}
    table |= {key: value for key, value in mapping.manifest.items() if not isinstance(value, dict)}
    if depths:
        table["nominal_depth"] = depths
    if widths:
        table["channel_widths"] = widths
    measured = dict(mapping.manifest.get("measured", {}))
    if mapping.wrench is not None and "method" not in measured:
        measured["method"] = "load_cell"
    if measured:
        table["measured"] = measured
    table |= {k: v for k, v in mapping.manifest.items() if isinstance(v, dict) and k != "measured"}
    return toml_text(table)
