"""The task `balance` of a frame in space: a planar machine in a tilted plane against the plane, engines against closed forms,
the machine with the printed counterweights, and the balance table of `--check`."""

import cmath
import math
import re

from balance import LINK, label, pasted
from balance import rows as balance_rows
from harness import Folder, Run, check, equal, near
from space import DATA, HOLDERS, rows
from engine_balance import PISTON, R, SPACING, SPEED, engine, factors, table
from space_studies import tilted

WEB = "&link name='web', from='O', to='A', mass=0, inertia=0 /\n"
SHAFT = """\
&mechanism name='{0}', origin=0.1,0.05,0, ratio={1} /
&joint mechanism='{0}', name='{0}.S', type='ground', position=0,0 /
&joint mechanism='{0}', name='{0}.P', type='crank', pivot='{0}.S', radius=0.02 /
"""
MASS = "&link name='{0}', from='{1}.S', to='{1}.P', mass=0, inertia=0, z={2} /\n"
TURNING = ("rigid_force_with_N", "rigid_force_against_N", "rigid_moment_with_Nm", "rigid_moment_against_Nm")


def tilted_tests():
    """The balance of a tilted planar machine is that of the plane."""
    # out of the plane there are always small values, as large as masses of 1e-10 of the others would cause
    for model, holder, more in (("exact", HOLDERS[0], ""), ("rest", HOLDERS[1], "&balance weight=0.8, about='origin' /\n"),
                                ("exact", HOLDERS[2], "&balance links='crank','rocker', radius=0.05,0.2 /\n&gravity {} /\n")):
        plane, space, axes = tilted("balance", model, 420, more, damping=80)
        plane, space = (text.replace("speed_rpm=420", f"speed_rpm=420, held_by={holder}") for text in (plane, space))
        down = ",".join(repr(-row[1]) for row in axes)
        plane, space = plane.replace("&gravity {}", "&gravity direction=-90"), space.replace("&gravity {}", f"&gravity direction={down}")
        what = f"tilted balance, {model}, {holder.split(',')[0]}"
        with Folder(plane=plane, space=space) as folder:
            if not all(Run(folder, "-q", "-s", "accuracy.tolerance=1e-12", f"{name}.nml").done(f"{what}: {name}") for name in (
                    "plane", "space")):
                continue
            for name in ("balance", "balance_links", "balance_harmonics"):
                flat, tall = (balance_rows(folder / which, name)[1] for which in ("plane", "space"))
                equal(f"{what}: {name}, rows", [(row["aim"], row["links"]) for row in tall], [(row["aim"], row["links"]) for row in flat])
                for key in flat[0]:
                    if "error" in key or key in ("psi_peak_rad", "xi_peak_m", "eta_peak_m"):
                        continue
                    if not isinstance(flat[0][key], float):
                        equal(f"{what}: {name}, {key}", [row[key] for row in tall], [row[key] for row in flat])
                        continue
                    top = max(abs(row[key]) for row in flat)
                    worst = max((abs(one[key] - other[key]), one["aim"], one["links"]) for one, other in zip(flat, tall))
                    # counterweights are accurate to the root of the mean square's error, 1e-9 where a sum is flat
                    near(f"{what}: {name}, {key} ({worst[1]}, {worst[2]})", worst[0], 0.0, 1e-9 * top + 1e-14)


def found(folder, aim="original", order=1):
    """The row of an order for the variant with this aim."""
    return next(row for row in balance_rows(folder, "balance_harmonics")[1] if (row["aim"], row["order"]) == (aim, str(order)))


def expect(what, row, sizes):
    """Compares force with and against the crank, and moment with and against it."""
    for key, size in zip(TURNING, sizes):
        near(f"{what}: {key}", row[key], size, 1e-10 * PISTON * R * SPEED**2)


def cylinder_tests():
    """A counterweight for half the reciprocating mass leaves a reverse force.

    It has constant size. For a V2 of 90 deg a counterweight for one piston leaves nothing.
    """
    unit = PISTON * R * SPEED**2
    for name, banks, pins, share, against in (("one cylinder", [0], [0], 0.5, 0.5), ("V2", [45, -45], [0, 0], 1.0, 0.0)):
        text = "&case tasks='balance' /\n&balance links='web', about='origin' /\n" + engine(pins, banks, [0] * len(pins)) + WEB
        with Folder(input=text) as folder:
            if not Run(folder, "-q", "input.nml").done(name):
                continue
            out = folder / "input"
            expect(f"{name}, found", found(out), (share * unit, against * unit, 0, 0))
            expect(f"{name}, balanced", found(out, "force"), (0, against * unit, 0, 0))
            weight = next(row for row in balance_rows(out, "balance_links")[1] if row["aim"] == "force")
            near(f"{name}: unbalance", weight["unbalance_kg_m"], share * PISTON * R, 1e-12 * PISTON * R)
            near(f"{name}: opposite to the pin", weight["center_x_m"], -R, 1e-12)
            row = found(out, "force")
            # a vector that turns has its amplitude along both axes
            for axis in "xy":
                near(f"{name}: constant, {axis}", row[f"rigid_f{axis}_N"], against * unit, 1e-10 * unit)


