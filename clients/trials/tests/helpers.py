"""What the tests share: a mapping of a recording, and the columns of a trial."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import generated
import numpy as np
from numpy.typing import NDArray

from wade_trials import Mapping, Result, import_trials
from wade_trials.axes import PRESETS
from wade_trials.mapping import Body, Column, Pose, Trial
from wade_trials.run import Refused

Array = NDArray[np.float64]

BODY = Body(generated.Z0, (0.0, 0.0, -0.058), 280.0)
POSE = Pose(("x", "y", "z"), ("qw", "qx", "qy", "qz"), tracked_point_to_origin_m=generated.ARM)
FORCES = {name: Column(name, "N") for name in ("fx", "fy", "fz")}


def mapping_of(file: Path, **changes: Any) -> Mapping:
    """The right mapping of a recording that ``generated.table`` made."""
    trial = Trial(str(file), water_level_m=generated.WATER_LEVEL, depth_m=generated.DEPTH)
    right = Mapping(
        path=file.parent / "mapping.toml",
        vehicle="warthog",
        trials={file.stem: trial},
        body=BODY,
        generated=generated.LABEL,
        pose=POSE,
        columns=dict(FORCES),
    )
    return replace(right, **changes)


def refusal(mapping: Mapping) -> str:
    """The message of an import that must be refused."""
    try:
        import_trials(mapping, None)
    except Refused as refused:
        return str(refused)
    raise AssertionError("it was accepted")


def accepted(mapping: Mapping) -> Result:
    """The result of an import that must be accepted, with no doubt."""
    result = import_trials(mapping, None)
    assert all(finding.level in ("ok", "skipped") for finding in result.findings), result.findings
    return result


def columns_of(path: Path) -> dict[str, Array]:
    """The columns of a trial on disk."""
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    rows = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    return {name: rows[:, at] for at, name in enumerate(lines[0].split(","))}


Y_UP = {"axes": PRESETS["y up"], "body_axes": PRESETS["y up"]}
NED = {"axes": PRESETS["NED"], "body_axes": PRESETS["NED"]}
