"""Parquet in, Parquet out, in groups of files that are done or not."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import pyarrow.parquet as parquet
import ray
import ray.data

from .forces import Forces

#: In the folder of a group: the files that it was made of, with their sizes and rows.
INPUTS = "_inputs.json"

#: Batches that an actor has at a time.
BATCHES_A_BLOCK = 8

#: Share of a core that an actor reserves: it waits for its server, and must not keep those who read from beginning.
ACTOR_CPUS = 0.1


class RowsLost(RuntimeError):
    """A group came back with other rows than it was sent with; nothing of it was kept."""


@dataclass(frozen=True)
class Progress:
    """How far a run is."""

    groups_done: int
    groups: int
    rows_done: int
    rows: int


def predict(
    states: Path,
    out: Path,
    vehicle: str,
    addresses: Sequence[str],
    *,
    actors: int = 2,
    batch_rows: int = 4096,
    files_at_once: int = 4,
    on_progress: Callable[[Progress], None] = lambda _: None,
) -> int:
    """Writes the states of every Parquet file of `states` with their forces into `out`; the number of rows.

    The files are taken `files_at_once` at a time. A group is a folder of `out` that appears when all of it is there, so
    that a run that was ended goes on where it was when it is started again. FileExistsError: `out` was made of other
    files. An actor that dies is replaced, and what it had is asked again.
    """
    files = sorted(states.glob("*.parquet"))
    if not files:
        raise FileNotFoundError(f"{states} has no *.parquet file")
    groups = [files[at : at + files_at_once] for at in range(0, len(files), files_at_once)]
    described = [[_described(file) for file in group] for group in groups]
    sizes = [sum(int(file["rows"]) for file in group) for group in described]
    out.mkdir(parents=True, exist_ok=True)
    done = 0
    for number, (group, inputs, size) in enumerate(zip(groups, described, sizes, strict=True)):
        place = out / f"group-{number:05}"
        if place.exists():
            if json.loads((place / INPUTS).read_text()) != inputs:
                raise FileExistsError(f"{place} was made of other files; choose another folder, or remove it")
        else:
            _write(group, place, inputs, (vehicle, list(addresses)), actors, batch_rows, size)
        done += size
        on_progress(Progress(number + 1, len(groups), done, sum(sizes)))
    return done


def _described(file: Path) -> dict[str, str | int]:
    return {"file": file.name, "bytes": file.stat().st_size, "rows": parquet.read_metadata(file).num_rows}


def _write(
    group: list[Path],
    place: Path,
    inputs: list[dict[str, str | int]],
    asked: tuple[str, list[str]],
    actors: int,
    batch_rows: int,
    rows: int,
) -> None:
    staged = place.with_name(f".{place.name}.new")
    # of a run that was ended
    shutil.rmtree(staged, ignore_errors=True)
    # a block each time that an actor asks: what it loses when it dies
    blocks = max(len(group), -(-rows // (batch_rows * BATCHES_A_BLOCK)))
    table = ray.data.read_parquet([str(file) for file in group], override_num_blocks=blocks)
    table = table.map_batches(
        Forces,
        fn_constructor_args=asked,
        batch_size=batch_rows,
        batch_format="numpy",
        compute=ray.data.ActorPoolStrategy(size=actors),
        num_cpus=ACTOR_CPUS,
    )
    table.write_parquet(str(staged))
    back = sum(parquet.read_metadata(file).num_rows for file in staged.glob("*.parquet"))
    if back != rows:
        shutil.rmtree(staged)
        raise RowsLost(f"{place.name}: {rows} rows were sent and {back} came back")
    (staged / INPUTS).write_text(json.dumps(inputs))
    os.replace(staged, place)
