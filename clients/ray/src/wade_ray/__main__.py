"""`wade-ray`: forces for tables of states in Parquet."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import ray

from .tables import Progress, RowsLost, predict


def main() -> int:
    """Runs the command; its exit status."""
    parser = argparse.ArgumentParser(prog="wade-ray", description=__doc__)
    parser.add_argument("states", type=Path, help="folder of Parquet files with the columns of `wade predict`")
    parser.add_argument("out", type=Path, help="folder for the same with forces; what is there already is kept")
    parser.add_argument("--vehicle", required=True)
    parser.add_argument("--address", action="append", help="of a server; repeat it for several [127.0.0.1:50051]")
    parser.add_argument("--actors", type=int, default=2, help="that ask at the same time [2]")
    parser.add_argument("--batch-rows", type=int, default=4096, help="states in a request [4096]")
    parser.add_argument("--files-at-once", type=int, default=4, help="files that are done or not [4]")
    parser.add_argument("--ray", help="address of a Ray cluster; without it, one on this machine for this run")
    asked = parser.parse_args()
    ray.init(address=asked.ray, include_dashboard=False, log_to_driver=False)
    ray.data.DataContext.get_current().enable_progress_bars = False
    start = time.monotonic()

    def tell(progress: Progress) -> None:
        rate = progress.rows_done / (time.monotonic() - start)
        groups, rows = f"{progress.groups_done}/{progress.groups} groups", f"{progress.rows_done}/{progress.rows} rows"
        print(f"\r{groups}, {rows}, {rate:.0f} rows/s", end="", file=sys.stderr, flush=True)

    try:
        rows = predict(
            asked.states,
            asked.out,
            asked.vehicle,
            asked.address or ["127.0.0.1:50051"],
            actors=asked.actors,
            batch_rows=asked.batch_rows,
            files_at_once=asked.files_at_once,
            on_progress=tell,
        )
    except (OSError, RowsLost, ray.exceptions.RayError) as error:
        print(f"\nerror: {error}", file=sys.stderr)
        return 1
    print(f"\n{rows} rows in {asked.out}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
