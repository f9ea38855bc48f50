"""What the ``wade`` program knows of a vehicle. The program is found by ``$WADE`` or on the path."""

import json
import os
import shutil
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

from .errors import TrialsError
from .mapping import Body

#: Longest run of the program [s].
LONGEST_RUN = 60


def program() -> str | None:
    """The program, where there is one."""
    return os.environ.get("WADE") or shutil.which("wade")


def _run(*arguments: str) -> Any:
    wade = program()
    if wade is None:
        raise TrialsError("wade", "", "the program is not on the path: install it or set WADE to it")
    try:
        done = subprocess.run([wade, *arguments], capture_output=True, text=True, timeout=LONGEST_RUN)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise TrialsError(Path(wade), "", f"it does not run: {error}") from None
    if done.returncode != 0:
        raise TrialsError(Path(wade), " ".join(arguments[:3]), done.stderr.strip() or f"exit status {done.returncode}")
    return json.loads(done.stdout)


@cache
def body(vehicle: str) -> Body:
    """The body of a vehicle's bundle."""
    shown = _run("vehicle", "show", vehicle, "--json")
    x, y, z = shown["center_of_mass_m"]
    return Body(float(shown["z0_m"]), (x, y, z), shown.get("mass_kg"))


@cache
def buoyancy(vehicle: str, depth: float, density: float) -> float:
    """Vertical force of still water on a level vehicle [N]: rho g V."""
    state = ["--depth", repr(depth), "--density", repr(density), "--speed", "0"]
    answer = _run("query", "--vehicle", vehicle, *state, "--physics", "hydrostatic", "--json")
    return float(answer["wrench"]["force"][2])
