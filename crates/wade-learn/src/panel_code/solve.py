"""Added mass and damping of panels by capytaine: JSON in from standard input, JSON out, a line of progress a solution.

In: {"cases": [{"level": m, "depth": m or null, "panels": [[[x, y, z] * 4] ...]}], "frequencies": [rad/s]}; body frame.
Out: a line {"case": i, "mass": [[6] * 6], "waves": [{"mass": [[6] * 6], "damping": [[6] * 6]} a frequency]} a case, the
first mass of infinite frequency; about the body origin, density 1.
"""

import json
import sys

import capytaine
import numpy

MODES = ["Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw"]


def solved(solver, case, frequency):
    """Added mass and damping matrices of one case at one frequency."""
    panels = numpy.array(case["panels"])
    panels[:, :, 2] -= case["level"]
    faces = numpy.arange(4 * len(panels)).reshape(-1, 4)
    mesh = capytaine.Mesh(vertices=panels.reshape(-1, 3), faces=faces)
    origin = (0.0, 0.0, -case["level"])
    body = capytaine.FloatingBody(mesh, dofs=capytaine.rigid_body_dofs(rotation_center=origin))
    depth = numpy.inf if case["depth"] is None else case["depth"]
    mass, damping = numpy.zeros((6, 6)), numpy.zeros((6, 6))
    for column, mode in enumerate(MODES):
        problem = capytaine.RadiationProblem(
            body=body, omega=frequency, radiating_dof=mode, rho=1.0, g=9.81, water_depth=depth
        )
        result = solver.solve(problem)
        for row, influenced in enumerate(MODES):
            mass[row, column] = result.added_mass[influenced]
            damping[row, column] = result.radiation_damping[influenced]
    return mass, damping


def main():
    capytaine.set_logging("ERROR")
    task = json.load(sys.stdin)
    solver = capytaine.BEMSolver()
    for index, case in enumerate(task["cases"]):
        mass, _ = solved(solver, case, numpy.inf)
        waves = []
        for frequency in task["frequencies"]:
            own, damping = solved(solver, case, frequency)
            waves.append({"mass": own.tolist(), "damping": damping.tolist()})
        print(json.dumps({"case": index, "mass": mass.tolist(), "waves": waves}), flush=True)


main()
