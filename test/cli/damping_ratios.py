"""Damping ratios of supports and of the whole mounting: dampers and exponents against closed forms."""

import math

from harness import Folder, Run, Table, check, equal, near
from space import rows

# A rotor balanced about F: constant coefficients. Mass and moments of inertia of the whole machine (kg, kg m^2).
MASS, INERTIA = 50.0, 1.7
PLANE = """\
&drive speed_rpm = 600 /
&mass_functions mass=4, inertia=0.2 /
&frame mass=46, inertia=1.5, origin=0,0 /
"""
SPACE = """\
&drive speed_rpm = 600 /
&joint name='O', type='ground', position=0,0 /
&joint name='A', type='crank', pivot='O', radius=0.05 /
&link name='crank', from='O', to='A', mass=4, inertia=0.1,0.1,0.2, center=0.01,0.02 /
&frame mass=46, inertia=1.2,1.4,1.5, origin=0.02,0.05,0.1, dof='xi','eta','psi','zeta','rot_xi','rot_eta' /
&support position= 0.3,-0.1, 0.2, stiffness=2e5,3e5,1e5, angle=10,20,30 /
&support position=-0.3,-0.1, 0.2, stiffness=2e5,1e5,2e5, damping=0,0,0 /
&support position= 0.0,-0.2,-0.4, stiffness=1e5,2e5,3e5 /
"""
REST = ("-s", "model.frame='rest'")


def frequencies(folder, text, *settings):
    """Frequencies (rad/s) and damping ratios of the machine's modes."""
    (folder / "input.nml").write_text(text)
    run = Run(folder, "-q", "--check", "--plot", "input.nml", *settings)
    if not run.done("frequencies"):
        return []
    return [(float(row["angular_frequency_rad_s"]), float(row["damping_ratio"])) for row in rows(folder / "input/frequencies.csv")]


def test_supports():
    """Equal ratios of all supports are the ratios of displacements without rotation.

    The supports lie symmetrically at the height of F, so that no modes are coupled. With b = 2 D k / w the rotation, of the
    stiffness sum k x^2, has the ratio D w_psi / w_eta.
    """
    for ratio, kx, ky, x in ((0.05, 2e5, 3e5, 0.2), (0.4, 1e5, 4e5, 0.1)):
        text = PLANE + "".join(f"&support position={side * x},0, stiffness={kx},{ky}, damping_ratio={ratio} /\n" for side in (-1, 1))
        along = [math.sqrt(2 * k / MASS) for k in (kx, ky)]
        psi = math.sqrt(2 * ky * x * x / INERTIA)
        expected = sorted([(along[0], ratio), (along[1], ratio), (psi, ratio * psi / along[1])])
        with Folder() as folder:
            found = frequencies(folder, text)
            equal(f"ratio {ratio}: modes", len(found), 3)
            for (w, d), (wanted, share) in zip(found, expected):
                near(f"ratio {ratio}: frequency", w, wanted, 1e-12 * wanted)
                near(f"ratio {ratio}: damping ratio", d, share, 1e-9)
    # supports at an angle, with different stiffnesses along xi and eta: the stiffness along 30 deg is 2e5 cos^2 + 4e5 sin^2
    with Folder() as folder:
        text = PLANE.replace("/\n&mass", "/\n&model frame='rest' /\n&case tasks='matrices' /\n&mass") + (
            "&foundation stiffness=1e5,0,0, 0,3e5,0, 0,0,1e4, damping=7,0,0 /\n"
            "&support position=0,0, stiffness=1e5,1e5, damping=11,0, angle=30, damping_ratio=0.1 /\n")
        (folder / "input.nml").write_text(text)
        run = Run(folder, "-q", "input.nml")
        if run.done("support at an angle"):
            table = Table(folder / "input/matrices.csv")
            c, s = math.cos(math.pi / 6), math.sin(math.pi / 6)
            first, second = (0.2 * 1e5 * math.sqrt(MASS / (2e5 * p * p + 4e5 * q * q)) for p, q in ((c, s), (s, c)))
            first += 11
            for name, wanted in (("b_xi_xi_Ns_m", 7 + first * c * c + second * s * s), ("b_eta_eta_Ns_m", first * s * s + second * c * c),
                                 ("b_xi_eta_Ns_m", (first - second) * c * s)):
                near(f"support at an angle: {name}", table[name][0], wanted, 1e-12 * abs(first))


def test_whole_mounting():
    """A ratio of the whole mounting is the ratio of every mode.

    With averaged coefficients the exponents have the real parts -D w, where w are the frequencies without damping.
    """
    plane = PLANE + "&support position=-0.2,-0.1, stiffness=1e5,3e5, angle=20 /\n&support position=0.3,-0.2, stiffness=2e5,1e5 /\n"
    for name, text, count in (("plane", plane, 3), ("space", SPACE, 6), ("two dofs", plane.replace("=0,0 /", "=0,0, dof='xi','psi' /"), 2)):
        for ratio in (0.03, 0.25):
            settings = ("-s", f"foundation.damping_ratio={ratio}", "-s", "model.coefficients='averaged'", *REST)
            with Folder() as folder:
                # the rotor's gyroscopic moments, which the ratio does not include, are removed by a slow speed
                slow = text.replace("speed_rpm = 600", "speed_rpm = 1e-3") if name == "space" else text
                found = frequencies(folder, slow, "-s", f"foundation.damping_ratio={ratio}")
                equal(f"{name}, {ratio}: modes", len(found), count)
                for w, d in found:
                    near(f"{name}, {ratio}: damping ratio", d, ratio, 1e-6)
                if name == "space":
                    continue
                run = Run(folder, "-q", "-s", "case.tasks='stability'", "input.nml", *settings)
                if run.done(f"{name}, {ratio}"):
                    growth = sorted(Table(folder / "input/multipliers.csv")["exponent_re_per_s"], reverse=True)
                    for (w, _), pair in zip(sorted(found), zip(growth[::2], growth[1::2])):
                        for value in pair:
                            near(f"{name}, {ratio}: real part of the exponent", value, -ratio * w, 1e-9 * w)


def test_ratio_follows_the_machine():
    """In a sweep over the frame's mass the dampers follow the mass."""
    text = PLANE + ("&support position=-0.2,-0.1, stiffness=1e5,3e5, damping_ratio=0.1 /\n&support position=0.3,-0.2, stiffness=2e5,1e5 /\n"
                    "&foundation damping_ratio=0.02 /\n&sweep parameter='frame.mass', from=20, to=80, count=3 /\n")
    with Folder(input=text) as folder:
        if not Run(folder, "-q", "-s", "case.tasks='sweep'", *REST, "input.nml").done("sweep over the mass"):
            return
        swept = [float(row["rho_max"]) for row in rows(folder / "input/sweep.csv")]
        for mass, rho in zip((20, 50, 80), swept):
            Run(folder, "-q", "-s", "case.tasks='stability'", *REST, "-s", f"frame.mass={mass}", "-o", "one", "input.nml").done("one mass")
            near(f"rho at {mass} kg", rho, Table(folder / "one/multipliers.csv")["abs"][0], 1e-8)
        check("masses differ", swept[0] != swept[2], "different multipliers", swept)


DAMPING_RATIO_TESTS = (test_supports, test_whole_mounting, test_ratio_follows_the_machine)
