"""Text: columns of numbers, separated by blanks, commas or semicolons, with or without a header."""

import csv

import numpy as np

from roundtrip.cloud import Cloud, Column, positions_of


def is_number(word):
    try:
        float(word)
        return True
    except ValueError:
        return False


def read_text(data):
    if data.startswith(b"\xef\xbb\xbf"):
        data = data[3:]
    lines, comment = [], ""
    for line in data.decode("utf-8", "surrogateescape").splitlines():
        is_comment = line.lstrip().startswith(("#", "//"))
        comment = line.strip(" \t#/") if is_comment and not lines else comment
        lines += [line] if line.strip() and not is_comment else []
    separator = next((s for s in ";," if s in lines[0] or s in lines[-1]), None)
    if separator:
        rows = list(csv.reader(lines, delimiter=separator, skipinitialspace=True))
        rows = [[word.strip() for word in row] for row in rows]
    else:
        rows = [line.split() for line in lines]
    names, is_pts = [], len(rows[0]) == 1
    if is_pts:
        rows = [row for row in rows if len(row) > 1]   # without counts, which need not be right
        if len(rows[0]) in (4, 7):
            names = ["x", "y", "z", "intensity", "red", "green", "blue"][:len(rows[0])]
    elif not any(is_number(word) for word in rows[0]):
        names, rows = [word.strip('"') for word in rows[0]], rows[1:]
    width = len(rows[0])
    said = [word.strip() for word in (comment.split(separator) if separator else comment.split())]
    if not names and len(said) == width and {"x", "y", "z"} <= {word.lower() for word in said}:
        names = said
    names = names or ["x", "y", "z"]
    names += [f"column{i + 1}" for i in range(len(names), width)]
    columns, lost = [], []
    for i, name in enumerate(names):
        words = [row[i] if i < len(row) else "" for row in rows]
        if all(not w or is_number(w) for w in words):
            columns.append(Column(name or f"column{i + 1}",
                                  np.array([float(w) if w else np.nan for w in words])))
        else:
            lost.append(f"words in column '{name or f'column{i + 1}'}'")
    xyz, rest = positions_of(columns)
    return Cloud(xyz, rest, lost=lost)


def read_ptx(data):
    """Scans one behind the other; a cell at 0 0 0 has no return, and none of those in the folder is."""
    rows = [line.split() for line in data.decode("ascii").splitlines() if line.strip()]
    points, values = [], []
    while rows:
        cells = int(rows[0][0]) * int(rows[1][0])
        matrix = np.array(rows[6:10], float)
        scan = np.array(rows[10:10 + cells], float)
        points.append(np.column_stack([scan[:, :3], np.ones(cells)]) @ matrix)
        values.append(scan[:, 3:])
        rows = rows[10 + cells:]
    xyz, rest = np.concatenate(points)[:, :3], np.concatenate(values)
    names = ["intensity", "red", "green", "blue"][:rest.shape[1]]
    columns = [Column(name, rest[:, i] if i == 0 else rest[:, i].astype(np.uint8))
               for i, name in enumerate(names)]
    return Cloud(xyz, columns, lost=["places and axes of scanners"])
