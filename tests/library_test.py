"""Installs knap into a new folder, and builds and runs the program of docs/library.md against what
is installed there: by find_package and by pkg-config. usage: library_test.py BUILD_FOLDER"""

import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD = Path(sys.argv.pop(1)).resolve()


def code_block(language):
    """The one block of a language in docs/library.md."""
    page = (ROOT / "docs/library.md").read_text()
    blocks = re.findall(rf"^```{language}\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    assert len(blocks) == 1, f"expected one block of {language}, found {len(blocks)}"
    return blocks[0]


def run(*command, cwd=None, env=None):
    done = subprocess.run(command, cwd=cwd, env=env, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True)
    assert done.returncode == 0, f"{command}: status {done.returncode}\n{done.stdout}"
    return done.stdout


class Library(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        top = Path(cls.folder.name)
        # Moved after it was installed: nothing in it may know where it was.
        for component in ("program", "library", "development"):
            run("cmake", "--install", BUILD, "--prefix", top / "first", "--component", component)
        (top / "first").rename(top / "moved")
        cls.prefix = top / "moved"
        cls.libraries = next(cls.prefix.glob("lib/**/libknap.so")).parent
        cls.source = top / "source"
        cls.source.mkdir()
        (cls.source / "roof.cpp").write_text(code_block("cpp"))
        (cls.source / "CMakeLists.txt").write_text(code_block("cmake"))

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def check_program(self, program):
        environment = dict(os.environ, LD_LIBRARY_PATH=str(self.libraries))
        output = run(program, cwd=program.parent, env=environment)
        kept = re.search(r"in memory: (\d+) of 40401 points kept", output)
        self.assertIsNotNone(kept, output)
        self.assertTrue(0 < int(kept[1]) < 4040, output)
        self.assertIn(f"out of core: {kept[1]} of 40401 points kept; stages: survey", output)
        self.assertIn(f"read back: {kept[1]} points in 1 tiles", output)
        self.assertIn("as expected: nowhere", output)

    def test_the_program_of_the_page_is_built_by_find_package(self):
        build = self.source / "build"
        run("cmake", "-S", self.source, "-B", build, f"-DCMAKE_PREFIX_PATH={self.prefix}")
        run("cmake", "--build", build)
        self.check_program(build / "roof")

    def test_the_program_of_the_page_is_built_by_pkg_config(self):
        folder = self.source / "pkg-config"
        folder.mkdir()
        (folder / "roof.cpp").write_text(code_block("cpp"))
        environment = dict(os.environ, PKG_CONFIG_PATH=str(self.libraries / "pkgconfig"))
        run("sh", "-ec", code_block("sh"), cwd=folder, env=environment)
        self.check_program(folder / "roof")

    def test_find_package_refuses_another_minor_version(self):
        lists = self.source / "other"
        lists.mkdir()
        (lists / "CMakeLists.txt").write_text(
            code_block("cmake").replace("knap 0.1", "knap 0.99").replace("roof.cpp", "../roof.cpp"))
        with self.assertRaisesRegex(AssertionError, r"compatible\s+with requested"):
            run("cmake", "-S", lists, "-B", lists / "build",
                f"-DCMAKE_PREFIX_PATH={self.prefix}")

    def test_the_library_shows_nothing_but_the_headers(self):
        shown = run("nm", "-DC", "--defined-only", self.libraries / "libknap.so").splitlines()
        names = [line.split(" ", 2)[2] for line in shown]
        self.assertIn("knap::run(knap::Job const&, knap::Progress&)", names)
        self.assertEqual([], [name for name in names if "knap::" not in name])
        headers = "".join(f.read_text() for f in (ROOT / "include/knap").glob("*.hpp"))
        for name in names:
            if match := re.match(r"knap::(\w+)", name):
                self.assertIn(match[1], headers)

    def test_every_function_of_the_headers_is_shown(self):
        for header in (ROOT / "include/knap").glob("*.hpp"):
            for line in header.read_text().splitlines():
                if re.match(r"(?!inline |constexpr |template|using |#|//)\w.*\w\(", line):
                    self.assertTrue(line.startswith("KNAP_API "), f"{header.name}: {line}")

    def test_the_program_is_installed_with_its_page_and_its_completion(self):
        self.assertRegex(run(self.prefix / "bin/knap", "--version"), r"^knap \d")
        self.assertIn(".SH NAME", (self.prefix / "share/man/man1/knap.1").read_text())
        run("bash", "-n", self.prefix / "share/bash-completion/completions/knap")
        self.assertEqual([], list(self.prefix.glob("bin/knap-front-mesh")))


if __name__ == "__main__":
    unittest.main()
