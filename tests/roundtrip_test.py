#!/usr/bin/env python3
"""Every file of a folder into knap, and out again as an archive, as LAS or LAZ and as PLY: each kept
point's position and attributes are those of its source. Sources and results are read by the readers
in roundtrip/, which share nothing with knap but the codecs of LASzip and Draco. A file of a kind
that no reader knows is a failure: nothing is left out in silence."""

import argparse
import gzip
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.dont_write_bytecode = True
SKIPPED = 77
try:
    import numpy as np
except ImportError:
    print("roundtrip: expected python3-numpy, found none: skipped")
    sys.exit(SKIPPED)

from roundtrip.cloud import Unreadable
from roundtrip.compare import Different, compare_archive, compare_las, compare_ply, expect
from roundtrip.draco_reader import cloud_of_archive, read_archive, read_draco
from roundtrip.las_reader import read_las
from roundtrip.made import made_files
from roundtrip.pcd_reader import read_pcd
from roundtrip.ply_reader import read_ply
from roundtrip.text_reader import read_ptx, read_text

TEXT = {".txt", ".xyz", ".csv", ".pts", ".asc", ".tsv"}
# What knap refuses, and must say so of: the file, under its path in the folder, and what it says.
REFUSED = {
    "lidar/formats/1.2-with-color-clipped.las": "expected 1065 points of 34 bytes",  # cut in its last point
}
LEFT_OUT = {"malformed", "README.md"}
LARGE = 2_000_000  # points, from which on LAS comes from the archive


class Round:
    """One file, in and out."""

    def __init__(self, tools, path, folder):
        self.tools, self.path, self.folder = tools, path, folder
        self.scratch = folder / "scratch"

    def knap(self, *arguments):
        done = subprocess.run([self.tools.knap, *map(str, arguments)], capture_output=True, text=True)
        expect(done.returncode == 0, f"knap {' '.join(map(str, arguments))}: {done.stderr.strip()}")
        return "\n".join(line for line in done.stderr.splitlines() if line.startswith("knap: "))

    def las(self, path):
        data = path.read_bytes()
        if not data[104] & 0x80:
            return read_las(data)
        if not self.tools.unlaz:
            raise Unreadable("LAZ: this build has no LASzip")
        # LASzip reads versions up to 1.4; from format 6 on 1.5 differs in what stands behind that header.
        known = self.folder / "known.laz"
        known.write_bytes(data[:25] + bytes([min(data[25], 4)]) + data[26:])
        subprocess.run([self.tools.unlaz, known, self.scratch], check=True)
        return read_las(data, self.scratch.read_bytes())

    def source(self):
        data = gzip.decompress(self.path.read_bytes()) if self.path.suffix == ".gz" else None
        ending = Path(self.path.stem if data else self.path.name).suffix.lower()
        data = data or (b"" if ending in (".las", ".laz") else self.path.read_bytes())
        if ending in (".las", ".laz"):
            return self.las(self.path)
        if self.path.name == "manifest.json":
            return cloud_of_archive(self.tools.undraco, self.path.parent, self.scratch)
        if ending == ".ply":
            return read_ply(data)
        if ending == ".ptx":
            return read_ptx(data)
        if ending == ".pcd":
            return read_pcd(data)
        if ending == ".drc":
            return read_draco(self.tools.undraco, self.path, self.scratch)
        if ending in TEXT:
            return read_text(data)
        raise Unreadable(f"expected a file that a reader of this test knows, found {self.path.name}")

    def run(self):
        source = self.source()
        finite = source.xyz[np.all(np.isfinite(source.xyz), axis=1)]
        points = len(source.xyz)
        spacing = np.linalg.norm(np.ptp(finite, axis=0)) / np.sqrt(points) if len(finite) > 1 else 1
        # All of a small cloud, of a large one what a wide range leaves.
        alpha = max(spacing * (1e-4 if points < 20_000 else 4 if points < LARGE else 16), 1e-30)
        self.ids = None
        archive = self.folder / "archive"
        told = self.simplify(archive, alpha)
        kept = source.at(self.ids)
        for lost in source.lost:
            expect(lost in told, f"{lost}: stays behind without a word; told: {told}")
        index, columns, manifest = read_archive(self.tools.undraco, archive, self.scratch)
        attributes = compare_archive(kept, index, columns, manifest)
        counts = manifest["counts"]
        expect(counts["in"] == points and sum(counts.values()) == 2 * points,
               f"{points} points, counted {counts}")
        self.las_again(source, archive, alpha)
        self.ply_again(source, archive, alpha)
        return f"{points} points, {len(self.ids)} kept, {attributes} attributes" + (
            f"; stays behind: {', '.join(source.lost)}" if source.lost else "")

    def simplify(self, output, alpha):
        ids = self.folder / "ids"
        told = self.knap("simplify", self.path, "-o", output, "--alpha", f"{alpha:.9g}", "--ids", ids,
                         "--overwrite")
        found = np.array(ids.read_text().split(), np.int64)
        expect(self.ids is None or np.array_equal(self.ids, found), f"{output.name}: other points are kept")
        self.ids = found
        return told

    def las_again(self, source, archive, alpha):
        output = self.folder / ("out.laz" if self.tools.unlaz and source.grid else "out.las")
        if len(source.xyz) < LARGE:
            told = self.simplify(output, alpha)
            return compare_las(source.at(self.ids), self.las(output), told)
        told = self.knap("decode", archive, "-o", output)
        found, kept = self.las(output), source.at(self.ids)
        places = lambda cloud: np.lexsort(cloud.grid.index.T)
        return compare_las(kept.at(places(kept)), found.at(places(found)), told)

    def ply_again(self, source, archive, alpha):
        output = self.folder / "out.ply"
        if len(source.xyz) < LARGE:
            try:
                self.simplify(output, alpha)
            except Different as error:
                # PLY has none of 64 bits: that is an error, and LAS and the archive have them.
                expect("an integer that a double holds" in str(error), str(error))
                return
            return compare_ply(source.at(self.ids), read_ply(output.read_bytes()))
        self.knap("decode", archive, "-o", output)
        found, kept = read_ply(output.read_bytes()), source.at(self.ids)
        places = lambda cloud: np.lexsort(cloud.xyz.T)
        return compare_ply(kept.at(places(kept)), found.at(places(found)))

    def refused(self, reason):
        done = subprocess.run([self.tools.knap, "simplify", self.path, "-o", self.folder / "archive",
                               "--alpha", "1"], capture_output=True, text=True)
        said = done.stderr.strip()
        expect(done.returncode == 1 and reason in said and "\n" not in said,
               f"expected to be refused in one line with '{reason}', found {done.returncode}: {said}")
        return f"refused, as it must be: {reason}"


