"""Clouds as seen from above: a shaded height map with the points on it, written as PNG. For
tools/picture and tools/paper."""

import math
import re
import struct
import zlib

# Colours of the ground and of a point, in the light and in the shade.
PAPER = (255, 255, 255)
LIT_GROUND, DARK_GROUND = (250, 249, 247), (190, 186, 180)
LIT_POINT, DARK_POINT = (70, 100, 146), (10, 22, 46)
SHADES, INKS = 20, 5


def read_ply(path):
    """Positions of a binary PLY of floats or doubles that begins with them."""
    header, _, body = path.read_bytes().partition(b"end_header\n")
    vertices = re.search(rb"element vertex (\d+)\s+property (float|double) x\s+property \2 y\s+"
                         rb"property \2 z\s+(element|$)", header)
    if b"format binary_little_endian" not in header or vertices is None:
        raise SystemExit(f"{path}: expected a binary PLY of positions")
    place = struct.Struct("<3f" if vertices[2] == b"float" else "<3d")
    return list(place.iter_unpack(body[:int(vertices[1]) * place.size]))


class Relief:
    """The upper surface of a cloud as a height map: what can be seen from above, and its shade."""

    def __init__(self, points, cell):
        self.cell = cell
        highest, sums = {}, {}
        for x, y, z in points:
            cell = (math.floor(x / self.cell), math.floor(y / self.cell))
            highest[cell] = max(z, highest.get(cell, z))
        for x, y, z in points:
            cell = (math.floor(x / self.cell), math.floor(y / self.cell))
            if z > highest[cell] - self.cell:
                total, count = sums.get(cell, (0.0, 0))
                sums[cell] = (total + z, count + 1)
        self.top = {cell: total / count for cell, (total, count) in sums.items()}

    def height(self, x, y):
        """Between the middles of four cells; None beside the cloud."""
        u, v = x / self.cell - 0.5, y / self.cell - 0.5
        i, j = math.floor(u), math.floor(v)
        corners = [self.top.get((i + a, j + b)) for b in (0, 1) for a in (0, 1)]
        if None in corners:
            return None
        u, v = u - i, v - j
        low = corners[0] * (1 - u) + corners[1] * u
        high = corners[2] * (1 - u) + corners[3] * u
        return low * (1 - v) + high * v

    def sees(self, point):
        """True for a point of the upper surface; at the rim, where both meet, for those above it."""
        x, y, z = point
        height = self.height(x, y)
        return z > -0.05 if height is None else z > height - 0.5 * self.cell

    def light(self, x, y):
        """Brightness in [0, 1] under a lamp at the upper left; None beside the cloud."""
        step = 0.75 * self.cell
        around = [self.height(x + a * step, y + b * step)
                  for a, b in ((-1, 0), (1, 0), (0, -1), (0, 1))]
        if None in around:
            return None
        dx, dy = (around[1] - around[0]) / (2 * step), (around[3] - around[2]) / (2 * step)
        cosine = (0.65 * dx - 0.65 * dy + 0.4) / math.sqrt(dx * dx + dy * dy + 1)
        return min(1.0, max(0.0, 0.15 + 1.2 * cosine))


class Panel:
    """A view from above: shade and ink a pixel, both in [0, 1]."""

    def __init__(self, view, width):
        self.middle, self.size = view[:2], view[2:]
        self.scale = width / self.size[0]
        self.width, self.height = width, round(self.size[1] * self.scale)
        self.shade = [None] * (self.width * self.height)  # None: paper
        self.ink = [0.0] * (self.width * self.height)

    def draw_relief(self, relief):
        for row in range(self.height):
            y = self.middle[1] + (self.height / 2 - row - 0.5) / self.scale
            for column in range(self.width):
                x = self.middle[0] + (column + 0.5 - self.width / 2) / self.scale
                light = relief.light(x, y)
                if light is not None:
                    self.shade[row * self.width + column] = 1 - light

    def draw_points(self, points, radius):
        """Discs with soft edges."""
        reach = math.ceil(radius)
        for x, y, _ in points:
            u = (x - self.middle[0]) * self.scale + self.width / 2 - 0.5
            v = self.height / 2 - (y - self.middle[1]) * self.scale - 0.5
            if not (-reach < u < self.width + reach and -reach < v < self.height + reach):
                continue
            for row in range(max(0, round(v) - reach), min(self.height, round(v) + reach + 1)):
                for column in range(max(0, round(u) - reach), min(self.width, round(u) + reach + 1)):
                    cover = radius + 0.5 - math.hypot(column - u, row - v)
                    at = row * self.width + column
                    self.ink[at] = max(self.ink[at], min(1.0, cover))


def mix(a, b, share):
    return tuple(round(p + (q - p) * share) for p, q in zip(a, b))


def palette():
    """Paper, then a colour for each level of ink and of shade."""
    shades = [shade / (SHADES - 1) for shade in range(SHADES)]
    return [PAPER] + [mix(mix(LIT_GROUND, DARK_GROUND, shade), mix(LIT_POINT, DARK_POINT, shade),
                      ink / (INKS - 1))
                  for ink in range(INKS) for shade in shades]


def compose(rows, gap):
    """Panels side by side, rows below each other, as lines of palette indices."""
    lines = []
    for panels in rows:
        if lines:
            lines += [bytes(len(lines[0]))] * gap
        for row in range(panels[0].height):
            line = bytearray()
            for panel in panels:
                if line:
                    line += bytes(gap)
                begin = row * panel.width
                for at in range(begin, begin + panel.width):
                    shade, ink = panel.shade[at], round(panel.ink[at] * (INKS - 1))
                    if shade is None and ink == 0:
                        line.append(0)
                    else:
                        line.append(1 + ink * SHADES + round((shade or 0) * (SHADES - 1)))
            lines.append(bytes(line))
    return lines


def write_png(path, lines):
    def part(kind, data):
        return (struct.pack(">I", len(data)) + kind + data +
                struct.pack(">I", zlib.crc32(kind + data)))

    header = struct.pack(">IIBBBBB", len(lines[0]), len(lines), 8, 3, 0, 0, 0)
    colours = b"".join(bytes(colour) for colour in palette())
    image = zlib.compress(b"".join(b"\0" + line for line in lines), 9)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + part(b"IHDR", header) + part(b"PLTE", colours) +
                     part(b"IDAT", image) + part(b"IEND", b""))
