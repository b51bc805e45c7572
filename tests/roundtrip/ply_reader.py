"""PLY: ASCII and binary of both byte orders."""

import numpy as np

from roundtrip.cloud import Cloud, Column, positions_of

TYPES = {"char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
         "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
         "float": "f4", "float32": "f4", "double": "f8", "float64": "f8"}


def read_header(data):
    """Elements, each (name, count, [(property, type, type of a list's length)]), and where data begin."""
    ending = b"\r" if b"\r" in data[:8] and b"\r\n" not in data[:8] else b"\n"
    at, elements, order = 0, [], None
    while True:
        end = data.index(ending, at)
        words = data[at:end].decode("utf-8", "surrogateescape").split()
        at = end + 1
        if words[:1] == ["format"]:
            order = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}[words[1]]
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            is_list = words[1] == "list"
            elements[-1][2].append((words[-1], TYPES[words[3 if is_list else 1]],
                                    TYPES[words[2]] if is_list else None))
        elif words[:1] == ["end_header"]:
            return elements, order, at


def skip_binary(data, at, count, properties, order):
    """Where the element behind this one begins."""
    for _ in range(count):
        for _, kind, length in properties:
            if length:
                n = int(np.frombuffer(data, order + length, 1, at)[0])
                at += np.dtype(length).itemsize + n * np.dtype(kind).itemsize
            else:
                at += np.dtype(kind).itemsize
    return at


def read_binary(data, at, elements, order):
    for name, count, properties in elements:
        if name == "vertex":
            break
        at = skip_binary(data, at, count, properties, order)
    if all(length is None for _, _, length in properties):
        layout = [(str(i), order + kind) for i, (_, kind, _) in enumerate(properties)]
        rows = np.frombuffer(data, np.dtype(layout), count, at)
        return [rows[str(i)].astype(kind) for i, (_, kind, _) in enumerate(properties)]
    values = [[] for _ in properties]
    for _ in range(count):
        for i, (_, kind, length) in enumerate(properties):
            n = 1
            if length:
                n = int(np.frombuffer(data, order + length, 1, at)[0])
                at += np.dtype(length).itemsize
            values[i].append(np.frombuffer(data, order + kind, n, at))
            at += n * np.dtype(kind).itemsize
    return [np.array([v[0] for v in value], kind) if not length else None
            for value, (_, kind, length) in zip(values, properties)]


def parse(words, kind):
    if kind[0] == "f":
        return np.array([float(w) for w in words], np.float64).astype(kind)
    return np.array([int(float(w)) for w in words]).astype(kind)


def read_ascii(data, at, elements):
    lines = (line for line in data[at:].replace(b"\r", b"\n").split(b"\n") if line.strip())
    for name, count, properties in elements:
        if name == "vertex":
            break
        for _ in range(count if properties else 0):
            next(lines)
    rows = [next(lines).split() for _ in range(count)]
    for row in rows:
        place = 0
        for i, (_, _, length) in enumerate(properties):
            if length:   # a list becomes one word, so that what follows it has its place
                row[place:place + 1 + int(row[place])] = [b"0"]
            place += 1
    return [None if length else parse([row[i] for row in rows], kind)
            for i, (_, kind, length) in enumerate(properties)]


def read_ply(data):
    elements, order, at = read_header(data)
    values = (read_ascii(data, at, elements) if order is None
              else read_binary(data, at, elements, order))
    vertex = next(e for e in elements if e[0] == "vertex")
    columns = [Column(name, column) for (name, _, length), column in zip(vertex[2], values)
               if length is None]
    xyz, rest = positions_of(columns)
    lost = [f"list property '{name}'" for name, _, length in vertex[2] if length]
    lost += [f"element '{name}'" for name, count, _ in elements if name != "vertex" and count]
    return Cloud(xyz, rest, lost=lost)
