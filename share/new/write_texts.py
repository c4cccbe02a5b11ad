"""Writes the starting inputs of this folder into src/run/starting_texts.f90, from which `gestell --new KIND` prints them.

Run this script after a change of an input here; test/cli/starting_inputs.py fails until then. The program contains the texts, so that
it needs no other file.
"""
from pathlib import Path

# The order of `gestell --new`.
KINDS = ("slider-crank", "four-bar", "six-bar", "cam", "inline-engine", "v-engine", "machine-on-mounts")
HERE = Path(__file__).resolve().parent
MODULE = HERE.parents[1] / "src" / "run" / "starting_texts.f90"


def module():
    """The Fortran source. Each input is one statement of a line per line, of which the standard allows 255."""
    quoted = {kind: (HERE / f"{kind}.nml").read_text(encoding="ascii").replace('"', '""').splitlines() for kind in KINDS}
    width = max(map(len, KINDS))
    lines = ["!> Contains the inputs of `gestell --new`. Written by share/new/write_texts.py from share/new/*.nml: change those files.",
             "module gestell_run_starting_texts", "implicit none (type, external)", "private", "",
             "character, parameter :: n = new_line(\"a\")", "",
             "!> Kinds of machines for which there is an input.",
             f"character(len={width}), parameter, public :: kinds(*) = [character(len={width}) :: &",
             "  & " + ", &\n  & ".join(f'"{kind}"' for kind in KINDS) + "]", "", "public :: starting_text", ""]
    for kind in KINDS:
        lines += [f"character(len=*), parameter :: {kind.replace('-', '_')} = &"]
        lines += [f'  & "{line}" // n // &' for line in quoted[kind]]
        lines[-1] = lines[-1].removesuffix(" // &")
        lines += [""]
    lines += ["contains", "", "!> Input for a machine of this kind, one of `kinds`.",
              "pure function starting_text(kind) result(text)", "  character(len=*), intent(in) :: kind",
              "  character(len=:), allocatable :: text", "", "  select case (kind)"]
    for kind in KINDS:
        lines += [f'  case ("{kind}")', f"    text = {kind.replace('-', '_')}"]
    lines += ["  case default", '    text = ""', "  end select", "end function starting_text", "",
              "end module gestell_run_starting_texts"]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    MODULE.write_text(module(), encoding="ascii")
