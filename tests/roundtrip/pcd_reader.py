"""PCD: ASCII, binary, binary_compressed (LZF)."""

import struct

import numpy as np

from roundtrip.cloud import Cloud, Column, positions_of

NAMES = {"normal_x": "nx", "normal_y": "ny", "normal_z": "nz"}


def decompress_lzf(data, size):
    out, at = bytearray(), 0
    while at < len(data):
        control = data[at]
        at += 1
        if control < 32:
            out += data[at:at + control + 1]
            at += control + 1
            continue
        length = control >> 5
        if length == 7:
            length += data[at]
            at += 1
        back = (control & 31) << 8 | data[at]
        at += 1
        begin = len(out) - back - 1
        if back + 1 >= length + 2:
            out += out[begin:begin + length + 2]
        else:   # what is copied overlaps what is written
            for i in range(length + 2):
                out.append(out[begin + i])
    assert len(out) == size
    return bytes(out)


def read_header(data):
    at, keys = 0, {}
    while "DATA" not in keys:
        end = data.index(b"\n", at)
        words = data[at:end].decode("latin-1").split()
        at = end + 1
        if words and not words[0].startswith("#"):
            keys[words[0]] = words[1:]
    names = keys.get("FIELDS") or keys["COLUMNS"]
    counts = [int(n) for n in keys.get("COUNT", ["1"] * len(names))]
    kinds = ["<" + t.lower() + s for t, s in zip(keys["TYPE"], keys["SIZE"])]
    return keys, list(zip(names, kinds, counts)), at


def read_ascii(data, fields, points):
    rows = [line.split() for line in data.splitlines() if line.strip()][:points]
    place, values = 0, []
    for _, kind, count in fields:
        parse = float if kind[1] == "f" else lambda word: int(float(word))
        values.append(np.array([[parse(w) for w in row[place:place + count]] for row in rows])
                      .reshape(len(rows), count).astype(kind))
        place += count
    return values


def read_binary(data, fields, points):
    layout = np.dtype([(str(i), kind, (count,)) for i, (_, kind, count) in enumerate(fields)])
    rows = np.frombuffer(data, layout, points)
    return [rows[str(i)] for i in range(len(fields))]


def read_compressed(data, fields, points):
    packed, size = struct.unpack_from("<II", data)
    plain, at, values = decompress_lzf(data[8:8 + packed], size), 0, []
    padded = size == points * sum(np.dtype(kind).itemsize * n for _, kind, n in fields)
    for name, kind, count in fields:
        if name == "_" and not padded:
            values.append(None)
            continue
        values.append(np.frombuffer(plain, kind, points * count, at).reshape(points, count))
        at += values[-1].nbytes
    return values


def read_pcd(data):
    keys, fields, at = read_header(data)
    points = int(keys["WIDTH"][0]) * int(keys.get("HEIGHT", ["1"])[0])
    read = {"ascii": read_ascii, "binary": read_binary,
            "binary_compressed": read_compressed}[keys["DATA"][0]]
    columns = []
    for (name, _, count), values in zip(fields, read(data[at:], fields, points)):
        if name == "_":
            continue
        if name in ("rgb", "rgba") and count == 1:
            parts = np.ascontiguousarray(values).view(np.uint8)
            columns += [Column(c, parts[:, i]) for c, i in (("red", 2), ("green", 1), ("blue", 0))]
            columns += [Column("alpha", parts[:, 3])] if name == "rgba" else []
        else:
            columns.append(Column(NAMES.get(name, name), values[:, 0] if count == 1 else values))
    xyz, rest = positions_of(columns)
    lost = ["rows"] if int(keys.get("HEIGHT", ["1"])[0]) > 1 else []
    lost += ["viewpoint"] if keys.get("VIEWPOINT", "0 0 0 1 0 0 0".split()) != "0 0 0 1 0 0 0".split() else []
    return Cloud(xyz, rest, lost=lost)
