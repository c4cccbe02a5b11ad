"""The library behind the package, by its functions for C (gestell.h)."""
from __future__ import annotations

import ctypes
import os
import sys
import threading
from ctypes import POINTER, byref, c_char_p, c_double, c_int, c_void_p
from pathlib import Path
from types import SimpleNamespace

_SIGNATURES = {
    "get_version": [c_int, c_char_p],
    "get_error": [c_void_p, c_int, c_char_p],
    "read": [c_void_p, c_char_p, c_void_p],
    "parse": [c_void_p, c_char_p, c_void_p],
    "add": [c_void_p, c_char_p, c_void_p],
    "set": [c_void_p, c_char_p, c_double, c_void_p],
    "set_text": [c_void_p, c_char_p, c_char_p, c_void_p],
    "count_values": [c_void_p, c_char_p, POINTER(c_int), c_void_p],
    "get_values": [c_void_p, c_char_p, c_int, c_void_p, c_void_p],
    "solve": [c_void_p, c_char_p, POINTER(c_void_p), c_void_p],
    "size_text": [c_void_p, c_char_p, POINTER(c_int), c_void_p],
    "get_text": [c_void_p, c_char_p, c_int, c_char_p, c_void_p],
    "count_multipliers": [c_void_p, POINTER(c_int), c_void_p],
    "get_multipliers": [c_void_p, c_int, c_void_p, c_void_p, c_void_p, c_void_p],
    "describe_response": [c_void_p, c_char_p, POINTER(c_int), POINTER(c_int), c_int, c_char_p, c_void_p],
    "get_response": [c_void_p, c_char_p, c_void_p, c_int, c_void_p, c_int, c_void_p, c_void_p],
    "write": [c_void_p, c_char_p, c_int, c_void_p],
    "count_tables": [c_void_p, POINTER(c_int), c_void_p],
    "name_table": [c_void_p, c_int, c_int, c_char_p, c_void_p],
    "shape_table": [c_void_p, c_char_p, POINTER(c_int), POINTER(c_int), c_void_p],
    "describe_column": [c_void_p, c_char_p, c_int, c_int, c_char_p, c_char_p, c_char_p, POINTER(c_int), POINTER(c_int),
                                c_void_p],
    "get_numbers": [c_void_p, c_char_p, c_int, c_int, c_void_p, c_void_p],
    "get_integers": [c_void_p, c_char_p, c_int, c_int, c_void_p, c_void_p],
    "get_words": [c_void_p, c_char_p, c_int, c_int, c_int, c_void_p, c_void_p],
}
_LONGEST_MESSAGE = 4096

# What the library does with texts is for one thread at a time; without OpenMP it has no lock of its own.
_lock = threading.Lock()


class Error(Exception):
    """What the library refuses or cannot compute: `message`, one line, and `code`, the program's exit code."""

    def __init__(self, message: str, code: int):
        super().__init__(message)
        self.message = message
        self.code = code

    def __reduce__(self):
        return Error, (self.message, self.code)


def _open() -> ctypes.CDLL:
    name = {"darwin": "libgestell.dylib", "win32": "gestell.dll"}.get(sys.platform, "libgestell.so")
    places = [os.environ.get("GESTELL_LIBRARY"), Path(__file__).parent / name]
    for place in places:
        if place and Path(place).exists():
            return ctypes.CDLL(str(place))
    return ctypes.CDLL(name)


_library = _open()
# All functions that give the code of an error, by their names without gestell_.
functions = SimpleNamespace(**{name: getattr(_library, "gestell_" + name) for name in _SIGNATURES})
for _name, _arguments in _SIGNATURES.items():
    getattr(functions, _name).argtypes = _arguments
    getattr(functions, _name).restype = c_int
for _what in ("error", "machine"):
    getattr(_library, f"gestell_new_{_what}").restype = c_void_p
_deleters = {what: getattr(_library, f"gestell_delete_{what}") for what in ("machine", "solution")}
for _deleter in _deleters.values():
    _deleter.argtypes = [POINTER(c_void_p)]
    _deleter.restype = None
# One is enough for all that comes one after the other; it lives as long as the library.
_error = c_void_p(_library.gestell_new_error())


def call(function, *arguments) -> None:
    """Calls one of `functions`; what it reports is raised."""
    with _lock:
        code = function(*arguments, _error)
        if code == 0:
            return
        message = ctypes.create_string_buffer(_LONGEST_MESSAGE)
        functions.get_error(_error, _LONGEST_MESSAGE, message)
    raise Error(message.value.decode("utf-8", "replace"), code)


def new_machine() -> c_void_p:
    with _lock:
        return c_void_p(_library.gestell_new_machine())


def delete(what: str, handle: c_void_p) -> None:
    with _lock:
        _deleters[what](byref(handle))


def encoded(text: str) -> bytes:
    """A text for the library, which ends at a zero."""
    if "\0" in text:
        raise Error("a text must not hold the character zero", 1)
    return text.encode("utf-8")


def version() -> str:
    text = ctypes.create_string_buffer(64)
    functions.get_version(64, text)
    return text.value.decode()
