"""Solves machines for the live page, in a process of its own that can be stopped when a machine takes too long."""
from __future__ import annotations

import contextlib
import json
import os
import queue
import subprocess
import sys
import threading
import time

from ._library import Error
from ._machine import Machine

# Results that follow every change; further ones if the input requests them. Tasks that compute many machines take too long.
TASKS = ("drawing", "stability", "modes", "response", "forces")
FURTHER = ("joints", "power", "balance", "separation", "sensitivity")
SECONDS = 20
MOST_POINTS = 720
MOST_CLIENTS = 1000
MEMORY = 4 << 30
# Titles of the diagrams, with the names of the columns that each shows.
CURVES = {"Displacement of the frame": ("xi", "eta", "zeta"), "Rotation of the frame": ("psi", "rot_xi", "rot_eta"),
          "Force on the ground": ("fx", "fy", "fz"), "Moment on the ground": ("m", "mx", "my")}
# Factor and unit in which people read columns with an SI unit that is too large.
READABLE = {"m": (1e3, "mm"), "rad": (1e3, "mrad")}


def solve(text: str, changes: list, name: str = "text") -> dict:
    """The machine with the changes, a list of paths and values as text: its input, its parameters, its page and its curves.
    Messages call the text by its name.

    Raises gestell.Error if the machine cannot be solved.
    """
    machine = _machine(text, name)
    for path, value in changes:
        machine[path] = value
    text = machine.text
    machine = _machine(text, name)
    requested = machine["case.tasks"] if "case.tasks" in machine else []
    tasks = [*TASKS, *(task for task in FURTHER if task in requested)]
    try:
        solution = machine.solve(tasks)
    except Error as first:
        # A mechanism that is given by mass functions cannot be drawn.
        try:
            solution = machine.solve(tasks[1:])
        except Error:
            raise first from None
    parameters = machine.parameters()
    return {"text": text, "parameters": parameters, "page": solution.page, "curves": _curves(solution)}


def _machine(text: str, name: str) -> Machine:
    """The machine of a text, which is not taken for the name of a file even if it has a single line."""
    return Machine(text if "\n" in text else text + "\n", name)


def _curves(solution) -> list:
    """The vibration over the crank angle."""
    if "response" not in solution.tables:
        return []
    table = solution.table("response")
    curves: dict = {}
    step = 1 + (table.rows - 1) // MOST_POINTS
    for key, column in table.items():
        name = key.rsplit("_", 1)[0]
        title = next((title for title, names in CURVES.items() if name in names), None)
        if title is None:
            continue
        factor, unit = READABLE.get(column.unit, (1, column.unit))
        diagram = curves.setdefault(title, {"title": title, "unit": unit, "x": table["crank_deg"][::step].tolist(), "series": []})
        diagram["series"].append({"name": name, "values": (factor * column[::step]).tolist()})
    return list(curves.values())


class Solver:
    """Answers one request after the other. Of several requests of a client that wait, only the latest is answered."""

    def __init__(self, file: str | os.PathLike, seconds: float = SECONDS):
        """`file`: input file. Files that an input names, such as tables of loads, are read from its folder, and messages begin with
        its name. `seconds`: longest time for a machine.
        """
        self._file = os.path.abspath(file)
        self._seconds = seconds
        self._busy = threading.Lock()
        self._latest: dict = {}
        self._process = None
        self._answers: queue.Queue = queue.Queue()

    def answer(self, client: str, number: int, text: str, changes: list) -> str:
        """The result of `solve` in JSON, or {"error": message}, or {"outdated": true} if the client has sent a later request."""
        if len(self._latest) > MOST_CLIENTS:
            self._latest.clear()
        self._latest[client] = max(number, self._latest.get(client, number))
        with self._busy:
            if self._latest.get(client, number) > number:
                return json.dumps({"outdated": True})
            try:
                answer = self._ask(json.dumps([text, changes]))
            except queue.Empty:
                self.stop()
                return _failure(f"this machine takes longer than {self._seconds:g} s")
            except OSError:
                answer = ""
            if not answer:
                # A process that is ending may still take requests, and never answers them.
                self.stop()
            return answer or _failure("the computation has ended unexpectedly")

    def _ask(self, request: str) -> str:
        """The line that the process answers; empty if it has died."""
        if self._process is None or self._process.poll() is not None:
            self._start()
        self._process.stdin.write(request + "\n")
        self._process.stdin.flush()
        return self._answers.get(timeout=self._seconds)

    def _start(self) -> None:
        self.stop()
        # In a session of its own Ctrl+C does not reach it: this process ends it.
        self._process = subprocess.Popen([sys.executable, "-m", __name__, self._file], stdin=subprocess.PIPE,
                                         stdout=subprocess.PIPE, encoding="utf-8", start_new_session=True,
                                         env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)})
        self._answers = queue.Queue()
        threading.Thread(target=_collect, args=(self._process.stdout, self._answers), daemon=True).start()

    def stop(self) -> None:
        """Ends the process; the next request starts a new one."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            with contextlib.suppress(OSError):
                self._process.stdin.close()
        self._process = None


def _failure(message: str) -> str:
    return json.dumps({"error": message})


def _collect(lines, answers: queue.Queue) -> None:
    """Puts all lines into the queue; an empty one is the last."""
    with lines:
        for line in lines:
            answers.put(line)
    answers.put("")


def _work(file: str) -> None:
    """Answers the requests on standard input, each on one line."""
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    # modules must be imported from the same places when the folder changes
    sys.path[:] = [os.path.abspath(path) for path in sys.path]
    with contextlib.suppress(OSError):
        os.chdir(os.path.dirname(file))
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    for request in sys.stdin:
        try:
            answer = solve(*json.loads(request), os.path.basename(file))
        except Error as error:
            answer = {"error": error.message}
        except MemoryError:
            answer = {"error": "this machine needs too much memory"}
        print(json.dumps(answer), flush=True)


def _end_with(parent: int) -> None:
    """Ends this process as soon as its parent has ended, also during a computation."""
    while os.getppid() == parent:
        time.sleep(0.5)
    os._exit(1)


if __name__ == "__main__":
    sys.stdin.reconfigure(encoding="utf-8")
    with contextlib.suppress(KeyboardInterrupt):
        _work(sys.argv[1])
