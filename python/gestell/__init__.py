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
from ._solution import Animation, Response, Solution, Table

__all__ = ["Animation", "Array", "Error", "Machine", "Response", "Solution", "Table", "Value"]
__version__ = version()