def files_of(folder, part, parts):
    """The files of a part that no longer part has."""
    def part_of(name):
        return max((p for p in parts if name == p or name.startswith(p + "/")), key=len, default=".")

    names = sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())
    return [n for n in names if n.split("/")[0] not in LEFT_OUT and part_of(n) == part
            and not ".archive/tiles/" in n]   # an archive is read by its manifest


def make(tools, folder):
    """Files of the test's own, each LAS also as LAZ; LASzip's interface writes no extended records."""
    for name, content in made_files():
        (folder / name).write_bytes(content)
        if name.endswith(".las") and tools.unlaz and not name.endswith("extended.las"):
            subprocess.run([tools.unlaz, folder / name, (folder / name).with_suffix(".laz")], check=True)
    for name in ("extra_bytes_1.las", "far_with_holes.ply", "every_type_binary_big_endian.ply"):
        subprocess.run([tools.knap, "simplify", folder / name, "-o", folder / f"{name}.archive", "--alpha",
                        "1e-6", "--tile-points", "1000", "--quiet"], check=True, stdout=subprocess.DEVNULL)
    if shutil.which("draco_encoder"):
        for i, flags in enumerate((["-qp", "0", "-qn", "0"], ["-qp", "14"], ["-cl", "10"])):
            subprocess.run(["draco_encoder", "-point_cloud", *flags, "-i", folder / "mixed_colours.ply", "-o",
                            folder / f"encoded_{i}.drc"], check=True, stdout=subprocess.DEVNULL)


def sweep(tools):
    failures = 0
    files = files_of(tools.data, tools.part, tools.parts)
    for name in files:
        start = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            round_trip = Round(tools, tools.data / name, Path(folder))
            try:
                said = round_trip.refused(REFUSED[name]) if name in REFUSED else round_trip.run()
                print(f"{name}: {said} ({time.monotonic() - start:.1f} s)", flush=True)
            except (Different, Unreadable, subprocess.CalledProcessError) as error:
                failures += 1
                print(f"{name}: FAILED: {str(error)[:1000]}", flush=True)
    print(f"{len(files)} files, {failures} failed")
    return 1 if failures else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("knap")
    parser.add_argument("--undraco", required=True)
    parser.add_argument("--unlaz")
    parser.add_argument("--data", type=Path, help="files to sweep; the test's own if not given")
    parser.add_argument("--part", default=".", help="a folder or file below; .: what no part has")
    parser.add_argument("--parts", nargs="*", default=[])
    tools = parser.parse_args()
    if tools.data is None:
        with tempfile.TemporaryDirectory() as folder:
            tools.data = Path(folder)
            make(tools, tools.data)
            return sweep(tools)
    if not tools.data.is_dir():
        print(f"roundtrip: expected {tools.data}, found none: skipped")
        return SKIPPED
    return sweep(tools)


if __name__ == "__main__":
    sys.exit(main())