def turning_sums(pins, places):
    """The vectors of first order that turn with the crank: of forces over m r W^2/2, and of couples over that times the
    spacing."""
    return [abs(sum(place**power * cmath.exp(1j * math.radians(pin)) for pin, place in zip(pins, places))) for power in (0, 1)]


def shaft_tests():
    """Counterweights on a shaft remove all forces that turn with it.

    Force and couple at once, with the least unbalance. Two masses on a shaft turning in reverse remove the other half.
    """
    unit = PISTON * R * SPEED**2
    # twin 360, twin 180, three cylinders, four on a plane crankshaft: unbalance on each throw over m r/2
    cases = {"twin 360": ([0, 0], [-0.5, 0.5], [1, 1]), "twin 180": ([0, 180], [-0.5, 0.5], [1, 1]),
             "three": ([0, 240, 120], [-1, 0, 1], [math.sqrt(3) / 2, 0, math.sqrt(3) / 2]),
             "four": ([0, 180, 180, 0], [-1.5, -0.5, 0.5, 1.5], [0, 0, 0, 0])}
    for name, (pins, places, weights) in cases.items():
        force, couple = turning_sums(pins, places)
        webs = ["web"] + [f"c{k}.web" for k in range(1, len(pins))]
        text = "&case tasks='balance' /\n" + engine(pins, [0] * len(pins), places) + WEB + SHAFT.format("back", -1) + \
            MASS.format("front", "back", -0.2) + MASS.format("rear", "back", 0.3)
        throws, both = (f"&balance about='origin', radius=0.05, links={','.join(map(repr, links))} /\n"
                        for links in (webs, webs + ["front", "rear"]))
        with Folder(throws=text + throws, both=text + both) as folder:
            if not all(Run(folder, "-q", f"{which}.nml").done(f"{name}: {which}") for which in ("throws", "both")):
                continue
            sizes = (force * unit / 2, couple * unit / 2 * SPACING)
            expect(f"{name}, found", found(folder / "throws"), (sizes[0], sizes[0], sizes[1], sizes[1]))
            links = {row["on"]: row for row in balance_rows(folder / "throws", "balance_links")[1] if row["aim"] == "together"}
            equal(f"{name}: where", sorted(links), sorted(web for web, weight in zip(webs, weights) if weight > 0))
            if not any(weights):
                continue
            expect(f"{name}, throws", found(folder / "throws", "together"), (0, sizes[0], 0, sizes[1]))
            for web, weight in zip(webs, weights):
                if weight > 0:
                    near(f"{name}: {web}", links[web]["unbalance_kg_m"], weight * PISTON * R / 2, 1e-11 * PISTON * R)
            expect(f"{name}, both", found(folder / "both", "together"), (0, 0, 0, 0))
            links = {row["on"]: row for row in balance_rows(folder / "both", "balance_links")[1] if row["aim"] == "together"}
            # on the other shaft two masses for force and couple: u_f + u_r = f, z_f u_f + z_r u_r = c
            turned = [sum(place**power * cmath.exp(-1j * math.radians(pin)) for pin, place in zip(pins, places)) for power in (0, 1)]
            rear = (turned[1] * SPACING + 0.2 * turned[0]) / 0.5
            for web, size in (("rear", abs(rear)), ("front", abs(turned[0] - rear))):
                near(f"{name}: {web}", links[web]["unbalance_kg_m"], size * PISTON * R / 2, 1e-11 * PISTON * R)
            equal(f"{name}: z", (float(links["front"]["z_m"]), float(links["rear"]["z_m"])), (-0.2, 0.3))


def lanchester_tests():
    """Two shafts at twice the speed remove a four-cylinder's second order.

    Each shaft carries half of it, 4 m r A_2/(4 x 2).
    """
    pins, places = [0, 180, 180, 0], [-1.5, -0.5, 0.5, 1.5]
    text = "&case tasks='balance' /\n&balance links='a','b', about='origin' /\n" + engine(pins, [0] * 4, places) + WEB
    for name, ratio in (("a", 2), ("b", -2)):
        text += SHAFT.format(name, ratio).replace("0.1,0.05,0", "0,0,0").replace(f"name='{name}',", f"name='s{name}',", 1).replace(
            f"mechanism='{name}'", f"mechanism='s{name}'") + MASS.format(name, name, 0)
    with Folder(input=text) as folder:
        if not Run(folder, "-q", "input.nml").done("Lanchester"):
            return
        second = factors()[1]
        expect("Lanchester, found", found(folder / "input", order=2), (2 * PISTON * R * SPEED**2 * second,) * 2 + (0, 0))
        expect("Lanchester, with both", found(folder / "input", "together", 2), (0, 0, 0, 0))
        for row in balance_rows(folder / "input", "balance_links")[1]:
            near(f"Lanchester: {row['on']}, {row['aim']}", row["unbalance_kg_m"], PISTON * R * second / 2, 1e-11 * PISTON * R)


