"""Writing: TOML, CSV, and a folder that is there as a whole or not at all."""

import json
import math
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .axes import axes_text
from .errors import TrialsError
from .mapping import FORMAT, Mapping
from .source import NO_CLOCK

#: Rows that are formatted at once.
CHUNK = 20_000


def toml_value(value: Any) -> str:
    """One value of TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return "inf" if value == math.inf else repr(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml_value(item) for item in value) + "]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{toml_key(k)} = {toml_value(v)}" for k, v in value.items()) + " }"
    return json.dumps(str(value), ensure_ascii=False)


def toml_key(key: str) -> str:
    """A key, in quotes where it needs them."""
    plain = key and all(c.isascii() and (c.isalnum() or c in "-_") for c in key)
    return key if plain else json.dumps(key, ensure_ascii=False)


def toml_text(table: dict[str, Any], prefix: str = "") -> str:
    """A document: plain values first, then the tables."""
    lines = [f"{toml_key(k)} = {toml_value(v)}" for k, v in table.items() if not isinstance(v, dict)]
    for key, value in table.items():
        if isinstance(value, dict) and value:
            name = prefix + toml_key(key)
            deeper = toml_text(value, name + ".")
            heading = [] if all(isinstance(inner, dict) for inner in value.values()) else ["", f"[{name}]"]
            lines += [*heading, deeper.rstrip("\n")]
    return "\n".join(lines) + "\n"


def mapping_text(mapping: Mapping, folder: Path) -> str:
    """The mapping as a file in ``folder``: paths are relative to it, and guesses are marked."""
    base = mapping.path.parent
    lines = [
        "# Which channel of a recording becomes which column of a trial. Repeat the import with",
        f"# wade-trials import {mapping.path.name} --out FOLDER",
        f"format = {FORMAT}",
        f"vehicle = {toml_value(mapping.vehicle)}",
    ]
    if mapping.generated:
        lines.append(f"generated = {toml_value(mapping.generated)}")
    lines.append(f"fluid_density_kgpm3 = {mapping.fluid_density_kgpm3!r}")
    lines.append(f"max_speed_mps = {mapping.max_speed_mps!r}")
    if mapping.accept:
        lines.append(f"accept = {toml_value(mapping.accept)}")

    def table(name: str, values: dict[str, Any]) -> None:
        lines.extend(["", f"[{name}]"])
        for key, value in values.items():
            text = axes_text(value) if key.endswith("axes") else toml_value(value)
            why = mapping.guesses.get(f"{name}.{key}")
            lines.append(f"{key} = {text}" + (f"  # guess: {why}" if why else ""))

    if mapping.body:
        mass = {} if mapping.body.mass_kg is None else {"mass_kg": mapping.body.mass_kg}
        table("body", {k: v for k, v in vars(mapping.body).items() if k != "mass_kg"} | mass)
    table("processing", vars(mapping.processing))
    if mapping.clock != NO_CLOCK:
        table("time", {key: value for key, value in vars(mapping.clock).items() if value})
    for name in ("pose", "wrench", "imu"):
        part = getattr(mapping, name)
        if part is not None:
            table(name, {k: v for k, v in vars(part).items() if v != ("", "", "")})
    if mapping.columns:
        lines.extend(["", "[columns]"])
        for name, column in mapping.columns.items():
            values: dict[str, Any] = {"constant": column.constant}
            if column.constant is None:
                values = {"channel": column.channel, "unit": column.unit}
                values |= {} if column.factor == 1.0 else {"factor": column.factor}
            why = mapping.guesses.get(f"columns.{name}")
            lines.append(f"{name} = {toml_value(values)}" + (f"  # guess: {why}" if why else ""))
    for name, trial in mapping.trials.items():
        stated = {k: v for k, v in vars(trial).items() if v is not None and v != () and v != ""}
        file = (base / trial.file).resolve()
        stated["file"] = os.path.relpath(file, folder.resolve())
        table(f"trials.{toml_key(name)}", stated)
    if mapping.manifest:
        lines.extend(["", "[manifest]", toml_text(mapping.manifest, "manifest.").rstrip("\n")])
    if mapping.guesses:
        lines.extend(["", "# remove a line once you have confirmed or corrected the field", "[guesses]"])
        lines.extend(f"{toml_key(key)} = {toml_value(why)}" for key, why in mapping.guesses.items())
    return "\n".join(lines) + "\n"


def write_csv(path: Path, columns: dict[str, NDArray[np.float64]], comment: str) -> None:
    """Columns of equal length; a comment line first where there is one."""
    names = list(columns)
    row = ",".join("%.6f" if name == "t" else "%.8g" for name in names) + "\n"
    table = list(columns.values())
    count = len(table[0])
    with path.open("w", encoding="utf-8") as file:
        if comment:
            file.write(f"# {comment}\n")
        file.write(",".join(names) + "\n")
        for start in range(0, count, CHUNK):
            part = np.stack([column[start : start + CHUNK] for column in table], axis=1) + 0.0
            file.write((row * len(part)) % tuple(part.ravel().tolist()))


@contextmanager
def whole_folder(out: Path) -> Iterator[Path]:
    """A new folder beside ``out`` that takes its name at the end; on a fault nothing is left."""
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise TrialsError(out, "", "it is there already: remove it or name another folder with --out")
    out.parent.mkdir(parents=True, exist_ok=True)
    temporary = Path(tempfile.mkdtemp(prefix=f".{out.name}.", dir=out.parent))
    try:
        yield temporary
        temporary.chmod(0o755)
        if out.exists():
            out.rmdir()
        temporary.rename(out)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise
