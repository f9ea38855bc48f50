#!/usr/bin/env python3
"""Puts published measurements through `wade gap` and says what the literature has missing beside what the tool says.

    python3 tests/real_measurements.py target/release/wade MEASUREMENTS [OUT]

MEASUREMENTS holds the folders named below as they were published (sources and licenses: crates/wade-gap-bench/src/real). None of them is
part of this repository; a folder that is not there is skipped, and the script says so. It is no part of the test suite.
"""

import csv
import json
import os
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml
import zipfile
from pathlib import Path

# importer, folder, settings, what the literature says
SOURCES = [
    (
        "kvlcc2",
        "kvlcc2_roll_decay",
        "least_trials = 3",
        "viscous roll damping: friction and eddies, linear and quadratic in the roll rate; at speed lift damping",
    ),
    (
        "rm2-rotor",
        "unh_rm2_rotor",
        "",
        "a force of the turning blades that grows with the tip-speed ratio: nothing of the library is meant for it",
    ),
    # two drops of three seconds are less than the method is made for: halves of them, in short blocks
    (
        "falling-balls",
        "ball_drops_desilva2020",
        "block_s = 0.3\nfolds = 3",
        "drag on the light balls (whiffle), nearly quadratic; nothing that shows on the heavy ones",
    ),
]
XLSX = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"


def sheets(path):
    """The rows of each sheet of an XLSX file, by its name; cells are text."""
    with zipfile.ZipFile(path) as book:
        texts = xml.fromstring(book.read("xl/sharedStrings.xml")).iter(XLSX + "si")
        shared = ["".join(t.text or "" for t in text.iter(XLSX + "t")) for text in texts]
        names = [sheet.get("name") for sheet in xml.fromstring(book.read("xl/workbook.xml")).iter(XLSX + "sheet")]
        for number, name in enumerate(names, 1):
            sheet = xml.fromstring(book.read(f"xl/worksheets/sheet{number}.xml"))
            yield name, [[cell(c, shared) for c in row.iter(XLSX + "c")] for row in sheet.iter(XLSX + "row")]


def cell(element, shared):
    value = element.findtext(XLSX + "v") or ""
    return shared[int(value)] if element.get("t") == "s" else value


def balls(folder, place):
    """The sheets as the importer wants them: a CSV file a ball, beside the table of masses."""
    place.mkdir()
    (place / "balls.txt").write_text((folder / "balls.txt").read_text())
    for name, rows in sheets(folder / "Ball_drops_data.xls"):
        wanted = [i for i, head in enumerate(rows[0]) if head in ("Drop #", "Time (s)", "Height (m)")]
        kept = [[row[i] for i in wanted] for row in rows if len(row) > max(wanted, default=0)]
        kept = [row for row in kept if all(row)]
        if len(wanted) == 3 and len(kept) > 20:
            with (place / (re.sub(r"\W", "", name) + ".csv")).open("w", newline="") as file:
                csv.writer(file).writerows(kept)
    return place


def halve(folder):
    """Cuts every trial of a folder in two."""
    for path in list(folder.glob("*.csv")):
        head, *rows = path.read_text().splitlines()
        for part, kept in (("a", rows[: len(rows) // 2]), ("b", rows[len(rows) // 2 :])):
            path.with_stem(path.stem + part).write_text("\n".join([head, *kept]) + "\n")
        path.unlink()
    manifest = folder / "trials.toml"
    kept = [line for line in manifest.read_text().splitlines() if not line.startswith("repeats")]
    manifest.write_text("\n".join(kept) + "\n")


def verdict(wade, trials, out, settings):
    vehicle = re.search(r'^vehicle = "(.*)"', (trials / "trials.toml").read_text(), re.MULTILINE).group(1)
    command = [wade, "gap", "--vehicle", vehicle, "--trials", trials, "--out", out, "--config", settings]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "RUST_BACKTRACE": "0"})
    if done.returncode != 0:
        return "refused: " + done.stderr.strip().splitlines()[-1]
    report = json.loads((out / "report.json").read_text())
    values = [
        f"{effect['name']} {name} = {p['value']:.3g} +- {p['std']:.2g}"
        for effect in report["effects"]
        for name, p in effect["parameters"].items()
    ]
    return "; ".join([f"{report['verdict']}: {report['summary']}", *values])


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    wade, measurements = sys.argv[1], Path(sys.argv[2])
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(sys.argv[3] if len(sys.argv) == 4 else scratch)
        out.mkdir(exist_ok=True)
        settings = Path(scratch) / "settings.toml"
        for importer, name, text, literature in SOURCES:
            folder = measurements / name
            if not folder.is_dir():
                print(f"{importer}: skipped: {folder} is not there")
                continue
            settings.write_text(text + "\n")
            source = balls(folder, Path(scratch) / "balls") if importer == "falling-balls" else folder
            trials = out / "trials" / importer
            command = [wade, "gap", "bench", "import", importer, "--from", source, "--out", trials]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            print(f"{importer}\n  literature: {literature}")
            folders = [trials] if (trials / "trials.toml").exists() else sorted(trials.iterdir())
            for one in folders:
                if importer == "falling-balls":
                    halve(one)
                print(f"  {one.name}: {verdict(wade, one, out / one.name, settings)}", flush=True)


if __name__ == "__main__":
    main()
