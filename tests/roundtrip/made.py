"""Files as the programs of others write them, and as odd ones could: each is (name, bytes)."""

import gzip
import struct

import numpy as np

from roundtrip.las_reader import FORMATS

PLY_TYPES = [("char", "i1"), ("int8", "i1"), ("uchar", "u1"), ("uint8", "u1"), ("short", "i2"),
             ("int16", "i2"), ("ushort", "u2"), ("uint16", "u2"), ("int", "i4"), ("int32", "i4"),
             ("uint", "u4"), ("uint32", "u4"), ("float", "f4"), ("float32", "f4"), ("double", "f8"),
             ("float64", "f8")]
POINTS = 300


def any_bits(rng, kind, n):
    """Every pattern of bits is a value: NaNs with a payload too."""
    return np.frombuffer(rng.bytes(np.dtype(kind).itemsize * n), kind)


def places(rng, n, kind="f8", origin=0.0, size=10.0):
    xyz = (rng.random((n, 3)) * size + origin).astype(kind)
    xyz[n // 2] = xyz[n // 3]   # two in one place
    return xyz


def ply(order, elements, comments=("comment made", "obj_info of no use"), ending="\n"):
    """Elements: (name, [(type, name, values)]); a list property has (length's type, type) and lists."""
    head = ["ply", f"format {order} 1.0", *comments]
    for name, properties in elements:
        head.append(f"element {name} {len(properties[0][2]) if properties else 0}")
        for kind, label, _ in properties:
            words = kind if isinstance(kind, str) else f"list {kind[0]} {kind[1]}"
            head.append(f"property {words} {label}")
    out = bytearray((ending.join(head + ["end_header"]) + ending).encode())
    numpy_type = dict(PLY_TYPES)
    sign = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[order]
    for _, properties in elements:
        for i in range(len(properties[0][2]) if properties else 0):
            words = []
            for kind, _, values in properties:
                items = [values[i]] if isinstance(kind, str) else list(values[i])
                if sign and not isinstance(kind, str):
                    out += np.array(len(items), sign + numpy_type[kind[0]]).tobytes()
                if sign:
                    item = numpy_type[kind if isinstance(kind, str) else kind[1]]
                    out += np.array(items, sign + item).tobytes()
                else:
                    words += [] if isinstance(kind, str) else [str(len(items))]
                    words += [repr(v.item()) for v in items]
            out += (" ".join(words) + "\n").encode() if not sign else b""
    return bytes(out)


def plys(rng):
    orders = ("ascii", "binary_little_endian", "binary_big_endian")
    for order in orders:
        xyz = places(rng, POINTS)
        every = [("double", axis, xyz[:, i]) for i, axis in enumerate("xyz")]
        for i, (word, kind) in enumerate(PLY_TYPES):
            values = any_bits(rng, kind, POINTS)
            if order == "ascii" and kind[0] == "f":
                values = rng.standard_normal(POINTS).astype(kind)
            every.insert(int(rng.integers(len(every) + 1)), (word, f"{word}_{i}", values))
        yield f"every_type_{order}.ply", ply(order, [("vertex", every)])
        # MeshLab and its like: texture, quality, a list in the vertex, elements before and behind.
        xyz = places(rng, POINTS, "f4")
        lists = [any_bits(rng, "i4", int(rng.integers(4))) for _ in range(POINTS)]
        vertex = [("float", "z", xyz[:, 2]), (("uchar", "int"), "around", lists),
                  ("float", "x", xyz[:, 0]), ("float", "s", xyz[:, 1] / 7), ("float", "y", xyz[:, 1]),
                  ("uchar", "red", any_bits(rng, "u1", POINTS)),
                  ("uchar", "green", any_bits(rng, "u1", POINTS)),
                  ("uchar", "blue", any_bits(rng, "u1", POINTS)),
                  ("double", "quality", rng.standard_normal(POINTS)),
                  ("double", "quality", rng.standard_normal(POINTS)),
                  ("float", "scalar_Scalar_field_of_a_name_that_is_long_(m)", xyz[:, 0] * 3),
                  ("float", "scalar_Scalar_field_of_a_name_that_is_long_(s)", xyz[:, 1] * 3),
                  ("int", "größe", any_bits(rng, "i4", POINTS))]
        camera = [("float", "view_px", np.ones(2, "f4")), (("uint8", "int"), "of", lists[:2])]
        faces = [(("uchar", "int"), "vertex_indices", [np.arange(3, dtype="i4")] * 5),
                 (("uchar", "float"), "texcoord", [np.ones(6, "f4")] * 5)]
        yield (f"meshlab_{order}.ply",
               ply(order, [("camera", camera), ("vertex", vertex), ("face", faces), ("edge", [])],
                   ending="\r\n" if order != "ascii" else "\n"))
    # 16-bit colours, normals, positions far from zero, some that are not finite, values of all bits.
    xyz = places(rng, POINTS, "f8", 4.3e6, 100)
    xyz[5, 1], xyz[6, 2] = np.nan, -np.inf
    colours = [("ushort", c, any_bits(rng, "u2", POINTS)) for c in ("red", "green", "blue")]
    normals = [("float", n, any_bits(rng, "f4", POINTS)) for n in ("nx", "ny", "nz")]
    vertex = [("double", axis, xyz[:, i]) for i, axis in enumerate("xyz")] + normals + colours
    yield "far_with_holes.ply", ply("binary_little_endian", [("vertex", vertex)])
    yield "far_with_holes.ply.gz", gzip.compress(ply("binary_big_endian", [("vertex", vertex)]))
    nice = places(rng, POINTS, "f4")
    vertex = [("float", axis, nice[:, i]) for i, axis in enumerate("xyz")]
    vertex += [("float", n, nice[:, i] / 20) for i, n in enumerate(("nx", "ny", "nz"))]
    vertex += [("uchar", c, any_bits(rng, "u1", POINTS)) for c in ("red", "green", "blue", "alpha")]
    yield "mixed_colours.ply", ply("binary_little_endian", [("vertex", vertex)])
    mixed = [("short", "x", any_bits(rng, "i2", 50)), ("float", "y", xyz[:50, 0].astype("f4")),
             ("double", "z", rng.random(50)), ("uint", "intensity", any_bits(rng, "u4", 50)),
             ("uchar", "classification", any_bits(rng, "u1", 50)), ("float", "kept", np.ones(50, "f4"))]
    yield "mixed_axes.ply", ply("binary_big_endian", [("vertex", mixed)])
    for n in (1, 2):
        one = [("float", axis, np.full(n, 0.1, "f4")) for axis in "xyz"] + [("int", "a", np.arange(n, dtype="i4"))]
        yield f"of_{n}_in_one_place.ply", ply("ascii", [("vertex", one)])


def descriptor(kind, options, name, scales=(0, 0, 0), offsets=(0, 0, 0), description=b""):
    return (struct.pack("<2xBB32s4x", kind, options, name) + bytes(72)
            + struct.pack("<3d3d32s", *scales, *offsets, description))


def record(user, number, content, description=b"", extended=False):
    return struct.pack("<H16sH" + ("Q" if extended else "H") + "32s", 0xAABB if not extended else 0, user,
                       number, len(content), description) + content


def las(rng, minor, form, extra=(), records=(), extended=(), gap=b"", scale=(0.01, 0.01, 0.001),
        offset=(5e5, 4e6, 0.0), room=b"", n=POINTS, wide=False):
    layout = np.dtype(FORMATS[form])
    bits = np.frombuffer(rng.bytes(layout.itemsize * n), np.uint8).reshape(n, -1).copy()
    rows = bits.view(layout)[:, 0]
    for axis in "xyz":
        rows[axis] = any_bits(rng, "i4", n) >> (0 if wide else 12)
    tail = np.frombuffer(rng.bytes(n * sum(extra)), np.uint8).reshape(n, -1)
    body = np.concatenate([bits, tail], axis=1).tobytes()
    size = {0: 227, 1: 227, 2: 227, 3: 235, 4: 375}[minor] + len(room)
    vlrs = b"".join(records)
    start = size + len(vlrs) + len(gap)
    returns = np.bincount(rows["bits" if form < 6 else "returns"] & (7 if form < 6 else 15), minlength=16)
    legacy = n if form < 6 else 0
    head = struct.pack("<4sHH16sBB32s32sHHHIIBHI5I", b"LASF", 7, 16 if any(b"WKT" in r for r in records) else 0,
                       bytes(range(16)), 1, minor, b"a scanner of\0junk", b"software", 200, 2021, size, start,
                       len(records), form, layout.itemsize + sum(extra), legacy,
                       *(returns[1:6] if legacy else [0] * 5))
    index = np.stack([rows[a] for a in "xyz"], 1)
    low, high = index.min(0) * scale + offset, index.max(0) * scale + offset
    head += struct.pack("<12d", *scale, *offset, *(v for pair in zip(high, low) for v in pair))
    if minor >= 3:
        head += struct.pack("<Q", 0)
    if minor >= 4:
        head += struct.pack("<QIQ15Q", start + len(body) if extended else 0, len(extended), n, *returns[1:16])
    return head + room + vlrs + gap + body + b"".join(extended)


def lases(rng):
    keys = struct.pack("<16H", 1, 1, 0, 3, 1024, 0, 1, 1, 2048, 0, 1, 4326, 3072, 0, 1, 32633)
    geo = [record(b"LASF_Projection", 34735, keys, b"GeoTIFF\0with junk"),
           record(b"LASF_Projection", 34736, struct.pack("<2d", 0.5, 298.25)),
           record(b"LASF_Projection", 34737, b"WGS 84 / UTM|zone 33N|\0")]
    own = [record(b"a vendor", 7, rng.bytes(1000), b"x" * 32), record(b"a vendor", 7, b"again"),
           record(b"LASF_Spec", 0, b"\x02Ground".ljust(16, b"\0")), record(b"", 0, b"")]
    wkt = [record(b"LASF_Projection", 2112, b'LOCAL_CS["WKT, odd",UNIT["metre",1]]\0')]
    for minor, form in [(0, 0), (0, 1), (1, 1), (2, 0), (2, 1), (2, 2), (2, 3), (3, 4), (3, 5), (4, 3),
                        (4, 6), (4, 7), (4, 8), (4, 9), (4, 10)]:
        records = geo + own if form < 6 else wkt + own
        gap = b"\xdd\xcc" if minor == 0 else bytes(rng.integers(9))
        yield f"las_1{minor}_{form}.las", las(rng, minor, form, records=records, gap=gap)
    sizes = [1, 1, 2, 2, 4, 4, 8, 8, 4, 8]
    described, extra = [], []
    for kind in range(1, 31):
        described.append(descriptor(kind, 24 if kind % 2 else 0, b"dim %d" % kind, (0.5, 0.5, 0.5), (3, 3, 3),
                                    b"of kind %d" % kind))
        extra.append(sizes[(kind - 1) % 10] * ((kind - 1) // 10 + 1))
    described += [descriptor(0, 5, b"bytes"), descriptor(14, 8, b"own scales", (1, 2, 0)),
                  descriptor(3, 7, b"with a missing one"), descriptor(9, 0, b"dim 1")]
    extra += [5, 4, 2, 4, 3]   # the last three without a descriptor
    for form in (1, 7):
        yield (f"extra_bytes_{form}{'_extended' if form == 7 else ''}.las",
               las(rng, 4, form, extra, [record(b"LASF_Spec", 4, b"".join(described))],
                   [record(b"a vendor", 9, rng.bytes(70000), extended=True)] if form == 7 else []))
    yield "undescribed.las", las(rng, 2, 0, [9])
    yield "odd_grid.las", las(rng, 2, 1, scale=(1 / 3, 0.1, 1e-7), offset=(1e-3, -7.77, 1 / 7), room=b"room")
    yield "whole_range.las", las(rng, 4, 6, scale=(1e-3, 1e-3, 1e-3), offset=(0, 0, 0), wide=True)
    yield "coarse.las", las(rng, 2, 3, scale=(1, 1, 1), offset=(0.5, 0.5, 0.5))


def lzf(data):
    """Copies of what stands 1 to 8192 bytes before, where there are; else as it is."""
    out, literal, at, seen = bytearray(), bytearray(), 0, {}

    def flush():
        for first in range(0, len(literal), 32):
            part = literal[first:first + 32]
            out.append(len(part) - 1)
            out.extend(part)
        literal.clear()

    while at < len(data):
        key = data[at:at + 3]
        back = at - seen.get(key, at) - 1
        seen[key] = at
        length = 0
        while len(key) == 3 and 0 <= back < 8192 and length < 264 and at + length < len(data) \
                and data[at + length] == data[at + length - back - 1]:
            length += 1
        if length < 3:
            literal.append(data[at])
            at += 1
            continue
        flush()
        out += bytes([length - 2 << 5 | back >> 8] if length < 9 else [7 << 5 | back >> 8, length - 9])
        out.append(back & 255)
        at += length
    flush()
    return bytes(out)


def pcd(encoding, fields, n, height=1, viewpoint="0 0 0 1 0 0 0", ending="\n", padded=False):
    """Fields: (name, type, values as n x count)."""
    kind = lambda values: {"f": "F", "i": "I", "u": "U"}[values.dtype.kind]
    head = ["# .PCD v0.7 - Point Cloud Data file format", "VERSION 0.7",
            "FIELDS " + " ".join(name for name, _ in fields),
            "SIZE " + " ".join(str(v.dtype.itemsize) for _, v in fields),
            "TYPE " + " ".join(kind(v) for _, v in fields),
            "COUNT " + " ".join(str(v.shape[1]) for _, v in fields),
            f"WIDTH {n // height}", f"HEIGHT {height}", f"VIEWPOINT {viewpoint}", f"POINTS {n}",
            f"DATA {encoding}"]
    out = (ending.join(head) + ending).encode()
    if encoding == "ascii":
        rows = [" ".join(repr(v.item()) for _, values in fields for v in values[i]) for i in range(n)]
        return out + (ending.join(rows) + ending).encode()
    if encoding == "binary":
        return out + b"".join(v[i].tobytes() for i in range(n) for _, v in fields)
    plain = b"".join(v.tobytes() for name, v in fields if padded or name != "_")
    packed = lzf(plain)
    return out + struct.pack("<II", len(packed), len(plain)) + packed


def pcds(rng):
    n = 240
    for encoding in ("ascii", "binary", "binary_compressed"):
        ascii_only = encoding == "ascii"
        real = lambda kind, count: (rng.standard_normal((n, count)).astype(kind) if ascii_only
                                    else any_bits(rng, kind, n * count).reshape(n, count))
        xyz = places(rng, n, "f4")
        xyz[3, 0] = np.nan
        whole = lambda kind, count=1: any_bits(rng, kind, n * count).reshape(n, count)
        fields = [("x", xyz[:, :1]), ("y", xyz[:, 1:2]), ("z", xyz[:, 2:]), ("_", whole("u1", 4)),
                  ("normal_x", real("f4", 1)), ("normal_y", real("f4", 1)), ("normal_z", real("f4", 1)),
                  ("curvature", real("f4", 1)), ("fpfh", real("f4", 33)), ("label", whole("u4")),
                  ("ring", whole("u2")), ("t", whole("i8") >> 12), ("stamp", rng.random((n, 1))),
                  ("small", whole("i1", 2)), ("_", whole("u1", 3)), ("rgba", whole("u4"))]
        yield f"fields_{encoding}.pcd", pcd(encoding, fields, n, 12, "1 2 3 0.5 0.5 0.5 0.5")
        far = places(rng, n, "f8", 4.3e6, 500)
        fields = [("intensity", whole("u1")), *((a, far[:, i:i + 1]) for i, a in enumerate("xyz")),
                  ("rgb", (whole("u4") & 0xFFFFFF) if ascii_only else real("f4", 1))]
        yield (f"far_{encoding}.pcd", pcd(encoding, fields, n, padded=True,
                                          ending="\r\n" if ascii_only else "\n"))


def texts(rng):
    xyz = places(rng, 40, "f8", 4.3e5, 30)
    more = rng.standard_normal((40, 3))

    def lines(separator, head, rows, ending="\n"):
        return (ending.join(([head] if head else []) + [separator.join(map(repr, row)) for row in rows])
                + ending).encode()

    rows = np.concatenate([xyz, more], 1).tolist()
    yield "tabs.txt", lines("\t", "", rows)
    yield "tabs_with_header.tsv", lines("\t", "X\tY\tZ\tReflectance\tDeviation\tAmplitude", rows)
    yield "semicolons.csv", lines(";", "id;x;y;z;n;m", [r[3:4] + r[:5] for r in rows], "\r\n")
    yield "bom.csv", b"\xef\xbb\xbf" + lines(", ", '"X","Y","Z","a, b","","quality"', rows)
    yield "comments.xyz", b"# made\n// by hand\n\n" + lines("  ", "", rows) + b"# end\n"
    yield "comments.xyz.gz", gzip.compress(b"# made\n" + lines(" ", "", rows))
    yield "quoted.csv", b'"x","y","z","v"\n' + b"".join(b'"%r","%r","%r","%r"\n' % tuple(r[:4]) for r in rows)
    yield "missing.csv", b"x,y,z,a,b\n" + b"".join(b"%r,%r,%r,%s,%s\n" % (*r[:3], b"" if i % 3 else b"1.5",
                                                   b"" if i % 2 else b"-7") for i, r in enumerate(rows))
    yield "words.csv", b"x,y,z,name,v\n" + b"".join(b"%r,%r,%r,oak,%r\n" % tuple(r[:4]) for r in rows)
    yield "odd_numbers.xyz", b"+1 2. .5 1e-320\n-0 1e3 -.5E-2 -inf\n0 0 0 nan\n1e5 1E+5 7 -0.0\n"
    yield "several_scans.pts", b"2\n0 0 1 5\n1 0 0 6\n1\n0 1 0 7\n"
    yield "names_in_a_comment.asc", lines(" ", "//X Y Z R G B", rows)
    yield "no_end.xyz", lines(" ", "", rows)[:-1]
    yield "old_mac.txt", lines(" ", "x y z a b c", rows, "\r")


def made_files(seed=20):
    rng = np.random.default_rng(seed)
    for maker in (plys, lases, pcds, texts):
        yield from maker(rng)
