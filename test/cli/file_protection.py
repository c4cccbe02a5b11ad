"""Only result files are ever replaced: not the input, not the targets of links, not folders that no run has created."""

import os

from broken_inputs import SOUND
from harness import Folder, Run, check, equal

DESIGN = """! the original machine
&case tasks='design' /
&drive speed_rpm=300.0 /
&joint name='O', type='ground', position=0.0,0.0 /
&joint name='A', type='crank', pivot='O', radius=0.05 /
&link name='disc', from='O', to='A', mass=2.0, inertia=0.01, center=0.01,0.0 /
&frame mass=40.0, inertia=1.5, origin=0.0,0.1 /
&support position=-0.3,-0.2, stiffness=1e5,2e5, damping=200.,300. /
&support position=0.3,-0.2, stiffness=1e5,2e5, damping=200.,300. /
&design parameter='link(disc).center(1)', from=-0.1, to=0.1 /
&objective quantity='f', measure='rms' /
"""
SWEEP = SOUND.replace("'stability', 'response'", "'sweep'") + "&sweep parameter='drive.speed_rpm', from=200, to=300, count=3 /\n"


def everything(folder):
    """All files and links below a folder with their contents."""
    return {str(path.relative_to(folder)): os.readlink(path) if path.is_symlink() else path.read_bytes()
            for path in sorted(folder.rglob("*")) if path.is_symlink() or path.is_file()}


def test_input_stays():
    """Results never overwrite the input."""
    with Folder(design=DESIGN) as folder:
        (folder / "in").mkdir()
        os.link(folder / "design.nml", folder / "in" / "design.nml")
        (folder / "to").mkdir()
        (folder / "to" / "design.nml").symlink_to("../design.nml")
        (folder / "here").symlink_to(".")
        (folder / "other.nml").symlink_to("design.nml")
        (folder / "response.csv").write_text(SOUND)
        (folder / "results.json").write_text(SOUND)
        before = everything(folder)
        for name, output in (("design.nml", "."), ("./design.nml", "."), (folder / "design.nml", "."), ("design.nml", folder),
                             ("in/../design.nml", "./to/.."), ("design.nml", "here"), ("here/design.nml", "."), ("other.nml", "."),
                             ("design.nml", "to"), ("to/design.nml", "to"), ("to/design.nml", "."), ("design.nml", "in")):
            Run(folder, "-q", name, "-o", output).refused(
                f"{name} in {output}", 1, f"{output}/design.nml: the results would replace the input; choose another folder with --output")
        Run(folder, "-q", "response.csv", "-o", ".").refused(
            "a table's name", 1, "./response.csv: the results would replace the input; choose another folder with --output")
        Run(folder, "--json", "results.json", "-o", ".").refused(
            "the name of all results", 1, "./results.json: the results would replace the input; choose another folder with --output")
        equal("only the inputs exist, unchanged", everything(folder), before)
    with Folder(design=SOUND, response=SOUND) as folder:
        for name in ("design.nml", "response.nml"):
            Run(folder, "-q", name, "-o", ".").done(f"no result is called {name}")
            equal(f"no result is called {name}: unchanged", (folder / name).read_text(), SOUND)


def test_links_and_folders_stay():
    """Links and folders of other origin are left untouched."""
    with Folder() as folder:
        Run(folder, "-q", "input.nml", "-o", "out").done("an empty folder")
        wanted = everything(folder / "out")
        (folder / "victim").mkdir()
        for name in ("response.csv", "response.csv.new", "journal", "made_by_gestell", "multipliers.csv.old"):
            (folder / "victim" / name).write_text("precious\n")
        precious = everything(folder / "victim")

        def scene(what, build):
            out = folder / what.replace(" ", "_")
            out.mkdir()
            build(out)
            before = everything(out)
            Run(folder, "-q", "input.nml", "-o", out.name).done(what)
            equal(f"{what}: targets of links are unchanged", everything(folder / "victim"), precious)
            found = everything(out)
            equal(f"{what}: results", {name: found.get(name) for name in wanted}, wanted)
            return out, before, {name: data for name, data in found.items() if name not in wanted}

        def foreign(out):
            (out / ".gestell-1").mkdir()
            (out / ".gestell-1" / "response.csv").write_text("precious\n")

        for what, build in (("link to a folder", lambda out: (out / ".gestell-1").symlink_to("../victim")),
                            ("link to nothing", lambda out: (out / ".gestell-1").symlink_to("nowhere")),
                            ("file", lambda out: (out / ".gestell-1").write_text("precious\n")),
                            ("folder of somebody else", foreign)):
            out, before, left = scene(what, build)
            equal(f"{what}: unchanged", left, before)

        def killed(out):
            staging = out / ".gestell-1"
            staging.mkdir()
            (staging / "made_by_gestell").touch()
            for name in ("response.csv.new", "response.csv.old", "multipliers.csv", "journal.new"):
                (staging / name).symlink_to("../../victim/response.csv")

        for what, build in (("links in what a killed run has left", killed),
                            ("what a run has left that was killed at once", lambda out: (out / ".gestell-1").mkdir())):
            out, before, left = scene(what, build)
            equal(f"{what}: is used and removed", (left, (out / ".gestell-1").exists()), ({}, False))

        def results(out):
            (out / "response.csv").symlink_to("../victim/response.csv")
            (out / "multipliers.csv").symlink_to("nowhere")
            os.link(folder / "victim" / "journal", out / "harmonics.csv")

        scene("links in place of results", results)


def test_blocks_stay():
    """Only a sweep's own intermediate folder is used."""
    with Folder(input=SWEEP) as folder:
        (folder / "victim").mkdir()
        for name in ("rows", "marks", "origin", "lock"):
            (folder / "victim" / name).write_text("precious\n")
        for what in ("link", "rows", "origin", "lock"):
            out = folder / what
            out.mkdir()
            blocks = out / "sweep.blocks"
            if what == "link":
                blocks.symlink_to("../victim")
            else:
                blocks.mkdir()
            if what == "lock":
                (blocks / "lock").symlink_to("../../victim/lock")
            elif what != "link":
                (blocks / what).write_text("precious\n")
            before = everything(folder)
            Run(folder, "-q", "input.nml", "-o", what).refused(
                f"sweep.blocks: {what}", 1, f"{what}/sweep.blocks: is a symbolic link, or contains files that are not from a sweep; choose "
                "another folder with --output")
            equal(f"sweep.blocks: {what}: unchanged", everything(folder), before)
        (folder / "empty" / "sweep.blocks").mkdir(parents=True)
        Run(folder, "-q", "input.nml", "-o", "empty").done("sweep.blocks: empty")
        check("sweep.blocks: empty: is used", list(everything(folder / "empty"))
              == ["sweep.csv", "sweep.gp", "sweep_2.gp", "sweep_3.gp", "sweep_4.gp"], "sweep.csv",
              everything(folder / "empty").keys())


FILE_PROTECTION_TESTS = (test_input_stays, test_links_and_folders_stay, test_blocks_stay)
