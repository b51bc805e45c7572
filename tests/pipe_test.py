"""Puts knap between pipes. usage: pipe_test.py KNAP"""

import os
import random
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

KNAP = Path(sys.argv.pop()).resolve()


def text_cloud(points):
    """A bent sheet as text, with a column beside the coordinates."""
    random.seed(1)
    lines = ["x y z shade"]
    for _ in range(points):
        x, y = random.uniform(0, 10), random.uniform(0, 10)
        lines.append(f"{x:.4f} {y:.4f} {abs(x - 5):.4f} {random.randrange(256)}")
    return ("\n".join(lines) + "\n").encode()


class Pipe(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.folder = Path(self.temporary.name)
        self.scratch = self.folder / "tmp"
        self.scratch.mkdir()
        (self.folder / "in.xyz").write_bytes(text_cloud(4000))

    def knap(self, *arguments, status=0, **pipes):
        environment = dict(os.environ, TMPDIR=str(self.scratch))
        done = subprocess.run([KNAP, *arguments], cwd=self.folder, env=environment,
                              **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE,
                                 "stdin": subprocess.DEVNULL, **pipes})
        self.assertEqual(status, done.returncode, done.stderr)
        self.assertEqual([], list(self.scratch.iterdir()), "nothing is left")
        return done

    def test_what_comes_out_is_the_file(self):
        for name in ["ply", "xyz"]:
            self.knap("simplify", "in.xyz", "-o", f"whole.{name}", "--alpha", "1")
            expected = (self.folder / f"whole.{name}").read_bytes()
            done = self.knap("simplify", "in.xyz", "-o", "-", "--format", name, "--alpha", "1")
            self.assertEqual(expected, done.stdout)
            self.assertIn(b"points in", done.stderr)
            with open(self.folder / "in.xyz", "rb") as points:
                done = self.knap("simplify", "-", "-o", "-", "--format", name, "--alpha", "1",
                                 "--quiet", stdin=points)
            self.assertEqual(expected, done.stdout)
            self.assertEqual(b"", done.stderr)

    def test_ply_is_the_default_and_scratch_can_be_chosen(self):
        elsewhere = self.folder / "elsewhere"
        elsewhere.mkdir()
        done = self.knap("simplify", "in.xyz", "-o", "-", "--alpha", "1", "--scratch", elsewhere,
                         "--ids", "ids")
        self.assertTrue(done.stdout.startswith(b"ply\n"))
        self.assertEqual([], list(elsewhere.iterdir()))
        kept = len((self.folder / "ids").read_text().split())
        self.assertIn(b"element vertex %d\n" % kept, done.stdout)

    def test_a_job_file_can_ask_for_it(self):
        (self.folder / "job.toml").write_text(
            'input = ["in.xyz"]\n[range]\nalpha = 1.0\n[output]\npath = "-"\n')
        from_file = self.knap("run", "job.toml").stdout
        self.assertEqual(self.knap("simplify", "in.xyz", "-o", "-", "--alpha", "1").stdout, from_file)

    def test_decoding(self):
        self.knap("simplify", "in.xyz", "-o", "archive", "--alpha", "1")
        for name in ["ply", "xyz"]:
            self.knap("decode", "archive", "-o", f"whole.{name}")
            done = self.knap("decode", "archive", "-o", "-", "--format", name)
            self.assertEqual((self.folder / f"whole.{name}").read_bytes(), done.stdout)
            self.assertIn(b"-: ", done.stderr)

    def test_planning_looks_at_the_folder_for_temporary_files(self):
        self.assertIn(b"scratch", self.knap("plan", "in.xyz", "-o", "-", "--alpha", "1").stdout)

    def test_a_reader_that_has_gone_is_an_error(self):
        self.knap("simplify", "in.xyz", "-o", "archive", "--alpha", "1")
        for command in [["simplify", "in.xyz", "-o", "-", "--alpha", "1"],
                        ["decode", "archive", "-o", "-"]]:
            reader, writer = os.pipe()
            os.close(reader)
            done = self.knap(*command, status=2, stdout=writer)
            os.close(writer)
            self.assertIn(b"cannot write standard output: Broken pipe", done.stderr)
            self.assertNotIn(b"points in", done.stderr)

    def test_a_job_that_fails_gives_nothing(self):
        (self.folder / "bad.xyz").write_bytes(text_cloud(3000) + b"1 2 three 4\n")
        done = self.knap("simplify", "bad.xyz", "-o", "-", "--alpha", "1", status=1)
        self.assertEqual(b"", done.stdout)

    def test_what_cannot_be_meant_is_an_error(self):
        for arguments, expected in [
                (["-o", "out.ply", "--format", "xyz"], b"--format: expected -o -"),
                (["-o", "-", "--format", "laz"], b"expected one of ply, xyz, found laz"),
                (["-o", "-", "--report"], b"output.report")]:
            done = self.knap("simplify", "in.xyz", "--alpha", "1", *arguments, status=1)
            self.assertIn(expected, done.stderr)
            self.assertEqual(b"", done.stdout)


if __name__ == "__main__":
    unittest.main()
