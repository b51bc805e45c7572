"""Runs the commands of docs/guide.md as they stand, in a folder with the statue in four files, and holds
what they print against what the page says. Skipped without ../shared. usage: guide_test.py KNAP"""

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
import urllib.request
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
KNAP = Path(sys.argv.pop(1)).resolve()
DATA = ROOT.parent / "shared/data/lidar/multi"
# What stands behind this heading needs PDAL, which Debian 12 does not have.
PAGE = (ROOT / "docs/guide.md").read_text().split("\n## In a PDAL pipeline")[0]
WITHOUT = {"xxhsum": shutil.which("xxhsum") is None}
VIEWER = (KNAP.parent / "viewer/index.html").is_file()
LONGEST = 300  # seconds
# What the machine decides: disk, memory; and the size of tiles, which Draco's version does.
VARIES = re.compile(r"^(memory|scratch|size) .*$|[\d.]+ [KM]iB", re.MULTILINE)


def steps():
    """(command, what it prints or ""), in the order of the page; the job file is written on the way."""
    lines = PAGE.split("\n")
    for i, line in enumerate(lines):
        if not re.match(r"    (knap|diff|grep|xxhsum) ", line):
            continue
        block = "\n".join(lines[i + 1:]).lstrip("\n")
        shown = re.match(r"```\n(.*?)```", block, re.DOTALL)
        yield line.split("#")[0].strip(), shown[1] if shown else ""


def plain(text):
    return [re.sub(r"\s+", " ", line).strip() for line in VARIES.sub("", text).splitlines() if line.strip()]


def view(command, folder):
    """Looks at what `knap view` serves, and ends it. Gives its exit status."""
    with subprocess.Popen([KNAP, *shlex.split(command)[1:]], cwd=folder, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as server:
        try:
            address = server.stdout.readline().strip()
            for place in ["", "archive/manifest.json"]:
                with urllib.request.urlopen(address.split("?")[0] + place, timeout=30) as answer:
                    answer.read()
            server.send_signal(signal.SIGINT)
            return server.wait(30)
        finally:
            server.kill()


@unittest.skipUnless(DATA.is_dir(), "needs ../shared/data/lidar/multi")
class Guide(unittest.TestCase):
    def test_its_commands_do_what_it_says(self):
        with tempfile.TemporaryDirectory() as top:
            folder = Path(top)
            shutil.copytree(DATA, folder / "site")
            for file in (folder / "site").iterdir():
                file.chmod(0o644)
            (folder / "site.toml").write_text(
                re.search(r"```toml\n(.*?)```", PAGE, re.DOTALL)[1].replace("/var/tmp", top))
            environment = dict(os.environ, PATH=f"{KNAP.parent}:{os.environ['PATH']}")
            ran = 0
            for command, shown in steps():
                is_view = command.startswith("knap view ")
                if WITHOUT.get(command.split()[0]) or (is_view and not VIEWER):
                    continue
                with self.subTest(command):
                    if is_view:
                        self.assertEqual(view(command, folder), 0)
                        continue
                    done = subprocess.run(["bash", "-c", command], cwd=folder, env=environment,
                                          capture_output=True, text=True, timeout=LONGEST)
                    self.assertEqual(done.returncode, 0, done.stderr)
                    said = plain(done.stdout)
                    for line in plain(shown):
                        self.assertIn(line, said)
                    ran += 1
            self.assertGreater(ran, 10)


if __name__ == "__main__":
    unittest.main()
