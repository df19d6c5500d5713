"""Section 6 of docs/protocol.md, "Columns": the bodies of planes and cloud."""

import struct

from connect_records import require

COLUMN = "<IIIIHBBBBBBII"
PLAIN, RANKS, STEPS = range(3)
BIG_ENDIAN, MINUS = 1, 2
NAN, MINUS_ZERO, PLUS_INFINITY, MINUS_INFINITY = 1, 2, 3, 4
SPECIAL = {
    NAN: 0x7FC00000,
    MINUS_ZERO: 0x80000000,
    PLUS_INFINITY: 0x7F800000,
    MINUS_INFINITY: 0xFF800000,
}


class Column:
    """One column, checked as far as it can be by itself."""

    def __init__(self, head):
        fields = struct.unpack(COLUMN, head)
        self.begin, self.rows, self.row_stride, self.count, self.stride = fields[:5]
        self.kind, self.width, self.planes, self.lag, self.flags, zero = fields[5:11]
        self.extra, self.listed = fields[11:]
        self.elements = self.rows * self.count
        require(self.elements > 0 and zero == 0 and self.flags <= 3, "a column of nothing")
        require(self.kind <= STEPS and self.width in (1, 2, 4, 8), "a column of no kind")
        require(self.kind == PLAIN or self.width == 4, "a column of another width")
        require(1 <= self.planes <= self.most_planes(), "planes")
        require(not self.flags & MINUS or (self.kind, self.width) == (PLAIN, 1), "minus")
        require(self.kind == STEPS or self.listed == 0, "a list")
        require((self.kind == PLAIN) == (self.extra == 0), "a number of the kind")
        require(self.kind != RANKS or self.extra <= 4096, "too many ranks")

    def most_planes(self):
        if self.kind == PLAIN:
            return self.width
        return 3 if self.kind == STEPS else 1 if self.extra <= 256 else 2

    def stored(self):
        table = self.extra if self.kind == RANKS else self.listed
        return 4 * table + self.elements * self.planes

    def places(self):
        for row in range(self.rows):
            begin = self.begin + row * self.row_stride
            yield from range(begin, begin + self.count * self.stride, self.stride)

    def end(self):
        last = (self.rows - 1) * self.row_stride + (self.count - 1) * self.stride
        return self.begin + last + self.width


def _unfold(number):
    return -(number + 1) // 2 if number & 1 else number // 2


def _summed(numbers, lag, width):
    if lag == 0:
        return numbers
    values = []
    for i, number in enumerate(numbers):
        value = number if width == 1 else _unfold(number)
        if i >= lag:
            value += values[i - lag]
        values.append(value % 256**width)
    return values


def _steps(column, numbers, listed):
    counts, values = [], []
    for i, number in enumerate(numbers):
        before = counts[i - column.lag] if 0 < column.lag <= i else 0
        if number > MINUS_INFINITY:
            before += _unfold(number - 5)
            values.append(struct.pack("<f", before * (column.extra / 1e6)))
        elif number == 0:
            require(listed, "no value is left")
            values.append(listed.pop(0))
        else:
            values.append(struct.pack("<I", SPECIAL[number]))
        counts.append(before)
    require(not listed, "a value is left")
    return values


def columns_decode(codec, body, size, unpack):
    """The sample; `unpack` decompresses a frame of zstd to a size."""
    require(len(body) >= 2 and body[0] == 1 and body[1] > 0, "no columns")
    end = 2 + 32 * body[1]
    require(len(body) >= end, "columns cut short")
    columns = [Column(body[at : at + 32]) for at in range(2, end, 32)]
    require(sum(c.elements * c.width for c in columns) == size, "columns of another size")
    stored = sum(c.stored() for c in columns)
    require(stored <= size and all(c.end() <= size for c in columns), "columns beyond the sample")
    require(codec == "cloud" or all(c.kind != STEPS for c in columns), "planes with steps")
    rest = unpack(body[end:], stored)
    sample, key = bytearray(size), []

    def take(count):
        nonlocal rest
        taken, rest = rest[:count], rest[count:]
        return taken

    for column in columns:
        table = column.extra if column.kind == RANKS else column.listed
        fixed = [take(4) for _ in range(table)]
        planes = [take(column.elements) for _ in range(column.planes)]
        numbers = [int.from_bytes(bytes(of), "little") for of in zip(*planes)]
        if column.kind == STEPS:
            values = _steps(column, numbers, fixed)
        elif column.kind == RANKS:
            ranks = _summed(numbers, column.lag, 1 if table <= 256 else 2)
            require(max(ranks) < table, "a rank beyond the table")
            values = [fixed[rank] for rank in ranks]
        else:
            numbers = _summed(numbers, column.lag, column.width)
            if column.flags & MINUS:
                require(len(key) == len(numbers), "no column to subtract")
                numbers = [(a + b) % 256 for a, b in zip(numbers, key)]
            elif column.width == 1:
                key = numbers
            values = [number.to_bytes(column.width, "little") for number in numbers]
        for place, value in zip(column.places(), values):
            swap = column.flags & BIG_ENDIAN
            sample[place : place + column.width] = value[::-1] if swap else value
    return bytes(sample)
