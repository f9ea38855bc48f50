#!/usr/bin/env python3
"""Write the OpenFOAM case of the dam-break bore on a square column.

    case.py FOLDER --k 4 [--courant 0.5] [--model sst|laminar] [--bed noslip|slip] [--solver vof|iso]

`k` is the number of cells in half the width of the column (0.06 m): every edge of the mesh has a
fixed multiple of k cells, so that meshes of different k are geometrically similar. The mesh is the
half of the tank on one side of the symmetry plane of the column.
"""
import argparse
import math
from pathlib import Path

LEVEL, FILM, GATE = 0.30, 0.01, 0.40
XS = [0.0, GATE, 0.90, 1.02, 1.60]
X_CELLS = [7, 8, 2, 9]  # times k
YS = [0.0, 0.06, 0.305]
Y_CELLS = [1, 4]
ZS = [0.0, LEVEL, 0.60]
Z_CELLS = [9, 3]
Z_RATIO = [4.0, 2.2]  # last cell over first


def edges(start, end, count, ratio):
    """Edges of cells that grow geometrically, as blockMesh places them."""
    growth = ratio ** (1.0 / (count - 1))
    whole = sum(growth**i for i in range(count))
    points, height = [start], (end - start) / whole
    for _ in range(count):
        points.append(points[-1] + height)
        height *= growth
    return points


def header(kind, name):
    return f"FoamFile {{ version 2.0; format ascii; class {kind}; object {name}; }}\n"


