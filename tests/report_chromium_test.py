"""A report of knap as a browser shows it: everything is there, and nothing is asked for."""

import html
import json
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

KNAP = sys.argv.pop(1) if len(sys.argv) > 1 else "build/release/knap"
CHROMIUM = shutil.which("chromium")

# Runs in the page when all is loaded, and leaves what it finds in the document: at once, for the
# browser prints the document then.
PROBE = """
<script>
addEventListener("load", () => {
  const found = {errors: window.knapErrors, pictures: [], bars: []};
  for (const image of document.images) {
    const canvas = document.createElement("canvas");
    canvas.width = image.naturalWidth;
    canvas.height = image.naturalHeight;
    const colours = new Set();
    if (image.naturalWidth > 0) {
      const context = canvas.getContext("2d");
      context.drawImage(image, 0, 0);
      const data = context.getImageData(0, 0, canvas.width, canvas.height).data;
      for (let i = 0; i < data.length; i += 4) {
        colours.add(data[i] << 16 | data[i + 1] << 8 | data[i + 2]);
      }
    }
    found.pictures.push({width: image.naturalWidth, given: Number(image.getAttribute("width")),
                         shown: image.getBoundingClientRect().width, alt: image.alt,
                         colours: colours.size});
  }
  for (const chart of document.querySelectorAll("svg.chart")) {
    const high = kind => [...chart.querySelectorAll("rect." + kind)]
        .filter(bar => bar.getBoundingClientRect().height > 1).length;
    found.bars.push({all: high("all"), kept: high("kept")});
  }
  found.requests = performance.getEntriesByType("resource").map(entry => entry.name)
      .filter(name => !name.startsWith("data:"));
  found.wide = document.documentElement.scrollWidth > window.innerWidth;
  found.text = document.body.innerText;
  const result = document.createElement("pre");
  result.id = "probe";
  result.textContent = JSON.stringify(found);
  document.body.append(result);
});
</script>
"""
# Before all else.
WATCH = """
<script>
window.knapErrors = [];
addEventListener("error", event => window.knapErrors.push(String(event.message)), true);
addEventListener("securitypolicyviolation", event => window.knapErrors.push(event.blockedURI));
</script>
"""


def look_at(page, folder):
    """What the page holds once it is loaded, and what the browser says."""
    probed = page.replace("<head>", "<head>" + WATCH, 1).replace("</body>", PROBE + "</body>", 1)
    file = Path(folder, "probed.html")
    file.write_text(probed, encoding="utf-8")
    result = subprocess.run(
        [CHROMIUM, "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
         "--disable-background-networking", f"--user-data-dir={folder}/profile",
         "--window-size=1280,900", "--enable-logging=stderr", "--log-level=0",
         "--dump-dom", file.as_uri()],
        capture_output=True, text=True, timeout=120)
    match = re.search(r'<pre id="probe">(.*?)</pre>', result.stdout, re.DOTALL)
    assert match, f"expected what the probe leaves, found none\n{result.stderr[-2000:]}"
    return json.loads(html.unescape(match[1])), result.stderr


@unittest.skipIf(CHROMIUM is None, "needs chromium: tools/setup --checks installs it")
class ReportInABrowser(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        root = Path(cls.folder.name)

        def knap(*arguments):
            subprocess.run([KNAP, *arguments], check=True, cwd=root, capture_output=True)

        knap("synth", "torus", "--points", "20000", "-o", "torus.ply")
        knap("simplify", "torus.ply", "-o", "archive", "--alpha", "0.1", "--report")
        knap("evaluate", "torus.ply", "archive", "--report")
        cls.counts = json.loads(Path(root, "archive/manifest.json").read_text())["counts"]
        cls.page = Path(root, "archive/report.html").read_text(encoding="utf-8")
        cls.found, cls.log = look_at(cls.page, cls.folder.name)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_nothing_goes_wrong(self):
        self.assertEqual(self.found["errors"], [])
        self.assertNotIn("CONSOLE", self.log)

    def test_nothing_is_asked_of_a_network(self):
        self.assertEqual(self.found["requests"], [])

    def test_every_picture_is_decoded_and_shows_something(self):
        self.assertEqual(len(self.found["pictures"]), 6)
        for picture in self.found["pictures"]:
            with self.subTest(picture["alt"]):
                self.assertEqual(picture["width"], picture["given"])
                self.assertGreater(picture["width"], 0)
                self.assertGreater(picture["shown"], 300)
                self.assertGreater(picture["colours"], 500)

    def test_every_chart_has_bars(self):
        self.assertEqual(len(self.found["bars"]), 2)
        for bars in self.found["bars"]:
            self.assertGreater(bars["all"], 5)
            self.assertGreater(bars["kept"], 2)

    def test_every_count_can_be_read(self):
        for count in self.counts.values():
            self.assertIn(f"{count:,}", self.found["text"])
        self.assertIn("root mean square", self.found["text"])

    def test_it_fits_the_width_of_a_window(self):
        self.assertFalse(self.found["wide"])

    def test_the_probe_sees_what_is_wrong(self):
        broken = self.page.replace("<main>", '<main><img src="missing.png" alt="">', 1)
        found, _ = look_at(broken, self.folder.name)
        self.assertIn(0, [picture["width"] for picture in found["pictures"]])
        self.assertTrue(found["errors"] or found["requests"])


if __name__ == "__main__":
    unittest.main()
