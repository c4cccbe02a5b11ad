"""Loads the shared library and calls its C functions (gestell.h)."""
from __future__ import annotations

import collections
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

# The library handles text in one thread at a time, and without OpenMP it has no lock of its own. The garbage collector may run in
# any thread at any moment, also in the thread that holds this lock. Therefore the lock is reentrant, and deleting never waits for
# it: handles to delete are queued.
_lock = threading.RLock()
_dropped: collections.deque = collections.deque()


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


def call(function, *arguments) -> None:
    """Calls one of `functions` and raises the error that it reports."""
    try:
        error = _errors.pop()
    except IndexError:
        error = c_void_p(_locked(_library.gestell_new_error))
    code = _locked(function, *arguments, error)
    message = b""
    if code != 0:
        place = ctypes.create_string_buffer(_LONGEST_MESSAGE)
        functions.get_error(error, _LONGEST_MESSAGE, place)
        message = place.value
    _errors.append(error)
    if code != 0:
        raise Error(message.decode("utf-8", "replace"), code)


def _locked(function, *arguments):
    """Calls a function of the library in one thread at a time and returns its result."""
    with _lock:
        result = function(*arguments)
    _delete_dropped()
    return result


def new_machine() -> c_void_p:
    return c_void_p(_locked(_library.gestell_new_machine))


def delete(what: str, handle: c_void_p) -> None:
    """Deletes a handle: at once, or when the thread that is in the library returns from it."""
    _dropped.append((what, handle))
    _delete_dropped()


def _delete_dropped() -> None:
    # The thread that holds the lock calls this function after releasing it, so no handle is left in the queue.
    while _dropped and _lock.acquire(blocking=False):
        try:
            what, handle = _dropped.popleft()
            _deleters[what](byref(handle))
        except IndexError:
            pass
        finally:
            _lock.release()


def use_one_core() -> None:
    """Restricts calls of this thread to one core."""
    if hasattr(_library, "omp_set_num_threads"):
        _library.omp_set_num_threads(1)


def _go_on_alone() -> None:
    """Restricts a child of fork to one thread, because OpenMP threads of the parent do not survive fork."""
    _lock.release()
    use_one_core()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=_lock.acquire, after_in_parent=_lock.release, after_in_child=_go_on_alone)


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
