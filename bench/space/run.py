"""Compares the time of the same machine in space and in the plane, and of the exact frame and the frame about rest:
python3 bench/space/run.py PROGRAM

Sweeps of single solutions over a mount's stiffness by one thread, to 1e-9: Watt's six-bar beside the middle plane and the suspended
compressor of validation/space, with six degrees of freedom and with the three of the plane. Processor microseconds a point, the
shortest of five alternating runs, minus the time of a sweep of two points.
"""
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
POINTS, TURNS = 2000, 5
PLANE = "dof='xi','eta','psi' /"


def inputs(name):
    """The machine in space and in the plane, about rest, and the exact machine in space."""
    text = (ROOT / "validation" / "space" / f"{name}.nml").read_text()
    text = re.sub(r"&case title = ('[^']*') /", "&case title = \\1, tasks='sweep' /\n&model frame='rest' /\n"
                  "&accuracy tolerance=1e-9 /", text)
    text += "&sweep parameter='support(1).stiffness(1)', from=900, to=1100, count=COUNT, engine='direct', columns=COLUMNS /\n"
    plane = re.sub(r"dof=('\w+',?\s*)+/", PLANE, text)
    plane = re.sub(r"(&mechanism[^\n]*?), axis=[\d.,-]+", r"\1", plane)
    plane = re.sub(r"angle=([-\d.]+)(,[-\d.]+)+", r"angle=\1", plane)
    return {"plane": plane, "space": text, "exact": text.replace("frame='rest'", "frame='exact'")}


def seconds(program, text, folder):
    """Processor time of a run in seconds."""
    (folder / "input.nml").write_text(text)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([program, "-q", "input.nml"], cwd=folder, check=True, env=os.environ | {"OMP_NUM_THREADS": "1"})
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    program = os.path.abspath(sys.argv[1])
    print("machine               columns         plane   space   space/plane   exact   exact/rest  (us a point)")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for machine in ("watt_beside", "suspended_compressor"):
            texts = inputs(machine)
            for columns in ("'rho_max','verdict'", "'rho_max','verdict','xi_peak_m'"):
                least = {kind: 1e9 for kind in texts}
                for _ in range(TURNS):
                    for kind, text in texts.items():
                        text = text.replace("COLUMNS", columns)
                        long, short = (seconds(program, text.replace("COUNT", str(count)), folder) for count in (POINTS, 2))
                        least[kind] = min(least[kind], (long - short) / (POINTS - 2) * 1e6)
                print(f"{machine:22}{'verdict' if 'peak' not in columns else 'and peaks':12}{least['plane']:8.0f}{least['space']:8.0f}"
                      f"{least['space'] / least['plane']:10.1f}{least['exact']:12.0f}{least['exact'] / least['space']:11.1f}")


if __name__ == "__main__":
    main()
