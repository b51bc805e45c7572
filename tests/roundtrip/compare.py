"""Holds what came out against the source: each attribute of each kept point, to the bit."""

import numpy as np


class Different(Exception):
    """What came out is not what went in."""


def expect(holds, message):
    if not holds:
        raise Different(message)


def bits(values):
    return np.ascontiguousarray(values).view(f"u{values.dtype.itemsize}")


def same_values(source, found):
    """The same numbers: to the bit in one type, or through a type that holds all of the other's."""
    if source.shape != found.shape:
        return False
    with np.errstate(invalid="ignore", over="ignore"):
        back = found.astype(source.dtype)
    again = back.astype(found.dtype)
    return (np.array_equal(bits(back), bits(source))
            and bool(np.all((again == found) | ((again != again) & (found != found)))))


class PlyNames:
    """One property a component; words that differ."""

    def __init__(self):
        self.taken = {"x", "y", "z"}

    def of(self, column):
        if column.values.ndim == 1:
            return [(self.next(column.name), column.values)]
        return [(self.next(f"{column.name}_{i}"), column.values[:, i])
                for i in range(column.values.shape[1])]

    def next(self, name):
        name = "".join("_" if c <= " " or c == "\x7f" else c for c in name) or "attribute"
        result, n = name, 2
        while result in self.taken:
            result, n = f"{name}_{n}", n + 1
        self.taken.add(result)
        return result


def text32(name, length=32):
    return name.encode("utf-8", "surrogateescape")[:length].decode("utf-8", "surrogateescape")


class LasNames:
    """One column an attribute, of up to three components or of undescribed bytes; 32 bytes a name.

    A field of LAS has its name first, as the reader gives fields before extra bytes."""

    def __init__(self):
        self.taken = set()

    def of(self, column):
        values = column.values
        if values.ndim == 1 or values.shape[1] <= 3 or values.dtype == np.uint8:
            flat = values if values.ndim == 1 or values.shape[1] > 1 else values[:, 0]
            return [(self.next(column.name), flat)]
        return [(self.next(f"{column.name}_{i}"), values[:, i]) for i in range(values.shape[1])]

    def next(self, name):
        whole, n = text32(name), 2
        result = whole
        while result in self.taken:
            result, n = f"{text32(name, 31 - len(str(n)))}_{n}", n + 1
        self.taken.add(result)
        return result


class SameNames:
    def of(self, column):
        values = column.values
        return [(column.name, values[:, 0] if values.ndim == 2 and values.shape[1] == 1 else values)]


def compare_columns(source, found, names):
    """How many attributes there were, each found and the same."""
    there = {c.name: c for c in found}
    for column in source:
        for name, values in names.of(column):
            expect(name in there, f"attribute '{column.name}': expected '{name}', found "
                                  f"{', '.join(there) or 'none'}")
            got = there[name]
            if isinstance(names, LasNames) and not same_values(values, got.values):
                # A field of LAS that cannot hold the values stands empty beside extra bytes of its name.
                got = there.get(f"{name} (2)", got)
            expect(same_values(values, got.values),
                   f"attribute '{column.name}': {values.dtype}{values.shape} "
                   f"{values[:3].tolist()} came out as {got.values.dtype}{got.values.shape} "
                   f"{got.values[:3].tolist()}")
            if not isinstance(names, PlyNames):
                said = (got.scale, got.offset, got.description[:31])
                expect(said == (column.scale, column.offset, column.description[:31]),
                       f"attribute '{column.name}': expected scale, offset and description "
                       f"{column.scale}, {column.offset}, '{column.description}', found {said}")
    return len(source)


def exact_positions(kept):
    """Either way to evaluate a grid: i * scale + offset, or whole steps from zero."""
    ways = [kept.xyz]
    if kept.grid:
        whole = np.rint(kept.grid.offset / kept.grid.scale)
        ways.append((kept.grid.index + whole) * kept.grid.scale)
    return ways


def compare_positions(kept, xyz):
    """Bit for bit, axis by axis."""
    for axis in range(3):
        expect(any(np.array_equal(bits(way[:, axis]), bits(xyz[:, axis]))
                   for way in exact_positions(kept)), f"positions along axis {axis} differ")


def compare_archive(kept, index, columns, manifest):
    """Points of tiles have no order: they are laid beside those of the source by their place."""
    origin, step = np.array(manifest["lattice"]["origin"]), manifest["lattice"]["step"]
    expect(len(index) == len(kept.xyz), f"expected {len(kept.xyz)} points, found {len(index)}")
    exact = (kept.xyz - origin) / step
    xyz = index * step + origin
    told = [a["name"] for a in manifest["attributes"]]
    expect(told == [c.name for c in kept.columns],
           f"the manifest names {told}, the source has {[c.name for c in kept.columns]}")
    failure = None
    # What lies just between two steps may go to either.
    for nearest in (np.floor(exact + 0.5), np.rint(exact), np.ceil(exact - 0.5)):
        order, other = in_place(nearest, kept.columns), in_place(index, columns)
        moved = np.abs(kept.xyz[order] - xyz[other])
        slack = 4 * np.spacing(np.abs(kept.xyz).max(initial=1))
        try:
            expect(bool(np.all(moved <= step / 2 + slack)), "positions move by more than half a step")
            if kept.grid and np.all(kept.grid.scale == step):
                compare_positions(kept.at(order), xyz[other])
            return compare_columns([c.at(order) for c in kept.columns],
                                   [c.at(other) for c in columns], SameNames())
        except Different as error:
            failure = failure or error
    raise failure


def in_place(index, columns):
    """Points ordered by place; those in one place by all that they carry."""
    keys = []
    for column in columns:
        flat = bits(column.values).reshape(len(index), -1)
        keys += [flat[:, i] for i in range(flat.shape[1])]
    return np.lexsort(keys[::-1] + [index[:, 2], index[:, 1], index[:, 0]])


def compare_las(kept, found, told):
    """Of a LAS source the integers, grid, records and header; of any the attributes."""
    expect(len(found.xyz) == len(kept.xyz), f"expected {len(kept.xyz)} points, found {len(found.xyz)}")
    if kept.grid:
        expect(np.array_equal(kept.grid.scale, found.grid.scale)
               and np.array_equal(kept.grid.offset, found.grid.offset), "scale and offset differ")
        expect(np.array_equal(kept.grid.index, found.grid.index), "coordinates differ")
        expect(kept.header == found.header, f"header: expected {kept.header}, found {found.header}")
        expect(kept.records == found.records, "variable-length records differ")
    else:
        moved = np.abs(kept.xyz - found.xyz)
        slack = 4 * np.spacing(np.abs(kept.xyz).max(initial=1))
        expect(bool(np.all(moved <= found.grid.scale / 2 + slack)), "positions move too far")
        expect(not np.any(moved > slack) or "move" in told, "positions moved without a word")
    for column in kept.columns:
        expect(len(column.name.encode("utf-8", "surrogateescape")) <= 32 or column.name in told,
               f"the name {column.name} is cut without a word")
    return compare_columns(kept.columns, found.columns, LasNames())


def compare_ply(kept, found):
    expect(len(found.xyz) == len(kept.xyz), f"expected {len(kept.xyz)} points, found {len(found.xyz)}")
    compare_positions(kept, found.xyz)
    return compare_columns(kept.columns, found.columns, PlyNames())
