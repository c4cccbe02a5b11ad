"""A flywheel of finite inertia in Exudyn, compared with held_by='flywheel', which assumes a heavy one.

    python flywheel.py GESTELL INPUT [INERTIA ...]

builds the machine as compare.py does, with a flywheel on the crank and a constant torque between crank and frame instead of a
held speed. The fixed point of the map of one turn has the torque, the crank's speed at its phase and the frame's state as
unknowns. Printed are psi's orders, their largest difference from Gestell's, which falls as the fluctuation of the speed, that
is as 1/inertia, and the coefficient of irregularity of both.
"""

import csv
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import exudyn as exu
import numpy as np
from compare import ROWS, STEP, STEPS, Machine, Model


class Free(Model):
    """State, speed of the crank at its phase and torque over a turn."""

    def __init__(self, machine, recording=False):
        super().__init__(machine, recording, free=True)

    def turn_free(self, x):
        self.initial = x[6]
        for load, sign in zip(self.loads, (-1.0, 1.0)):
            self.mbs.SetLoadParameter(load, "load", sign * x[7])
        ends = []
        for steps in (STEPS, 2 * STEPS):
            state = self.integrate(x[:6], steps)
            data = self.mbs.systemData
            at = 3 * self.driven + 2
            ends.append(np.array([*state, data.GetODE2Coordinates_t()[at], data.GetODE2Coordinates()[at] - 2 * np.pi]))
        return ends[1] + (ends[1] - ends[0]) / 3

    def periodic_free(self, x, scale):
        """Finds the periodic solution: state and speed return after a turn; the torque is such that the angle has advanced by a
        turn."""
        def miss(y):
            return self.turn_free(y) - np.array([*y[:7], 0.0])

        for _ in range(4):
            slope = np.array([(miss(x + scale * unit) - miss(x - scale * unit)) / (2 * scale @ unit) for unit in np.eye(8)]).T
            change = np.linalg.solve(slope, -miss(x))
            x = x + change
            if np.all(abs(change) < 1e-9 * (abs(x) + scale)):
                break
        return x


def amplitudes(values):
    return 2 * abs(np.fft.rfft(values[:-1]))[1:7] / (len(values) - 1)


def main():
    program, file, *inertias = sys.argv[1:]
    for inertia in map(float, inertias or ["0.3", "3", "30"]):
        text = re.sub(r"(&drive[^/]*)/", rf"\1, held_by='flywheel', flywheel_inertia={inertia!r} /", Path(file).read_text())
        with tempfile.TemporaryDirectory() as folder:
            case = Path(folder) / "case.nml"
            case.write_text(text)
            report = subprocess.run([program, "-o", folder, "-s", "case.tasks=response,power", "-s", f"response.points={ROWS}", str(case)],
                                  check=True, capture_output=True, text=True).stdout
            tables = {}
            for name in ("response", "power"):
                with open(Path(folder) / f"{name}.csv") as lines:
                    tables[name] = list(csv.DictReader(line for line in lines if not line.startswith("#")))
        ours = np.array([float(row["psi_rad"]) for row in tables["response"]])
        names = [f"{name}{end}" for end in ("", "_dot") for name in ("xi", "eta", "psi")]
        columns = [next(key for key in tables["response"][0] if re.match(rf"{name}_(m|rad|m_s|rad_s)$", key)) for name in names]
        state = [float(tables["response"][0][column]) for column in columns]
        speed = np.array([float(row["speed_fluctuation_rad_s"]) for row in tables["power"]])
        mean = np.mean([float(row["torque_Nm"]) for row in tables["power"][:-1]])
        machine = Machine(text)
        crank = next(joint for joint in machine.joints.values() if joint["type"][0] == "crank")
        for link in machine.links:
            if link["from"] == crank["pivot"] and link.get("to") == crank["name"]:
                link["inertia"][0] += inertia
        scale = STEP * np.array([1.0, 1.0, 1.0, *3 * [abs(machine.speed)], abs(machine.speed), 1.0e3])
        x = Free(machine).periodic_free(np.array([*state, machine.speed + speed[0], mean]), scale)
        recorder = Free(machine, recording=True)
        recorder.turn_free(x)
        data = np.array([[recorder.mbs.GetSensorStoredData(sensor) for sensor in pair] for pair in recorder.sensors])
        theirs, rate = data[0, 0, :, 3], data[recorder.driven, 1, :, 3]
        irregular = re.search(r"coefficient of irregularity (\S+)", report)[1]
        one, other = amplitudes(ours), amplitudes(theirs)
        print(f"{inertia:g} kg m^2: coefficient of irregularity {irregular}, Exudyn {np.ptp(rate) / machine.speed:.4g}; psi's orders 1 "
              f"and 2 {one[0]:.6e}, {one[1]:.6e}, Exudyn {other[0]:.6e}, {other[1]:.6e}; off by {max(abs(one - other)) / max(one):.1e}; "
              f"torque {mean:.6f} N m, Exudyn {x[7]:.6f}", flush=True)


if __name__ == "__main__":
    exu.config.printToConsole = False
    main()
