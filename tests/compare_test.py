#!/usr/bin/env python3
"""Holds the programs behind tools/compare to what its tables take for granted: each way comes near
the count that is asked for, and what picks points picks points of the cloud."""

import argparse
import math
import struct
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml
from pathlib import Path

TOOLS = Path(__file__).resolve().parent.parent / "tools"
POINTS, COUNT = 20_000, 2_000
GRID = 60  # vertices of the mesh along a side
# Way -> largest relative miss of the count; CGAL's hierarchy is steered by a whole number.
PICKING = {"cgal": {"random": 0.01, "grid": 0.01, "hierarchy": 0.1},
           "pcl": {"uniform": 0.01, "normal-space": 0.01}}
MOVING = {"cgal": {}, "pcl": {"voxel": 0.01}}

programs = {}


def run(*words):
    return subprocess.run(words, check=True, capture_output=True, text=True).stdout


def read_ply(path):
    """Positions of a binary PLY of floats or doubles, as knap writes it."""
    header, _, body = Path(path).read_bytes().partition(b"end_header\n")
    return set(struct.iter_unpack("<3d" if b"property double x" in header else "<3f", body))


def write_mesh(path):
    """A wave over a square, GRID x GRID vertices."""
    places = [(i / GRID, j / GRID) for i in range(GRID) for j in range(GRID)]
    vertices = [f"{x} {y} {0.1 * math.sin(5 * x) * math.cos(4 * y)}" for x, y in places]
    corners = [i * GRID + j for i in range(GRID - 1) for j in range(GRID - 1)]
    facets = [facet for a in corners
              for facet in (f"3 {a} {a + GRID} {a + 1}", f"3 {a + 1} {a + GRID} {a + GRID + 1}")]
    header = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}",
              "property float x", "property float y", "property float z",
              f"element face {len(facets)}", "property list uchar int vertex_indices",
              "end_header"]
    path.write_text("\n".join(header + vertices + facets) + "\n")


class Compare(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.cloud = Path(cls.folder.name) / "cloud.ply"
        run(programs["knap"], "synth", "flake", "--points", str(POINTS), "-o", cls.cloud)
        cls.points = read_ply(cls.cloud)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def program(self, library):
        if library not in programs:
            self.skipTest(f"knap_compare_{library} is not built")
        return programs[library]

    def simplify(self, library, way, cloud, count):
        """What is kept, after a check that the program says how much that is."""
        program, out = self.program(library), self.cloud.with_name("out.ply")
        parameter = run(program, "find", way, cloud, str(count)).strip()
        kept, seconds = run(program, "run", way, cloud, parameter, out).split()
        points = read_ply(out)
        self.assertEqual(len(points), int(kept))  # no point twice
        self.assertGreaterEqual(float(seconds), 0)
        return points

    def check_ways(self, library):
        self.program(library)
        for ways, picks in ((PICKING, True), (MOVING, False)):
            for way, miss in ways[library].items():
                with self.subTest(way=way):
                    points = self.simplify(library, way, self.cloud, COUNT)
                    self.assertLessEqual(abs(len(points) / COUNT - 1), miss)
                    self.assertEqual(points <= self.points, picks)
                    for axis in range(3):
                        self.assertLessEqual(min(p[axis] for p in self.points) - 1e-4,
                                             min(p[axis] for p in points))
                        self.assertGreaterEqual(max(p[axis] for p in self.points) + 1e-4,
                                                max(p[axis] for p in points))

    def test_cgal_keeps_the_count(self):
        self.check_ways("cgal")

    def test_pcl_keeps_the_count(self):
        self.check_ways("pcl")

    def test_collapse_keeps_the_count_and_the_surface(self):
        mesh = self.cloud.with_name("mesh.ply")
        write_mesh(mesh)
        points = self.simplify("cgal", "collapse", mesh, 600)
        self.assertEqual(len(points), 600)
        for x, y, z in points:
            self.assertLess(abs(z - 0.1 * math.sin(5 * x) * math.cos(4 * y)), 0.005)

    def test_collapse_of_a_cloud_without_facets_is_an_error(self):
        result = subprocess.run([self.program("cgal"), "find", "collapse", self.cloud, "100"],
                                capture_output=True, text=True, check=False)
        self.assertEqual(result.returncode, 1)
        self.assertIn("expected a PLY with facets", result.stderr)

    def test_an_unknown_way_is_an_error(self):
        result = subprocess.run([self.program("cgal"), "find", "magic", self.cloud, "100"],
                                capture_output=True, text=True, check=False)
        self.assertEqual(result.returncode, 1)
        self.assertIn("expected random, grid", result.stderr)


class Curve(unittest.TestCase):
    def draw(self, rows):
        with tempfile.TemporaryDirectory() as folder:
            picture = Path(folder) / "curve.svg"
            subprocess.run([TOOLS / "compare_curve", "-o", picture], check=True, text=True,
                           input="".join("\t".join(map(str, row)) + "\n" for row in rows),
                           capture_output=True)
            return xml.parse(picture).getroot()

    def test_draws_a_line_a_way_in_both_panels(self):
        rows = [(way, count, factor / count, 2 * factor / count)
                for way, factor in (("knap, accurate", 1), ("CGAL grid", 3), ("PCL voxel", 100))
                for count in (1000, 10_000, 100_000)]
        svg = self.draw(rows)
        space = "{http://www.w3.org/2000/svg}"
        lines = svg.findall(f".//{space}polyline")
        self.assertEqual(len(lines), 2 * 3)
        for line in lines:
            places = [tuple(map(float, place.split(","))) for place in line.get("points").split()]
            self.assertEqual(len(places), 3)
            self.assertEqual(places, sorted(places))                   # more points: further right
            self.assertEqual([y for _, y in places], sorted(y for _, y in places))  # and lower

    def test_a_damaged_line_is_an_error(self):
        with self.assertRaises(subprocess.CalledProcessError):
            self.draw([("CGAL grid", "many", 1, 1)])


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("knap")
    parser.add_argument("peers", nargs="*", help="programs; those that are not built are left out")
    options = parser.parse_args()
    programs["knap"] = options.knap
    for peer in options.peers:
        if Path(peer).exists():
            programs[Path(peer).name.removeprefix("knap_compare_")] = peer
    unittest.main(argv=sys.argv[:1])
