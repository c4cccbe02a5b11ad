"""Compares a design by the program with one by SciPy with the same library: python3 bench/design/run.py PROGRAM LIBRARY

The paper's machine with two counterweights, six parameters, the rms of the force on the ground, limits on mass and torque. SciPy's
SLSQP has its own differences, and sees the torque at the angles of power.csv; it starts where the program does. Processor seconds,
the shortest of three runs each. Needs scipy.
"""
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
MACHINE = """\
&case tasks='design' / &model frame='rest' / &drive speed_rpm=240 /
&joint name='A0', type='ground', position=0,0 / &joint name='B0', type='ground', position=0.40,0 /
&joint name='A', type='crank', pivot='A0', radius=0.07 /
&joint name='B', type='RRR', ends='A','B0', lengths=0.37,0.16, branch=1 /
&link name='crank', from='A0', to='A', mass=0.50, inertia=0.0035, center=0.03,0 /
&link name='coupler', from='A', to='B', mass=0.60, inertia=0.0070, center=0.18,0 /
&link name='rocker', from='B0', to='B', mass=0.25, inertia=0.0060, center=0.08,0 /
&link name='one', from='A0', to='A', mass=1, inertia=0, center=0,0 /
&link name='two', from='B0', to='B', mass=1, inertia=0, center=0,0 /
&frame mass=18, inertia=0.78, origin=-0.20,0.20 /
&support position=-0.30,-0.20, stiffness=4e5,4e5, damping=200,200 /
&support position=0.30,-0.20, stiffness=4e5,4e5, damping=200,200 /
"""
PARAMETERS = [(f"link({name}).{key}", *ends) for name in ("one", "two")
              for key, ends in (("center(1)", (-0.1, 0.1)), ("center(2)", (-0.1, 0.1)), ("mass", (0.1, 2.0)))]
ORDER = "".join(f"&design parameter='{path}', from={low}, to={high}, starts=1 /\n" for path, low, high in PARAMETERS)
ORDER += ("&objective quantity='f', measure='rms' /\n&constraint quantity='added_mass', at_most=-0.8 /\n"
          "&constraint quantity='torque', measure='peak', at_most=1.5 /\n")
SPEEDS = "&sweep parameter='drive.speed_rpm', from=150, to=240, count=50 /\n"

SCIPY = """
import resource, sys
import numpy, gestell, scipy.optimize
parameters, speeds = eval(sys.argv[2]), eval(sys.argv[3])
machine = gestell.Machine(sys.argv[1])
solved = 0
def goals(x):
    global solved
    for (path, low, high), value in zip(parameters, x):
        machine[path] = float(value)
    force, torque = [], []
    for speed in speeds:
        machine["drive.speed_rpm"] = float(speed)
        solution = machine.solve("response, power")
        force.append(float(solution.response("f").rms))
        torque.append(float(abs(solution.table("power")["torque_Nm"]).max()))
        solved += 1
    return max(force), max(torque)
known = {}
def cached(x):
    key = tuple(x)
    if key not in known:
        known.clear()
        known[key] = goals(x)
    return known[key]
before = goals([0, 0, 1, 0, 0, 1])
begin = resource.getrusage(resource.RUSAGE_SELF).ru_utime
solved = 0
found = scipy.optimize.minimize(lambda x: cached(x)[0] / before[0], [0, 0, 1, 0, 0, 1], method="SLSQP",
                                bounds=[(low, high) for path, low, high in parameters],
                                constraints=[{"type": "ineq", "fun": lambda x: 1.2 - x[2] - x[5]},
                                             {"type": "ineq", "fun": lambda x: 1.5 - cached(x)[1]}],
                                options={"maxiter": 200, "ftol": 1e-10})
print(resource.getrusage(resource.RUSAGE_SELF).ru_utime - begin, goals(found.x)[0], solved)
"""


def by_program(program, file, folder):
    """Processor seconds from start to exit, the force, machines solved."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run([program, "-o", folder / "out", file], check=True, capture_output=True, text=True,
                          env=dict(os.environ, OMP_NUM_THREADS="1"))
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    goal = (folder / "out" / "design_goals.csv").read_text().splitlines()
    row = [line for line in goal if line.startswith("objective")][0].split(",")
    return seconds, float(row[6]), int(re.search(r"(\d+) machines solved", done.stdout)[1])


def by_scipy(library, file, speeds):
    environment = dict(os.environ, GESTELL_LIBRARY=str(library), PYTHONPATH=str(ROOT / "python"), OPENBLAS_NUM_THREADS="1")
    done = subprocess.run([sys.executable, "-c", SCIPY, file, repr(PARAMETERS), repr(speeds)], check=True, capture_output=True,
                          text=True, env=environment)
    seconds, force, solved = done.stdout.split()
    return float(seconds), float(force), int(solved)


def main():
    program, library = sys.argv[1:]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        bare = folder / "machine.nml"
        bare.write_text(MACHINE.replace("'design'", "'response','power'"))
        for what, text, speeds in (("one speed", "", [240.0]), ("50 speeds", SPEEDS, [150 + 90 * k / 49 for k in range(50)])):
            file = folder / "design.nml"
            file.write_text(MACHINE + ORDER + text)
            ours = min(by_program(program, file, folder) for turn in range(3))
            theirs = min(by_scipy(library, bare, speeds) for turn in range(3 if not text else 1))
            print(f"{what}: program {ours[0]:.3f} s, {ours[2]} machines, force {ours[1]:.6f} N; SciPy {theirs[0]:.3f} s, "
                  f"{theirs[2]} solutions, force {theirs[1]:.6f} N; ratio {theirs[0] / ours[0]:.0f}")


if __name__ == "__main__":
    main()
