"""The task `balance`: its printed counterweights, pasted into the input, have the effect that it reports."""

import csv
import math
import re

from broken_inputs import SOUND
from broken_mechanisms import functions
from harness import Folder, Run, check, equal, files, near
from plots import GNUPLOT, sound_picture

BALANCED = SOUND.replace("'stability', 'response'", "'balance'")
WHOLE = "'stability', 'response', 'forces'"
HEADER = ("aim,links,added_mass_kg,rigid_f_rms_N,rigid_f_peak_N,rigid_m_rms_Nm,rigid_m_peak_Nm,f_rms_N,f_rms_error_N,f_peak_N,"
          "f_peak_error_N,m_rms_Nm,m_rms_error_Nm,m_peak_Nm,m_peak_error_Nm,xi_peak_m,xi_peak_error_m,eta_peak_m,"
          "eta_peak_error_m,psi_peak_rad,psi_peak_error_rad,verdict")
MILLIMETRES = """\
&case tasks = 'balance' /
&units length='mm', mass='g' /
&drive speed_rpm = 240.0 /
&joint name='A0', type='ground', position=0, 0 /
&joint name='B0', type='ground', position=400, 0 /
&joint name='A', type='crank', pivot='A0', radius=70, phase=0.0 /
&joint name='B', type='RRR', ends='A','B0', lengths=370,160, branch=1 /
&link name='crank', from='A0', to='A', mass=500, inertia=0.0035, center=30,4 /
&link name='coupler', from='A', to='B', mass=600, inertia=0.0070, center=180,0 /
&link name='it''s the rocker', from='B', to='B0', mass=250, inertia=0.0060, center=80,0 /
&frame mass=18000, inertia=0.78, origin=-200,200 /
&support position=-300,-200, stiffness=4e5,4e5, damping=100,100 /
&support position=300,-200, stiffness=4e5,4e5, damping=100,100 /
&balance radius=40, links='it''s the rocker' /
"""
LINK = re.compile(r"  &link [^/]*/\n")


def rows(folder, name="balance"):
    """The rows of a table with their numbers."""
    lines = [line for line in (folder / f"{name}.csv").read_text().splitlines() if line[0] != "#"]
    found = list(csv.DictReader(lines))
    for row in found:
        for key, word in row.items():
            if re.fullmatch(r"-?\d\.\d{16}E[+-]\d{3}|NaN", word):
                row[key] = float(word)
    return lines[0], found


def pasted(report):
    """The printed lines of each variant, by its label."""
    text = report[report.index("COUNTERWEIGHTS as &link groups"):]
    return {part.split("\n")[0]: "".join(LINK.findall(part)) for part in text.split("  ! ")[1:]}


def label(row):
    return {"original": "original", "complete": "complete", "together": "together, for force"}.get(
        row["aim"], f"{row['links']}, for {row['aim']}")


def compare(what, text, folder, report):
    """Compares every variant with a run of the input that contains its links: mounted values, verdict and orders."""
    lines = pasted(report)
    _, found = rows(folder / "input")
    _, orders = rows(folder / "input", "balance_harmonics")
    equal(f"{what}: a block of lines for every variant", list(lines), [label(row) for row in found[1:]])
    for row in found:
        name = f"{what}, {label(row)}"
        (folder / "other.nml").write_text(text.replace("'balance'", WHOLE) + lines.get(label(row), ""))
        if not Run(folder, "-q", "other.nml").done(name):
            continue
        total = rows(folder / "other", "supports")[1][-1]
        _, response = rows(folder / "other", "response")
        harmonics = rows(folder / "other", "supports_harmonics")[1]
        for key in ("f_rms_N", "f_peak_N", "m_rms_Nm", "m_peak_Nm"):
            # the lines have 12 digits; near a resonance (order 8 of the four-bar) an error of the mass counts some hundred times
            near(f"{name}: {key}", row[key], total[key], 1e-8 * total[key] + 1e-10)
        for key in ("xi_peak_m", "eta_peak_m", "psi_peak_rad"):
            greatest = max(abs(one[key.replace("_peak", "")]) for one in response)
            # between 360 rows a peak of a few orders is missed by less than this
            near(f"{name}: {key}", row[key], greatest, 2e-3 * greatest + 1e-12)
        for one in orders:
            if (one["aim"], one["links"]) == (row["aim"], row["links"]):
                total_order = [h for h in harmonics if h["order"] == one["order"]][0]
                force = math.hypot(total_order["fx_total_N_amplitude"], total_order["fy_total_N_amplitude"]) / math.sqrt(2)
                near(f"{name}: order {one['order']}", one["f_rms_N"], force, 1e-7 * row["f_rms_N"] + 1e-10)
        verdict = (folder / "other" / "supports.csv").read_text().split("# verdict: ")[1].split()[0].rstrip(":")
        equal(f"{name}: verdict", row["verdict"], verdict)


