"""Extra bytes keep what their descriptors say of values. usage: limits_test.py KNAP SHARED_DATA"""

import json
import struct
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

DATA = Path(sys.argv.pop()) / "lidar/formats/extrabytes.las"
KNAP = Path(sys.argv.pop()).resolve()
SIZE = 192


def descriptors(data):
    """Where those of extra bytes stand in a LAS file, by name."""
    found = {}
    at, count = struct.unpack_from("<H", data, 94)[0], struct.unpack_from("<I", data, 100)[0]
    for _ in range(count):
        user, record, size = struct.unpack_from("<16sHH", data, at + 2)
        at += 54
        if user.rstrip(b"\0") == b"LASF_Spec" and record == 4:
            for one in range(at, at + size, SIZE):
                found[bytes(data[one + 4:one + 36]).rstrip(b"\0")] = one
        at += size
    return found


@unittest.skipUnless(DATA.exists(), "no shared data")
class Limits(unittest.TestCase):
    def test_go_to_las_and_through_an_archive(self):
        data = bytearray(DATA.read_bytes())
        said = {b"Time": (7, 1), b"Intensity": (3, 1), b"Flags": (4, 2), b"Colors": (5, 3)}
        places = descriptors(data)
        for number, (name, (options, components)) in enumerate(said.items()):
            at = places[name]
            data[at + 3] = options
            for which in range(3):
                for i in range(components if options & 1 << which else 0):
                    struct.pack_into("<Q", data, at + 40 + 24 * which + 8 * i,
                                     100 * number + 10 * which + i)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            (folder / "in.las").write_bytes(data)
            for command in [["simplify", "in.las", "-o", "out.las", "--ratio", "0.5"],
                            ["simplify", "in.las", "-o", "archive", "--ratio", "0.5"],
                            ["decode", "archive", "-o", "decoded.las"],
                            ["verify", "archive"]]:
                subprocess.run([KNAP, *command], cwd=folder, check=True, capture_output=True)
            for output in ["out.las", "decoded.las"]:
                info = subprocess.run([KNAP, "info", "--json", output], cwd=folder, check=True,
                                      capture_output=True)
                limits = {one["name"]: [one.get(key) for key in ["missing", "least", "greatest"]]
                          for one in json.loads(info.stdout)["attributes"]}
                self.assertEqual([None, None, [220, 221]], limits["Flags"], output)
                written = (folder / output).read_bytes()
                found = descriptors(written)
                for attribute, (options, components) in said.items():
                    here, there = places[attribute], found[attribute]
                    self.assertEqual(options, written[there + 3] & 7, (output, attribute))
                    for which in range(3):
                        first = 40 + 24 * which
                        self.assertEqual(data[here + first:here + first + 8 * components],
                                         written[there + first:there + first + 8 * components])


if __name__ == "__main__":
    unittest.main()
