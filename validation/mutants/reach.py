"""Finds the lines that a program has executed, from the files that gcc's --coverage writes (gcc/gcov-io.h: a tag, a length in bytes,
data).

A .gcno file describes each procedure as a graph of blocks. The program counts how often it passes some of the arcs between blocks and
writes the counts to the .gcda file. The other arcs form a tree: their counts follow because each block is entered as often as left.
"""
import struct

_FUNCTION, _BLOCKS, _ARCS, _LINES, _COUNTERS = 0x01000000, 0x01410000, 0x01430000, 0x01450000, 0x01a10000
# The first two blocks of each procedure.
_ENTRY, _EXIT = 0, 1


class Procedure:
    """A procedure of a .gcno file: its first and last line, its arcs as pairs of blocks, and the lines of each block."""

    def __init__(self, first, last):
        self.first, self.last = first, last
        self.arcs, self.counted, self.lines = [], [], {}
        self.steps = None

    def executed_lines(self, counts):
        """The lines of the blocks that are executed at least once, from the counts of the arcs that are counted."""
        if self.steps is None:
            self.steps = self._elimination()
        passed = [0] * len(self.arcs)
        for arc, count in zip(self.counted, counts):
            passed[arc] = count
        for arc, added, subtracted in self.steps:
            passed[arc] = sum(passed[i] for i in added) - sum(passed[i] for i in subtracted)
        blocks = {block for arc, count in zip(self.arcs, passed) if count > 0 for block in arc}
        return {line for block in blocks for line in self.lines.get(block, ())}

    def _elimination(self):
        """(arc, arcs to add, arcs to subtract) for each arc that is not counted, in an order in which all terms are known."""
        entering, leaving = {}, {}
        for i, (source, target) in enumerate(self.arcs):
            leaving.setdefault(source, []).append(i)
            entering.setdefault(target, []).append(i)
        unknown, steps = set(range(len(self.arcs))) - set(self.counted), []
        touched = [block for i in unknown for block in self.arcs[i]]
        while touched:
            block = touched.pop()
            sides = entering.get(block, []), leaving.get(block, [])
            open_arcs = [i for side in sides for i in side if i in unknown]
            if block in (_ENTRY, _EXIT) or len(open_arcs) != 1:
                continue
            arc = open_arcs[0]
            own, other = sides if arc in sides[0] else sides[::-1]
            steps.append((arc, other, [i for i in own if i != arc]))
            unknown.remove(arc)
            touched += self.arcs[arc]
        return steps


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


def _integers(record):
    return struct.unpack(f"<{len(record) // 4}I", record)


def procedures_of(notes):
    """{identity: procedure} of a .gcno file."""
    data = notes.read_bytes()
    _, at = _text(data, 16)
    found = {}
    for tag, _, record in _records(data, at + 4):
        if tag == _FUNCTION:
            identity = struct.unpack_from("<I", record, 0)[0]
            _, place = _text(record, 12)
            source, place = _text(record, place + 4)
            first, _, last, _ = struct.unpack_from("<4I", record, place)
            procedure = found[identity] = Procedure(first, last)
        elif tag == _ARCS:
            block, *arcs = _integers(record)
            for target, flags in zip(arcs[::2], arcs[1::2]):
                if not flags & 1:
                    procedure.counted.append(len(procedure.arcs))
                procedure.arcs.append((block, target))
        elif tag == _LINES:
            block, at, of_source = _integers(record[:4])[0], 4, False
            while at < len(record):
                line = struct.unpack_from("<I", record, at)[0]
                at += 4
                if line:
                    if of_source:
                        procedure.lines.setdefault(block, []).append(line)
                    continue
                name, at = _text(record, at)
                of_source = name == source
    return found


def executed_lines(counters, procedures):
    """The lines of a source file that are executed at least once, from its .gcda file and the procedures of its .gcno file."""
    identity, found = None, set()
    for tag, length, record in _records(counters.read_bytes(), 16):
        if tag == _FUNCTION and length > 0:
            identity = struct.unpack_from("<I", record, 0)[0]
        elif tag == _COUNTERS and length > 0 and any(record):
            found |= procedures[identity].executed_lines(struct.unpack(f"<{len(record) // 8}q", record))
    return found
