"""Draco files, by way of Draco's own decoder (undraco); knap's tiles by docs/formats.md."""

import json
import subprocess

import numpy as np

from roundtrip.cloud import Cloud, Column

TYPES = [None, "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8", "u1"]
NAMED = {"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
         "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8"}
POSITION, NORMAL, COLOUR, TEXTURE = range(4)
PARTS = {NORMAL: ["nx", "ny", "nz"], COLOUR: ["red", "green", "blue", "alpha"], TEXTURE: ["s", "t"]}


def decode(undraco, paths, scratch):
    """Of each file the metadata of the cloud, and (kind, values, metadata) of each attribute."""
    for first in range(0, len(paths), 500):
        names = [(path, f"{scratch}.{i}") for i, path in enumerate(paths[first:first + 500])]
        subprocess.run([undraco, *(name for pair in names for name in pair)], check=True)
        for _, name in names:
            with open(name, "rb") as file:
                yield parse(file.read())


def parse(data):
    at = data.index(b"\nend\n") + 5
    cloud, attributes, meta = {}, [], None
    for line in data[:at - 5].decode().split("\n"):
        words = line.split(" ")
        if words[0] == "points":
            points, meta = int(words[1]), cloud
        elif words[0] == "attribute":
            meta = {}
            attributes.append([int(words[1]), TYPES[int(words[2])], int(words[3]), meta])
        elif words[0] == "text":
            meta.setdefault(words[1], bytes.fromhex(words[2]))
        else:
            meta[words[1] + "#"] = float(words[2])
    result = []
    for kind, dtype, components, meta in attributes:
        values = np.frombuffer(data, dtype, points * components, at).reshape(points, components)
        at += values.nbytes
        result.append((kind, values, meta))
    return cloud, result


def columns_of(attributes):
    columns = []
    for kind, values, meta in attributes:
        if "type" in meta:   # of knap: a larger type than that of the values is stored in parts
            values = np.ascontiguousarray(values).view(NAMED[meta["type"].decode()])
        components = values.shape[1]
        name = meta.get("name", b"").decode("utf-8", "surrogateescape")
        if kind in PARTS and components <= len(PARTS[kind]) and name in ("", "color", "normal"):
            columns += [Column(n, values[:, i]) for i, n in enumerate(PARTS[kind][:components])]
        else:
            columns.append(Column(name, values[:, 0] if components == 1 else values,
                                  meta.get("scale#", 1.0), meta.get("offset#", 0.0),
                                  meta.get("description", b"").decode("utf-8", "surrogateescape")))
    return columns


def read_draco(undraco, path, scratch):
    _, attributes = next(decode(undraco, [path], scratch))
    xyz = next(values for kind, values, _ in attributes if kind == POSITION)
    # The eighth byte tells a mesh from a point cloud.
    lost = ["faces of the mesh"] if path.read_bytes()[7] == 1 else []
    return Cloud(xyz.astype(np.float64), columns_of([a for a in attributes if a[0] != POSITION]),
                 lost=lost)


def read_archive(undraco, folder, scratch):
    """The points of all tiles as indices on the archive's lattice, and the manifest."""
    manifest = json.loads((folder / "manifest.json").read_text())
    step = manifest["lattice"]["step"]
    index, columns = [], None
    tiles = manifest["tiles"]
    clouds = decode(undraco, [folder / tile["file"] for tile in tiles], scratch)
    for tile, (_, attributes) in zip(tiles, clouds):
        local = next(values for kind, values, _ in attributes if kind == POSITION)
        index.append(np.rint(local.astype(np.float64) / step).astype(np.int64)
                     + np.array(tile["origin"]))
        found = columns_of([a for a in attributes if a[0] != POSITION])
        columns = columns or [[] for _ in found]
        for column, more in zip(columns, found, strict=True):
            column.append(more)
    joined = [Column(c[0].name, np.concatenate([part.values for part in c]), c[0].scale, c[0].offset,
                     c[0].description) for c in columns or []]
    return np.concatenate(index) if index else np.empty((0, 3), np.int64), joined, manifest


def cloud_of_archive(undraco, folder, scratch):
    index, columns, manifest = read_archive(undraco, folder, scratch)
    order = [attribute["name"] for attribute in manifest["attributes"]]
    columns.sort(key=lambda column: order.index(column.name))
    return Cloud(index * manifest["lattice"]["step"] + np.array(manifest["lattice"]["origin"]), columns)
