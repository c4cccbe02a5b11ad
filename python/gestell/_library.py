"""Loads the shared library and calls its C functions (gestell.h)."""
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
    "copy_machine": [c_void_p, POINTER(c_void_p), c_void_p],
    "read": [c_void_p, c_char_p, c_void_p],
    "parse": [c_void_p, c_char_p, c_void_p],
    "parse_named": [c_void_p, c_char_p, c_char_p, c_void_p],
    "add": [c_void_p, c_char_p, c_void_p],
    "remove": [c_void_p, c_char_p, c_void_p],
    "set": [c_void_p, c_char_p, c_double, c_void_p],
    "set_text": [c_void_p, c_char_p, c_char_p, c_void_p],
    "count_values": [c_void_p, c_char_p, POINTER(c_int), c_void_p],
    "get_values": [c_void_p, c_char_p, c_int, c_void_p, c_void_p],
    "size_parameters": [c_void_p, c_char_p, POINTER(c_int), c_void_p],
    "get_parameters": [c_void_p, c_char_p, c_int, c_char_p, c_void_p],
    "size_input": [c_void_p, POINTER(c_int), c_void_p],
    "get_input": [c_void_p, c_int, c_char_p, c_void_p],
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

# With OpenMP, any number of threads may be in the library at the same time; it locks what only one of them may do. Without OpenMP they
# call it one after another, and each keeps `_gate` during its call. A process does not fork while a thread is in the library, because
# the child would inherit locks that nobody releases.
_gate = threading.Condition()
_calls = 0


class Error(Exception):
    """An error of the library: `message` is one line, `code` the exit code of the program for this error."""

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
_has_openmp = hasattr(_library, "omp_set_num_threads")
# All functions that return an error code, by their names without the prefix gestell_.
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
# Error handles that no call is using. Each call takes its own, because the garbage collector may start another call meanwhile.
_errors: list = []


class Handle(c_void_p):
    """A machine or solution of the library. Two threads that use the same one take turns."""

    def __init__(self, address: int | None = None):
        super().__init__(address)
        self.lock = threading.RLock()


def call(function, *arguments) -> None:
    """Calls one of `functions` and raises the error that it reports."""
    try:
        error = _errors.pop()
    except IndexError:
        error = c_void_p(_library.gestell_new_error())
    code = _entered(function, *arguments, error)
    message = b""
    if code != 0:
        place = ctypes.create_string_buffer(_LONGEST_MESSAGE)
        functions.get_error(error, _LONGEST_MESSAGE, place)
        message = place.value
    _errors.append(error)
    if code != 0:
        raise Error(message.decode("utf-8", "replace"), code)


def _entered(function, handle, *arguments):
    """Calls a function of the library and returns its result."""
    global _calls
    with _gate:
        if not _has_openmp:
            return function(handle, *arguments)
        _calls += 1
    try:
        with handle.lock:
            return function(handle, *arguments)
    finally:
        with _gate:
            _calls -= 1
            _gate.notify_all()


def new_machine() -> Handle:
    return Handle(_library.gestell_new_machine())


def delete(what: str, handle: Handle) -> None:
    """Deletes a handle. The garbage collector may call this in any thread at any moment, so it must not wait for other calls."""
    _deleters[what](byref(handle))


def _wait_for_calls() -> None:
    """Waits until no thread is in the library, and keeps others out."""
    _gate.acquire()
    while _calls:
        _gate.wait()


def use_one_core() -> None:
    """Restricts calls of this thread to one core."""
    if _has_openmp:
        _library.omp_set_num_threads(1)


def _go_on_alone() -> None:
    """Restricts a child of fork to one thread, because OpenMP threads of the parent do not survive fork."""
    _gate.release()
    use_one_core()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=_wait_for_calls, after_in_parent=_gate.release, after_in_child=_go_on_alone)


def encoded(text: str) -> bytes:
    """Encodes a text for the library. Fails if it contains a zero character or cannot be encoded as UTF-8."""
    try:
        return _without_zero(text.encode("utf-8"))
    except UnicodeEncodeError:
        raise Error(f"{ascii(text)}: contains characters that cannot be encoded as UTF-8", 1) from None


def encoded_path(path) -> bytes:
    """Encodes the name of a file or folder (str, bytes or Path) in the encoding of the file system."""
    return _without_zero(os.fsencode(path))


def _without_zero(text: bytes) -> bytes:
    if b"\0" in text:
        raise Error("a text must not contain the zero character", 1)
    return text


def decoded(text: bytes) -> str:
    """Decodes a text of the library. Fails if it is not UTF-8, as names from an input file in another encoding may be."""
    try:
        return text.decode("utf-8")
    except UnicodeDecodeError:
        raise Error(f"{ascii(text)[1:]}: is not UTF-8; save the input file as UTF-8 text", 2) from None


def version() -> str:
    text = ctypes.create_string_buffer(64)
    functions.get_version(64, text)
    return text.value.decode()
