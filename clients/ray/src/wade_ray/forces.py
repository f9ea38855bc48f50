"""An actor that answers batches of states."""

from __future__ import annotations

import itertools
import time
from collections.abc import Sequence

import numpy as np
import wade
from numpy.typing import NDArray

Columns = dict[str, NDArray[np.generic]]

#: Columns of a state, as `wade predict` has them, by what they become. A vector has its three in order.
_VECTORS = {
    "velocity_mps": ("vx", "vy", "vz"),
    "current_mps": ("cx", "cy", "cz"),
    "angular_velocity_radps": ("wx", "wy", "wz"),
    "acceleration_mps2": ("ax", "ay", "az"),
    "angular_acceleration_radps2": ("alx", "aly", "alz"),
    "roll_pitch_rad": ("roll", "pitch"),
    "wheel_speed_radps": ("wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr"),
}
_NUMBERS = {
    "depth_m": "depth",
    "water_level_m": "water_level",
    "density_kgpm3": "rho",
    "heading_rad": "yaw",
    "bed_clearance_m": "bed_clearance",
    "bed": "bed",
}
#: Columns that `wade predict` adds, and these.
_ADDED = ("fx", "fy", "fz", "mx", "my", "mz", "sfx", "sfy", "sfz", "smx", "smy", "smz")

#: First and longest pause before a server that has no room, or does not answer, is asked again [s].
_PAUSES = (0.1, 2.0)


def states_of(columns: Columns) -> wade.State:
    """The states in these columns, SI units and radians; ValueError names a part of a vector that is missing."""
    given: dict[str, NDArray[np.generic]] = {}
    for name, parts in _VECTORS.items():
        found = [part for part in parts if part in columns]
        if found and len(found) < len(parts) and name != "velocity_mps":
            missing = ", ".join(part for part in parts if part not in columns)
            raise ValueError(f"a table with {', '.join(found)} needs {missing} too")
        if found:
            zero = np.zeros(len(columns[found[0]]), np.float32)
            given[name] = np.stack([np.asarray(columns.get(part, zero), np.float32) for part in parts], axis=1)
    for name, column in _NUMBERS.items():
        if column in columns:
            given[name] = np.asarray(columns[column], np.float32)
    return wade.State(**given)  # type: ignore[arg-type]


class Forces:
    """Adds forces to batches: `dataset.map_batches(Forces, fn_constructor_args=("husky", ["host:50051"]), ...)`.

    Each state stands for itself: there is no memory from row to row. Columns are those of `wade predict`, and the same
    are added: fx fy fz mx my mz about the center of mass [N, N m], their standard deviations sfx to smz, in_domain;
    and bundle_version.

    A server that has no room or does not answer is asked again after a pause, or the next one is, for `patience_s`;
    then, or for a state that is refused, the error of the client is raised.
    """

    def __init__(self, vehicle: str, addresses: Sequence[str], patience_s: float = 60.0) -> None:
        if not addresses:
            raise ValueError("no address of a server")
        self._vehicle, self._patience_s = vehicle, patience_s
        self._servers = itertools.cycle(addresses)
        self._client = wade.connect(next(self._servers))

    def __call__(self, batch: Columns) -> Columns:
        forces = self._ask(states_of(batch))
        parts = (forces.force_n, forces.moment_nm, forces.uncertainty_n, forces.moment_uncertainty_nm)
        added = np.concatenate([np.asarray(part, np.float32) for part in parts], axis=1)
        rows = len(added)
        flags: Columns = {
            "in_domain": np.asarray(forces.in_domain, bool),
            "bundle_version": np.full(rows, forces.bundle_version, np.int32),
        }
        return batch | {name: added[:, i] for i, name in enumerate(_ADDED)} | flags

    def _ask(self, states: wade.State) -> wade.Forces:
        end, pause = time.monotonic() + self._patience_s, _PAUSES[0]
        while True:
            try:
                return self._client.evaluate_batch(self._vehicle, states)
            except (wade.ServerUnavailable, wade.ResourceExhausted, wade.DeadlineExceeded):
                if time.monotonic() + pause > end:
                    raise
            time.sleep(pause)
            pause = min(2 * pause, _PAUSES[1])
            self._client.close()
            self._client = wade.connect(next(self._servers))
