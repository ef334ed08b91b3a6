"""Reads 8-bit RGB or RGBA PNG files, the only kinds that the programs write, with Python's standard library only."""

import struct
import zlib


class Picture:
    def __init__(self, path):
        data = open(path, "rb").read()
        assert data[:8] == b"\x89PNG\r\n\x1a\n", f"{path}: not a PNG"
        at, packed = 8, b""
        while at < len(data):
            (length,), kind = struct.unpack(">I", data[at : at + 4]), data[at + 4 : at + 8]
            body = data[at + 8 : at + 8 + length]
            if kind == b"IHDR":
                self.width, self.height, depth, colour = struct.unpack(">IIBB", body[:10])
                assert depth == 8 and colour in (2, 6), f"{path}: unexpected format"
                self.channels = 3 if colour == 2 else 4
            elif kind == b"IDAT":
                packed += body
            at += 12 + length
        self.rows = self._unfilter(zlib.decompress(packed))

    def _unfilter(self, raw):
        n, stride, rows = self.channels, self.width * self.channels, []
        above = bytearray(stride)
        for y in range(self.height):
            kind = raw[y * (stride + 1)]
            row = bytearray(raw[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
            for i in range(stride if kind else 0):
                left = row[i - n] if i >= n else 0
                up, corner = above[i], above[i - n] if i >= n else 0
                if kind == 1:
                    guess = left
                elif kind == 2:
                    guess = up
                elif kind == 3:
                    guess = (left + up) // 2
                else:
                    p = left + up - corner
                    a, b, c = abs(p - left), abs(p - up), abs(p - corner)
                    guess = left if a <= b and a <= c else up if b <= c else corner
                row[i] = (row[i] + guess) & 255
            rows.append(row)
            above = row
        return rows

    def blocks(self, area, size=16):
        """Returns mean colors of the blocks of an area (x, y, width, height)."""
        x0, y0, width, height = (int(v) for v in area)
        assert x0 + width <= self.width and y0 + height <= self.height, "the area is not in the picture"
        means = []
        for y in range(y0, y0 + height - size + 1, size):
            for x in range(x0, x0 + width - size + 1, size):
                total = [0, 0, 0]
                for row in self.rows[y : y + size]:
                    for c in range(3):
                        total[c] += sum(row[x * self.channels + c : (x + size) * self.channels : self.channels])
                means.append([t / (size * size) for t in total])
        return means

    def mean(self, area):
        blocks = self.blocks(area)
        return sum(sum(b) for b in blocks) / (3 * len(blocks))


def difference(a, b, area, other=None):
    """Returns mean and maximum difference of block means, on a scale of 255."""
    pairs = list(zip(a.blocks(area), b.blocks(other or area), strict=True))
    each = [max(abs(p - q) for p, q in zip(x, y)) for x, y in pairs]
    return sum(each) / len(each), max(each)