def mesh(k, film=FILM):
    """Text of blockMeshDict and the water content of every cell in the order of blockMesh."""
    def vertex(i, j, l):
        return i + 5 * j + 15 * l

    blocks, water, faces = [], [], {name: [] for name in ("symmetry", "walls", "bed", "top", "column")}
    solid = {(2, 0)}
    for l in range(2):
        levels = edges(ZS[l], ZS[l + 1], Z_CELLS[l] * k, Z_RATIO[l])
        for j in range(2):
            for i in range(4):
                if (i, j) in solid:
                    continue
                corner = [vertex(i + a, j + b, l + c) for c in (0, 1) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
                n = (X_CELLS[i] * k, Y_CELLS[j] * k, Z_CELLS[l] * k)
                blocks.append(f"hex ({' '.join(map(str, corner))}) ({n[0]} {n[1]} {n[2]}) simpleGrading (1 1 {Z_RATIO[l]})")
                top = LEVEL if i == 0 else film
                for low, high in zip(levels, levels[1:]):
                    share = min(1.0, max(0.0, (top - low) / (high - low)))
                    share = 0.0 if share < 1e-9 else 1.0 if share > 1 - 1e-9 else share
                    water += [share] * (n[0] * n[1])
                c = corner
                sides = {
                    (i - 1, j): (c[0], c[4], c[7], c[3]), (i + 1, j): (c[1], c[2], c[6], c[5]),
                    (i, j - 1): (c[0], c[1], c[5], c[4]), (i, j + 1): (c[3], c[7], c[6], c[2]),
                }
                for (a, b), face in sides.items():
                    if (a, b) in solid:
                        faces["column"].append(face)
                    elif b < 0:
                        faces["symmetry"].append(face)
                    elif a in (-1, 4) or b == 2:
                        faces["walls"].append(face)
                if l == 0:
                    faces["bed"].append((c[0], c[3], c[2], c[1]))
                else:
                    faces["top"].append((c[4], c[5], c[6], c[7]))
    kinds = {"symmetry": "symmetryPlane", "walls": "wall", "bed": "wall", "top": "patch", "column": "wall"}
    points = "".join(f"({x} {y} {z})\n" for z in ZS for y in YS for x in XS)
    patches = "".join(
        f"{name} {{ type {kinds[name]}; faces ({' '.join('(' + ' '.join(map(str, f)) + ')' for f in fs)}); }}\n"
        for name, fs in faces.items())
    text = header("dictionary", "blockMeshDict") + f"vertices ({points});\nblocks ({' '.join(blocks)});\nboundary ({patches});\n"
    return text, water


def field(kind, name, dimensions, inside, patches):
    rows = "".join(f"    {patch} {{ {text} }}\n" for patch, text in patches.items())
    return header(kind, name) + f"dimensions [{dimensions}];\ninternalField {inside};\nboundaryField\n{{\n    symmetry {{ type symmetryPlane; }}\n{rows}}}\n"


def write(folder, options):
    folder = Path(folder)
    for name in ("0", "constant", "system"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    put = lambda path, text: (folder / path).write_text(text)
    block_mesh, water = mesh(options.k, options.film)
    put("system/blockMeshDict", block_mesh)
    listed = f"nonuniform List<scalar> {len(water)}\n(\n" + "\n".join(f"{w:.9g}" for w in water) + "\n)"
    put("0/alpha.water", field("volScalarField", "alpha.water", "0 0 0 0 0 0 0", listed, {
        '"(walls|bed|column)"': "type zeroGradient;", "top": "type inletOutlet; inletValue uniform 0; value uniform 0;"}))
    bed = "type slip;" if options.bed == "slip" else "type noSlip;"
    put("0/U", field("volVectorField", "U", "0 1 -1 0 0 0 0", "uniform (0 0 0)", {
        "walls": "type slip;", "bed": bed, "column": bed,
        "top": "type pressureInletOutletVelocity; value uniform (0 0 0);"}))
    put("0/p_rgh", field("volScalarField", "p_rgh", "1 -1 -2 0 0 0 0", "uniform 0", {
        '"(walls|bed|column)"': "type fixedFluxPressure; value uniform 0;", "top": "type totalPressure; p0 uniform 0; value uniform 0;"}))
    if options.model == "sst":
        for name, dims, value, wall in (("k", "0 2 -2 0 0 0 0", "1e-4", "kqRWallFunction"),
                                        ("omega", "0 0 -1 0 0 0 0", "10", "omegaWallFunction"),
                                        ("nut", "0 2 -1 0 0 0 0", "0", "nutkWallFunction")):
            top = "type calculated; value uniform 0;" if name == "nut" else f"type inletOutlet; inletValue uniform {value}; value uniform {value};"
            walls = f"type {wall}; value uniform {value};"
            slip = "type calculated; value uniform 0;" if name == "nut" else "type zeroGradient;"
            put(f"0/{name}", field("volScalarField", name, dims, f"uniform {value}", {
                "walls": slip, "bed": walls if options.bed == "noslip" else slip,
                "column": walls if options.bed == "noslip" else slip, "top": top}))
        turbulence = "simulationType RAS; RAS { RASModel kOmegaSST; turbulence on; printCoeffs off; }\n"
    else:
        turbulence = "simulationType laminar;\n"
    put("constant/turbulenceProperties", header("dictionary", "turbulenceProperties") + turbulence)
    put("constant/g", header("uniformDimensionedVectorField", "g") + "dimensions [0 1 -2 0 0 0 0];\nvalue (0 0 -9.81);\n")
    put("constant/transportProperties", header("dictionary", "transportProperties") +
        "phases (water air);\nwater { transportModel Newtonian; nu 1e-6; rho 1000; }\n"
        "air { transportModel Newtonian; nu 1.5e-5; rho 1; }\nsigma 0;\n")
    put("system/fvSchemes", header("dictionary", "fvSchemes") + """
ddtSchemes { default Euler; }
gradSchemes { default Gauss linear; limited cellLimited Gauss linear 1; }
divSchemes
{
    default none;
    div(rhoPhi,U) Gauss linearUpwind limited;
    div(phi,alpha) Gauss vanLeer;
    div(phirb,alpha) Gauss linear;
    div(phi,k) Gauss upwind;
    div(phi,omega) Gauss upwind;
    div(((rho*nuEff)*dev2(T(grad(U))))) Gauss linear;
}
laplacianSchemes { default Gauss linear uncorrected; }
interpolationSchemes { default linear; }
snGradSchemes { default uncorrected; }
wallDist { method meshWave; }
""")
    alpha = ("nAlphaCorr 2; nAlphaSubCycles 1; cAlpha 1; MULESCorr yes; nLimiterIter 5; solver smoothSolver; "
             "smoother symGaussSeidel; tolerance 1e-8; relTol 0;")
    if options.solver == "iso":
        alpha = "nAlphaBounds 3; snapTol 1e-12; clip true; isoFaceTol 1e-8; surfCellTol 1e-8; writeFields false; nAlphaSubCycles 1; cAlpha 1;"
    put("system/fvSolution", header("dictionary", "fvSolution") + f"""
solvers
{{
    "alpha.water.*" {{ {alpha} }}
    "pcorr.*" {{ solver PCG; preconditioner DIC; tolerance 1e-5; relTol 0; }}
    p_rgh {{ solver GAMG; smoother DIC; tolerance 5e-7; relTol 0.01; }}
    p_rghFinal {{ $p_rgh; relTol 0; }}
    "(U|k|omega)(|Final)" {{ solver smoothSolver; smoother symGaussSeidel; tolerance 1e-7; relTol 0.01; minIter 1; }}
}}
PIMPLE {{ momentumPredictor no; nOuterCorrectors 1; nCorrectors 2; nNonOrthogonalCorrectors 0; }}
relaxationFactors {{ equations {{ ".*" 1; }} }}
""")
    put("system/controlDict", header("dictionary", "controlDict") + f"""
application interFoam;
startFrom startTime; startTime 0; stopAt endTime; endTime {options.end};
deltaT 1e-4; adjustTimeStep yes; maxCo {options.courant}; maxAlphaCo {options.courant}; maxDeltaT 0.01;
writeControl adjustableRunTime; writeInterval 100; writeFormat ascii; timePrecision 9; runTimeModifiable no;
functions
{{
    column
    {{
        type forces; libs (forces); patches (column); rho rho; p p; U U; CofR (0.96 0 0);
        executeControl timeStep; writeControl timeStep; log no;
    }}
}}
""")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("folder")
    parser.add_argument("--k", type=int, default=4)
    parser.add_argument("--courant", type=float, default=0.5)
    parser.add_argument("--model", default="laminar", choices=["laminar", "sst"])
    parser.add_argument("--bed", default="slip", choices=["slip", "noslip"])
    parser.add_argument("--solver", default="vof", choices=["vof", "iso"])
    parser.add_argument("--film", type=float, default=FILM)
    parser.add_argument("--end", type=float, default=1.2)
    write(parser.parse_args().folder, parser.parse_args())