def test_four_bar():
    """The task balance finds the complete balance of a four-bar."""
    with Folder(input=BALANCED) as folder:
        run = Run(folder, "input.nml")
        if not run.done("balance"):
            return
        equal("balance: files", files(folder / "input"), ["balance.csv", "balance_harmonics.csv", "balance_links.csv"])
        header, found = rows(folder / "input")
        equal("balance: header", header, HEADER)
        equal("balance: rows", [(row["aim"], row["links"]) for row in found], [
            ("original", ""), ("force", "crank"), ("moment", "crank"), ("sum", "crank"), ("moment", "coupler"), ("force", "rocker"),
            ("moment", "rocker"), ("sum", "rocker"), ("complete", "crank rocker")])
        # Berkof and Lowen (1969), at the links' lengths
        _, links = rows(folder / "input", "balance_links")
        for row, unbalance, length in zip(links[-2:], (0.0365675675675676, 0.0667027027027027), (0.07, 0.16)):
            near(f"balance: {row['name']}", row["unbalance_kg_m"], unbalance, 1e-14)
            near(f"balance: {row['name']}, mass", row["mass_kg"], unbalance / length, 1e-12)
            near(f"balance: {row['name']}, place", row["center_x_m"], -length, 1e-12)
            near(f"balance: {row['name']}, place across", row["center_y_m"], 0, 1e-12)
        equal("balance: no residual force", (found[-1]["rigid_f_rms_N"], found[-1]["rigid_f_peak_N"]), (0, 0))
        equal("balance: the best of each aim", [min(row[key] for row in found[1:-1] if row["aim"] == aim) ==
                                                min(row[key] for row in found[:-1])
                                                for aim, key in (("force", "rigid_f_rms_N"), ("moment", "rigid_m_rms_Nm"))],
              [True, True])
        percent = 100 * (found[-1]["f_rms_N"] / found[0]["f_rms_N"] - 1)
        check("balance: headline", f"Best counterweights for rigid ground (complete): rms force -100 %, on the mounts {percent:.3g} %"
              in run.flat, percent, run.out)
        check("balance: lines of the report", max(map(len, run.out.splitlines())) <= 80, "80 columns", run.out)
        compare("balance", BALANCED, folder, run.out)

        balanced = BALANCED + pasted(run.out)["complete"]
        (folder / "input.nml").write_text(balanced)
        run = Run(folder, "input.nml")
        run.done("balance, balanced already")
        check("balance, balanced already", "the force is already balanced" in run.flat, "a line", run.out)
        equal("balance, already balanced: aims", {row["aim"] for row in rows(folder / "input")[1]}, {"original", "moment", "sum"})


def test_orders():
    """The printed counterweights have the reported effect for every option.

    Radii, aims, units of the input, who holds the speed, weights.
    """
    cases = [("units", MILLIMETRES),
             ("outside", BALANCED.replace("speed_rpm = 240.0", "speed_rpm = -300.0, held_by='outside'")
              + "&balance weight=0.9, length=0.05, about='origin' /\n"),
             ("gravity", BALANCED + "&gravity /\n&balance links='crank','rocker', radius=0.05,0.2 /\n")]
    for what, text in cases:
        with Folder(input=text) as folder:
            run = Run(folder, "input.nml")
            if not run.done(f"balance, {what}"):
                continue
            compare(f"balance, {what}", text, folder, run.out)
            _, links = rows(folder / "input", "balance_links")
            if what == "units":
                equal("balance, units: links", {row["on"] for row in links}, {"it's the rocker"})
                equal("balance, units: radius", {round(math.hypot(row["center_x_m"] - 0.16, row["center_y_m"]), 12)
                                                for row in links}, {0.04})
            if what == "gravity":
                equal("balance, radii", {(row["on"], round(math.hypot(row["center_x_m"], row["center_y_m"]), 12)) for row in links},
                      {("crank", 0.05), ("rocker", 0.2)})


