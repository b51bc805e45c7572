"""A cloud as its file has it: what the readers beside this file return."""

from dataclasses import dataclass, field

import numpy as np


@dataclass
class Column:
    """What points carry beside their position, under the name that docs/formats.md gives it."""
    name: str
    values: np.ndarray           # a value a point, or a row of them
    scale: object = 1.0          # of LAS extra bytes, with offset: a stored v means v * scale + offset
    offset: object = 0.0
    description: str = ""

    def at(self, rows):
        return Column(self.name, self.values[rows], self.scale, self.offset, self.description)


@dataclass
class Grid:
    """Integers on a grid, as LAS has them."""
    index: np.ndarray            # n x 3
    scale: np.ndarray
    offset: np.ndarray


@dataclass
class Cloud:
    xyz: np.ndarray              # n x 3 doubles
    columns: list
    grid: Grid = None
    records: list = field(default_factory=list)   # of LAS, those that tell of the points
    header: dict = field(default_factory=dict)    # of LAS, what travels
    lost: list = field(default_factory=list)      # words that knap has to say, as it cannot carry it

    def __post_init__(self):
        taken = set()
        for column in self.columns:
            name = column.name
            for n in range(2, len(self.columns) + 2):
                if name not in taken:
                    break
                name = f"{column.name} ({n})"
            taken.add(name)
            column.name = name

    def at(self, rows):
        grid = self.grid and Grid(self.grid.index[rows], self.grid.scale, self.grid.offset)
        return Cloud(self.xyz[rows], [c.at(rows) for c in self.columns], grid, self.records,
                     self.header, self.lost)


class Unreadable(Exception):
    """No reader of the test knows such a file: a kind that nobody has thought of."""


def positions_of(columns):
    """Takes x, y and z out of the columns."""
    axes = [next(c for c in columns if c.name.lower() == axis) for axis in "xyz"]
    rest = [c for c in columns if not any(c is a for a in axes)]
    return np.stack([a.values.astype(np.float64) for a in axes], axis=1), rest
