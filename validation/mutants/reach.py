"""Finds the procedures that a program has executed, from the files that gcc's --coverage writes (gcc/gcov-io.h: a tag, a length in
bytes, data)."""
import struct

_FUNCTION, _COUNTERS = 0x01000000, 0x01a10000


def _records(data, start):
    """(tag, length, data) of each record; a negative length stands for so many bytes of counters that are all zero."""
    while start + 8 <= len(data):
        tag, length = struct.unpack_from("<Ii", data, start)
        start += 8
        yield tag, length, data[start:start + max(length, 0)]
        start += max(length, 0)
        if tag == 0:
            return


def _text(data, at):
    size = struct.unpack_from("<I", data, at)[0]
    return data[at + 4:at + 4 + size].rstrip(b"\0").decode(), at + 4 + size


def procedures_of(notes):
    """{identity: (first line, last line)} of the procedures in a .gcno file."""
    data = notes.read_bytes()
    _, at = _text(data, 16)
    found = {}
    for tag, _, record in _records(data, at + 4):
        if tag == _FUNCTION:
            identity = struct.unpack_from("<I", record, 0)[0]
            _, place = _text(record, 12)
            _, place = _text(record, place + 4)
            first, _, last, _ = struct.unpack_from("<4I", record, place)
            found[identity] = (first, last)
    return found


def executed_procedures(counters):
    """The identities of the procedures that a .gcda file counts at least once."""
    identity, found = None, set()
    for tag, length, record in _records(counters.read_bytes(), 16):
        if tag == _FUNCTION and length > 0:
            identity = struct.unpack_from("<I", record, 0)[0]
        elif tag == _COUNTERS and length > 0 and any(record):
            found.add(identity)
    return found
