"""What a second of the example in MuJoCo takes: 1,000 steps, each with a call over shared memory.

    python clients/python/benches/wading.py --out benches/results/DATE/mujoco-wading.json

The server's vehicles have an added mass and a damping by hand, as the example asks for. CPU time is that of the
processes, so that it says what the code needs where the clock says what else the machine does.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path

import mujoco
from roundtrip import ROOT, machine, served

import wade

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples"))
import mujoco_wading as wading
from effects_by_hand import copy_with


def cpu_seconds(pid: int) -> float:
    """CPU time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def main() -> None:
    """Drives through the ford and says what it took."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wade", type=Path, default=ROOT / "target" / "release" / "wade")
    parser.add_argument("--vehicles", type=Path, default=ROOT / "vehicles")
    parser.add_argument("--note", default="", help="what else the machine does, for the results")
    parser.add_argument("--out", type=Path, help="JSON file for the results")
    arguments = parser.parse_args()
    started = machine(arguments.wade) | {"mujoco": mujoco.__version__}
    with tempfile.TemporaryDirectory() as folder:
        effects: dict[str, dict[str, float]] = {"added_mass": {}, "linear_damping": {}}
        vehicles = copy_with(effects, Path(folder) / "vehicles", arguments.vehicles)
        cpu = min(os.sched_getaffinity(0))
        with served(arguments.wade.resolve(), "block", cpu, vehicles) as place:
            with wade.ShmClient(place.namespace, timeout_s=60.0) as client:
                before = cpu_seconds(place.pid)
                track = wading.ford(client)
                server = (cpu_seconds(place.pid) - before) / track.time[-1]
    cost = asdict(track.cost) | {"server": server}
    cost["cpu"] = cost["mujoco"] + cost["client"] + cost["python"] + server
    for name, seconds in cost.items():
        print(f"{name:10} {seconds:8.4f} s of a simulated second")
    print(f"{1 / cost['cpu']:.1f} times real time by the CPU time of both ends, {1 / cost['wall']:.2f} by the clock")
    if arguments.out:
        report = {"machine": started, "note": arguments.note, "seconds_of_a_second": cost}
        arguments.out.write_text(json.dumps(report, indent=2) + "\n")


if __name__ == "__main__":
    main()
