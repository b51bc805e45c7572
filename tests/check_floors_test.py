"""tools/check_floors finds what it is for, in small trees made to break one rule each."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

CHECK = Path(__file__).resolve().parent.parent / "tools" / "check_floors"

GOOD = {
    "include/knap/geometry.hpp": "#pragma once\n#include <array>\n",
    "src/base/file.cpp": '#include <unistd.h>\n#include "knap/geometry.hpp"\n',
    "src/store/occupancy.cpp": '#include <openvdb/openvdb.h>\n#include "base/file.hpp"\n',
    "src/curvature/fourier.cpp": "#include <Eigen/Eigenvalues>\n",
    "src/rank/rank.cpp": '#include "curvature/fourier.hpp"\n#include "store/occupancy.hpp"\n',
    "src/rank/CMakeLists.txt": "knap_folder(rank SOURCES rank.cpp LINK knap_curvature)\n",
    "src/app/main.cpp": '#include <CLI/CLI.hpp>\n#include "rank/rank.hpp"\n',
    "tests/rank_test.cpp": '#include "rank/rank.hpp"\n',
    "tests/CMakeLists.txt": "knap_test(rank LINK knap_rank)\n",
}


def check(files):
    """Runs the check on the good tree with `files` put over it."""
    with tempfile.TemporaryDirectory() as folder:
        for path, text in {**GOOD, **files}.items():
            file = Path(folder, path)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        return subprocess.run([sys.executable, CHECK, folder], capture_output=True, text=True)


class CheckFloors(unittest.TestCase):
    def assert_error(self, path, line, text, content):
        result = check({path: content})
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertEqual(len(result.stderr.splitlines()), 2, result.stderr)
        self.assertIn(f"{path}:{line}: ", result.stderr)
        self.assertIn(text, result.stderr)

    def test_a_good_tree_passes(self):
        result = check({})
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(result.stderr, "")

    def test_an_upward_include_is_an_error_that_names_file_and_line(self):
        self.assert_error("src/base/sum.hpp", 2, "floor 0 (base) may not use floor 2 (rank)",
                          '#pragma once\n#include "rank/rank.hpp"\n')

    def test_stages_do_not_include_each_other(self):
        self.assert_error("src/merge/merge.cpp", 1, "may not use", '#include "rank/rank.hpp"\n')

    def test_curvature_does_not_include_rank(self):
        self.assert_error("src/curvature/a.cpp", 1, "may not use", '#include "rank/rank.hpp"\n')

    def test_store_does_not_include_input(self):
        self.assert_error("src/store/manifest.cpp", 1, "may not use",
                          '#include "input/stream.hpp"\n')

    def test_a_link_upward_is_an_error(self):
        self.assert_error("src/rank/CMakeLists.txt", 1, "may not use floor 3 (pipeline)",
                          "target_link_libraries(knap_rank PRIVATE knap_pipeline)\n")

    def test_a_library_in_another_file_is_an_error(self):
        self.assert_error("src/rank/gather.cpp", 1, "OpenVDB (<openvdb/openvdb.h>) belongs in",
                          "#include <openvdb/openvdb.h>\n")

    def test_an_unknown_library_is_an_error(self):
        self.assert_error("src/app/main.cpp", 1, "<gsl/gsl> is of no library",
                          "#include <gsl/gsl>\n")

    def test_a_third_party_header_in_a_public_header_is_an_error(self):
        self.assert_error("include/knap/job.hpp", 1, "no third-party header",
                          "#include <fmt/format.h>\n")

    def test_a_public_header_includes_no_private_one(self):
        self.assert_error("include/knap/job.hpp", 1, "public headers only",
                          '#include "base/file.hpp"\n')

    def test_an_unknown_folder_is_an_error(self):
        self.assert_error("src/util/misc.cpp", 1, "folder of a known floor", "\n")

    def test_a_file_of_400_lines_passes(self):
        result = check({"src/base/long.cpp": "\n" * 400})
        self.assertEqual(result.returncode, 0, result.stderr)

    def test_a_file_of_401_lines_is_an_error(self):
        self.assert_error("src/base/long.cpp", 401, "at most 400 lines, found 401", "\n" * 401)

    def test_a_file_name_in_camel_case_is_an_error(self):
        self.assert_error("src/base/FileIo.cpp", 1, "snake_case", "\n")

    def test_a_test_that_is_not_registered_is_an_error(self):
        self.assert_error("tests/merge_test.cpp", 1, "knap_test(merge ...)", "\n")

    def test_a_tree_without_sources_is_an_error(self):
        with tempfile.TemporaryDirectory() as folder:
            result = subprocess.run([sys.executable, CHECK, folder], capture_output=True, text=True)
        self.assertEqual(result.returncode, 1)
        self.assertIn("expected source files", result.stderr)


if __name__ == "__main__":
    unittest.main()