def test_stiff():
    """On very stiff mounts the machine behaves as on rigid ground."""
    stiff = BALANCED.replace("196133.0,196133.0", "1e13,1e13") + "&model frame='rest' /\n"
    with Folder(input=stiff) as folder:
        if not Run(folder, "-q", "input.nml").done("balance, stiff"):
            return
        _, found = rows(folder / "input")
        for row in found[:-1]:
            for key in ("f_rms_N", "f_peak_N", "m_rms_Nm", "m_peak_Nm"):
                # displacements of 1e-12 m in 0.5 m, and the remains of undamped vibrations of 1e5 Hz
                near(f"balance, stiff, {label(row)}: {key}", row[key], row[f"rigid_{key}"], 1e-5 * row[f"rigid_{key}"])
        # the moment about O, as --check reports it
        Run(folder, "-q", "input.nml", "-s", "balance.about='origin'").done("balance, about O")
        checked = Run(folder, "--check", "input.nml").out
        peak, rms = (re.search(rf"^ +{word} .* (\S+)$", checked, re.M)[1] for word in ("peak", "rms"))
        row = rows(folder / "input")[1][0]
        near("balance, about O: peak", row["rigid_m_peak_Nm"], float(peak), 1e-4 * float(peak))
        near("balance, about O: rms", row["rigid_m_rms_Nm"], float(rms), 1e-4 * float(rms))
        check("balance, --check", "complete balance link 'crank' 36.568 kg mm at 180.0 deg link 'rocker' 66.703 kg mm at 180.0 deg"
              in " ".join(checked.split()), "both counterweights", checked)


def test_drawn():
    """The picture of the balance shows every variant."""
    if not GNUPLOT:
        return
    with Folder(input=BALANCED) as folder:
        Run(folder, "-q", "--plot", "input.nml", environment={"LC_ALL": "C.UTF-8"}).done("balance drawn")
        texts = sound_picture("balance drawn", folder / "input" / "balance.svg")
        for word in ("crank, for force", "complete", "on rigid ground", "on the mounts", "rms moment (% of original)"):
            check(f"balance drawn, {word}", word in texts, word, texts)


def test_refused():
    """Machines that the task balance cannot handle are refused."""
    line = "input.nml:16: &balance: "
    for what, group, message in (
            ("no such link", "links='crank','rod'", line + "links(2) = 'rod': there is no link 'rod'"),
            ("named twice", "links='crank','crank'", line + "links(2) = 'crank': link 'crank' is named twice"),
            ("weight", "weight=1.5", line + "weight = 1.5: must lie between 0 and 1"),
            ("no radius", "radius=0", line + "radius(1) = 0: must be positive"),
            ("radii without links", "radius=0.1,0.2",
             line + "radius = 0.1, 0.2: has several values, but the key 'links' is missing: give one value, or name the links"),
            ("radii and links", "links='crank', radius=0.1,0.2", line + "radius = 0.1, 0.2: must have one value, or one for each link in 'links'"),
            ("about", "about='A'", line + "about = 'A': unknown; choose from 'frame', 'origin'"),
            ("unknown key", "radii=1", line + "unknown key 'radii': did you mean 'radius'?")):
        with Folder(input=BALANCED + f"&balance {group} /\n") as folder:
            Run(folder, "input.nml").refused(f"balance, {what}", 2, message)
    with Folder(input=BALANCED.replace("&link name='coupler', from='A', to='B'", "&link name='coupler', from='A'")
                + "&balance links='coupler' /\n") as folder:
        Run(folder, "input.nml").refused("balance, translates", 2,
                                         line + "links(1) = 'coupler': 'coupler' cannot carry a counterweight: it has no key 'to', so it does not rotate")
    with Folder(input=functions("&drive", "&case tasks='balance' /\n&drive")) as folder:
        Run(folder, "input.nml").refused("balance, mass functions", 2, "input.nml:3: &mass_functions: the task 'balance' needs "
                                         "joints and links: a mechanism given by mass functions has no links that could carry counterweights")


BALANCE_TESTS = (test_four_bar, test_orders, test_stiff, test_drawn, test_refused)
