#!/usr/bin/env python3
"""Mean depth and speed of the water along the channel: profile.py CASE/TIME WIDTH

Needs the fields of `postProcess -func writeCellCentres` and `-func writeCellVolumes` in the folder.
"""
import re
import sys
from pathlib import Path

STEP = 0.2  # [m]


def field(path):
    text = path.read_text()
    text = text[text.index("internalField"):]
    start = text.index("(") + 1
    return [float(v) for v in text[start:text.index("\n)", start)].split()]


folder, width = Path(sys.argv[1]), float(sys.argv[2])
velocity = (folder / "U").read_text()
velocity = velocity[velocity.index("internalField"):velocity.index("boundaryField")]
along = [float(m.split()[0]) for m in re.findall(r"\(([^()]+)\)", velocity)]
bins = {}
for alpha, x, v, u in zip(field(folder / "alpha.water"), field(folder / "Cx"), field(folder / "V"), along):
    cell = bins.setdefault(int(x // STEP), [0.0, 0.0])
    cell[0] += alpha * v
    cell[1] += alpha * v * u
print("x_m,depth_m,speed_mps")
for i, (volume, flux) in sorted(bins.items()):
    print(f"{STEP * (i + 0.5):.1f},{volume / (STEP * width):.4f},{-flux / volume:.3f}")
