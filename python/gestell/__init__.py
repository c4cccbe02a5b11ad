"""Vibrations and stability of elastically mounted machine frames.

    import gestell
    machine = gestell.Machine("pump.nml")
    machine["drive.speed_rpm"] = 300
    solution = machine.solve()
    print(solution.verdict, solution.multipliers, solution.multipliers.error)
"""
from ._array import Array, Value
from ._library import Error, version
from ._machine import Machine
from ._many import solve_many
from ._solution import Animation, Response, Solution
from ._table import Grid, Table

__all__ = ["Animation", "Array", "Error", "Grid", "Machine", "Response", "Solution", "Table", "Value", "solve_many"]
__version__ = version()
