"""The pixels of a PNG."""
import struct
import zlib

SIGNATURE = b"\x89PNG\r\n\x1a\n"
CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}


def paeth(left, above, corner):
    guess = left + above - corner
    distances = abs(guess - left), abs(guess - above), abs(guess - corner)
    return (left, above, corner)[distances.index(min(distances))]


def unfiltered(data, height, stride, step):
    """The rows of the picture from those of the file, where each is told by its difference from its neighbours."""
    rows = []
    above = bytearray(stride)
    for y in range(height):
        kind = data[y * (stride + 1)]
        row = bytearray(data[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
        if kind == 2:
            row = bytearray((a + b) & 255 for a, b in zip(row, above))
        elif kind != 0:
            for i in range(stride):
                left = row[i - step] if i >= step else 0
                corner = above[i - step] if i >= step else 0
                foretold = {1: left, 3: (left + above[i]) // 2, 4: paeth(left, above[i], corner)}[kind]
                row[i] = (row[i] + foretold) & 255
        rows.append(bytes(row))
        above = row
    return rows


class Picture:
    """A PNG of 8 or 16 bits a channel, not interlaced; others are refused with a ValueError."""

    def __init__(self, png):
        if not png.startswith(SIGNATURE):
            raise ValueError("no PNG")
        self.palette = b""
        at, data = len(SIGNATURE), b""
        while at < len(png):
            length, kind = struct.unpack(">I4s", png[at : at + 8])
            chunk = png[at + 8 : at + 8 + length]
            at += length + 12
            if kind == b"IHDR":
                self.header = struct.unpack(">IIBBBBB", chunk)
            elif kind in (b"PLTE", b"tRNS"):
                self.palette += kind + chunk
            elif kind == b"IDAT":
                data += chunk
        self.width, self.height, depth, colour, _, _, interlaced = self.header
        if depth < 8 or interlaced:
            raise ValueError("a PNG of a kind that is not read here")
        self.step = CHANNELS[colour] * depth // 8
        self.filtered = zlib.decompress(data)

    def rows(self):
        return unfiltered(self.filtered, self.height, self.width * self.step, self.step)

    def pixels(self):
        return [row[i : i + self.step] for row in self.rows() for i in range(0, len(row), self.step)]


def difference(old, new):
    """How two PNGs differ, as one sentence; empty where every pixel is the same."""
    if old == new:
        return ""
    try:
        a, b = Picture(old), Picture(new)
    except (ValueError, KeyError, struct.error, zlib.error) as problem:
        return f"the bytes differ, and the pixels cannot be read: {problem}"
    if (a.header[:4], a.palette) != (b.header[:4], b.palette):
        return f"{a.width}x{a.height} pixels, now {b.width}x{b.height} or of other colours"
    if a.filtered == b.filtered:
        return ""
    changed = [i for i, (p, q) in enumerate(zip(a.pixels(), b.pixels())) if p != q]
    if not changed:
        return ""
    y, x = divmod(changed[0], a.width)
    return f"{len(changed)} of {a.width * a.height} pixels differ, the first at column {x}, row {y}"