def pasted_tests():
    """The printed counterweights have the reported effect in a new run."""
    text = (DATA / "suspended_compressor.nml").read_text()
    text = re.sub(r"tasks = [^/]*/", "tasks = 'balance' /\n&response points=512 /\n&balance about='origin' /", text, count=1)
    with Folder(input=text) as folder:
        run = Run(folder, "input.nml")
        if not run.done("compressor"):
            return
        check("compressor: lines of the report", max(map(len, run.out.splitlines())) <= 80, "80 columns", run.out)
        check("compressor: table", "FORCE AND MOMENT VECTORS normal to the first shaft, rotating with and against" in run.flat, "a table", run.out)
        lines = pasted(run.out)
        variants = balance_rows(folder / "input")[1]
        equal("compressor: a block of lines for every variant", list(lines), [label(row) for row in variants[1:]])
        equal("compressor: z in all of them", sum(len(LINK.findall(block)) for block in lines.values()),
              sum(block.count(", z=") for block in lines.values()))
        orders = balance_rows(folder / "input", "balance_harmonics")[1]
        for row in variants:
            name = f"compressor, {label(row)}"
            (folder / "other.nml").write_text(text.replace("'balance'", "'response', 'forces'") + lines.get(label(row), ""))
            checked = Run(folder, "--check", "other.nml")
            if not (checked.done(f"{name}: --check") and Run(folder, "-q", "other.nml").done(name)):
                continue
            axes = table(checked.out, "SHAKING FORCES AND COUPLES")
            turning = table(checked.out, "normal to the first shaft") if "normal to the first shaft" in checked.out else {}
            for one in orders:
                if (one["aim"], one["links"]) != (row["aim"], row["links"]) or int(one["order"]) > 8:
                    continue
                for keys, words in ((("rigid_fx_N", "rigid_fy_N", "rigid_fz_N", "rigid_mx_Nm", "rigid_my_Nm", "rigid_mz_Nm"),
                                     axes[one["order"]]), (TURNING, turning.get(one["order"], [0.0] * 4))):
                    for key, word in zip(keys, words):
                        # five digits are printed; 1e-12 of the parts is rounding
                        near(f"{name}, order {one['order']}: {key}", one[key], word, 6e-5 * word + 2e-10)
            total = rows(folder / "other" / "supports.csv")[-1]
            near(f"{name}: force on the mounts", row["f_rms_N"], float(total["f_rms_N"]), 1e-8 * row["f_rms_N"])
            response = rows(folder / "other" / "response.csv")[:-1]
            moment = math.sqrt(sum(float(one[key])**2 for one in response for key in ("mx_Nm", "my_Nm", "m_Nm")) / len(response))
            # 512 rows of a smooth function
            near(f"{name}: moment on the mounts", row["m_rms_Nm"], moment, 1e-8 * moment)
            for dof in ("xi_peak_m", "zeta_peak_m", "rot_xi_peak_rad", "rot_eta_peak_rad"):
                top = max(abs(float(one[dof.replace("_peak", "")])) for one in response)
                near(f"{name}: {dof}", row[dof], top, 1e-3 * top)


def guided_tests():
    """Guides transmit the balanced forces to the ground."""
    text = re.sub(r"tasks = [^/]*/", "tasks = 'balance', 'forces' /", (DATA / "suspended_compressor.nml").read_text(), count=1)
    with Folder(input=text + "&balance links='pin' /\n") as folder:
        if Run(folder, "-q", "-s", "frame.dof='xi','zeta','rot_eta'", "input.nml").done("guided compressor"):
            row = balance_rows(folder / "input")[1][0]
            total = rows(folder / "input" / "supports.csv")[-1]
            near("guided compressor: force", row["f_rms_N"], float(total["f_rms_N"]), 1e-9 * row["f_rms_N"])
            equal("guided compressor: coordinates at rest", [row[name] for name in ("eta_peak_m", "psi_peak_rad", "rot_xi_peak_rad")],
                  [0.0] * 3)


def copy_tests():
    """The report warns that &repeat copies counterweights."""
    text = (DATA / "inline_twin.nml").read_text()
    text = re.sub(r"tasks = [^/]*/", "tasks = 'balance' /", text, count=1)
    with Folder(copies=text) as folder:
        run = Run(folder, "copies.nml")
        if run.done("copies"):
            check("copies: a line", "&repeat also copies a counterweight that you add to the original mechanism; this concerns the links web, rod" in run.flat, "a line", run.out)


SPACE_BALANCE_TESTS = [tilted_tests, cylinder_tests, shaft_tests, lanchester_tests, pasted_tests, guided_tests,
                       copy_tests]
