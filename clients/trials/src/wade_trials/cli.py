"""The command: ``wade-trials inspect``, ``map``, ``check`` and ``import``."""

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from . import __version__
from .errors import TrialsError
from .guess import Known, guess
from .mapping import MAPPING_FILE, Mapping
from .readers import open_source
from .run import Refused, Result, import_trials
from .show import findings_table, mapping_table, table
from .source import Clock
from .write import mapping_text

EXAMPLES = """examples:
  wade-trials inspect take.csv
  wade-trials map take.csv --vehicle warthog --water-level 0.10 --depth 0.10 \\
      --point-to-origin 0.2,0,-0.572
  wade-trials check mapping.toml
  wade-trials import mapping.toml --out trials/
  wade gap --vehicle warthog --trials trials/ --out gap/
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command; 0 on success, 1 where a recording or a mapping is refused."""
    parser = _parser()
    options = parser.parse_args(arguments)
    try:
        code: int = options.run(options)
    except TrialsError as error:
        if isinstance(error, Refused) and (passed := findings_table(error.result.findings)):
            print(passed)
        print(f"error: {error}", file=sys.stderr)
        return 1
    except BrokenPipeError:
        return 1
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="wade-trials",
        description="Import recordings as a folder of trials for wade gap and wade validate.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"wade-trials {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    inspect = commands.add_parser("inspect", help="list the channels of a recording")
    inspect.add_argument("file", type=Path, metavar="FILE")
    _clock(inspect)
    inspect.set_defaults(run=_inspect)

    mapping = commands.add_parser("map", help="write a first mapping.toml for recordings with the same channels")
    mapping.add_argument("files", type=Path, nargs="+", metavar="FILE")
    mapping.add_argument("--vehicle", required=True, help="name of the vehicle's bundle")
    mapping.add_argument("--out", type=Path, default=Path(MAPPING_FILE), help="the mapping [default: mapping.toml]")
    mapping.add_argument("--body", default="", help="name of the tracked body, where there are several")
    mapping.add_argument(
        "--water-level", type=float, metavar="M", help="altitude of the still water, cameras' frame [m]"
    )
    mapping.add_argument("--depth", type=float, metavar="M", help="water depth measured at rest [m]")
    mapping.add_argument(
        "--point-to-origin", type=_triple, metavar="X,Y,Z", help="from the tracked point to the hull's middle, FLU [m]"
    )
    _clock(mapping)
    mapping.set_defaults(run=_map)

    check = commands.add_parser("check", help="process and check every trial of a mapping, write nothing")
    check.add_argument("mapping", type=Path, metavar="MAPPING")
    check.set_defaults(run=_import, out=None)

    run = commands.add_parser("import", help="write a folder of trials")
    run.add_argument("mapping", type=Path, metavar="MAPPING")
    run.add_argument("--out", type=Path, required=True, metavar="DIR", help="a new folder")
    run.set_defaults(run=_import)
    return parser


def _clock(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--time", default="", metavar="NAME", help="column of time, in CSV and numpy files")
    parser.add_argument("--time-unit", default="", metavar="UNIT", help="s, ms, us or ns")
    parser.add_argument("--frame-rate", type=float, default=0.0, metavar="HZ", help="where that column counts frames")


def _triple(text: str) -> tuple[float, float, float]:
    parts = [float(part) for part in text.split(",")]
    if len(parts) != 3:
        raise argparse.ArgumentTypeError("it is three numbers in meters: X,Y,Z")
    return (parts[0], parts[1], parts[2])


def _inspect(options: argparse.Namespace) -> int:
    source = open_source(options.file, Clock(options.time, options.time_unit, options.frame_rate))
    channels = source.channels()
    rows = [(c.name, c.unit or "-", "-" if c.samples is None else f"{c.samples}") for c in channels]
    print(f"{options.file}: {source.format}, {len(channels)} channels")
    print(table(rows, ("channel", "unit", "samples")))
    for kind, facts in (("stated", source.conventions.stated), ("guess", source.conventions.guessed)):
        for name, (value, why) in facts.items():
            print(f'{name} = "{value}"  ({kind}: {why})')
    return 0


def _map(options: argparse.Namespace) -> int:
    if options.out.exists():
        raise TrialsError(options.out, "", "it is there already: remove it or name another file with --out")
    known = Known(
        clock=Clock(options.time, options.time_unit, options.frame_rate),
        body_name=options.body,
        tracked_point_to_origin_m=options.point_to_origin,
        water_level_m=options.water_level,
        depth_m=options.depth,
    )
    mapping = guess(options.files, options.vehicle, options.out, known)
    text = mapping_text(mapping, options.out.resolve().parent)
    options.out.write_text(text, encoding="utf-8")
    print(mapping_table(mapping))
    print(f"{options.out}: {len(mapping.trials)} trials, {len(mapping.guesses)} guesses to confirm")
    return 0


def _import(options: argparse.Namespace) -> int:
    mapping = Mapping.read(options.mapping)
    print(mapping_table(mapping), flush=True)
    progress = Progress()
    result = import_trials(mapping, options.out, progress.report)
    progress.clear()
    print(findings_table(result.findings))
    for finding in result.findings:
        if finding.level == "doubt" or (finding.level == "wrong" and finding.check in mapping.accept):
            print(f"warning: {finding}", file=sys.stderr)
    print(_summary(mapping, result, options.out))
    return 0


def _summary(mapping: Mapping, result: Result, out: Path | None) -> str:
    rows = sum(result.rows.values())
    done = f"{out}: {len(result.rows)} trials, {rows} rows" if out else f"{len(result.rows)} trials pass, {rows} rows"
    guesses = f", {len(mapping.guesses)} guesses in the mapping" if mapping.guesses else ""
    return f"{done}, {result.seconds:.1f} s{guesses}"


class Progress:
    """One line on standard error that rewrites itself; in a file a line each ten seconds."""

    def __init__(self) -> None:
        self.is_terminal = sys.stderr.isatty()
        self.last, self.shown = time.monotonic(), False

    def report(self, text: str, share: float) -> None:
        """Shows a step and its share, not more often than needed."""
        now = time.monotonic()
        if now - self.last < (0.2 if self.is_terminal else 10.0):
            return
        self.last, self.shown = now, True
        line = f"{text} {share:4.0%}" if share else text
        print(f"\r\x1b[K{line}" if self.is_terminal else line, end="" if self.is_terminal else "\n", file=sys.stderr)

    def clear(self) -> None:
        """Removes the line."""
        if self.is_terminal and self.shown:
            print("\r\x1b[K", end="", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
