"""Lets bash complete command lines of knap. usage: completion_test.py SCRIPT MAN_PAGE KNAP"""

import re
import subprocess
import sys
import unittest
from pathlib import Path

KNAP = Path(sys.argv.pop()).resolve()
MAN_PAGE = Path(sys.argv.pop()).resolve()
SCRIPT = Path(sys.argv.pop()).resolve()
COMMANDS = ["run", "simplify", "plan", "info", "decode", "verify", "view", "evaluate",
            "tileset", "synth"]


def complete(*words):
    """What is offered for the last of these words, as bash splits them; <files> for any file."""
    script = (f"source '{SCRIPT}'\n"
              "compopt() { case $2 in default) echo '<files>' ;; nospace) ;; esac; }\n"
              'COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))\n_knap\n'
              '[ ${#COMPREPLY[@]} -eq 0 ] || printf "%s\\n" "${COMPREPLY[@]}"')
    done = subprocess.run(["bash", "-euc", script, "bash", "knap", *words], check=True,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert done.stderr == "", done.stderr
    return done.stdout.split()


def flags_of_help(*command):
    text = subprocess.run([KNAP, *command, "--help"], check=True, stdout=subprocess.PIPE,
                          text=True).stdout
    lines = re.findall(r"^  (-\S+)", text, re.MULTILINE)
    return sorted(flag for line in lines for flag in line.split(","))


class Completion(unittest.TestCase):
    def test_the_first_word_is_a_command(self):
        self.assertLessEqual(set(COMMANDS), set(complete("")))
        self.assertEqual(["simplify"], complete("si"))
        self.assertEqual(["--version"], complete("--v"))

    def test_every_flag_of_every_command_is_offered(self):
        for command in complete(""):
            self.assertEqual(flags_of_help(command), sorted(complete(command, "-")), command)

    def test_names_of_a_flag_are_offered(self):
        self.assertEqual(["fourier", "quadric"], complete("run", "job.toml", "--estimator", ""))
        self.assertEqual(["quadric"], complete("run", "--estimator", "=", "q"))
        self.assertEqual(["fourier", "quadric"], complete("run", "--estimator", "="))
        self.assertEqual(["flake"], complete("synth", "fl"))

    def test_a_number_is_not_completed_and_a_path_is(self):
        self.assertEqual([], complete("simplify", "--alpha", ""))
        self.assertEqual(["<files>"], complete("simplify", "--output", "sc"))
        self.assertEqual(["<files>"], complete("simplify", "sc"))
        self.assertEqual(["<files>"], complete("run", "--set", "output.path", "=", "sc"))

    def test_set_offers_the_keys_of_a_job_file(self):
        self.assertEqual(["range.alpha="], complete("run", "--set", "range.al"))


class ManPage(unittest.TestCase):
    def test_has_every_command_and_every_flag_in_its_place(self):
        page = MAN_PAGE.read_text()
        sections = dict(re.findall(r'^\.SS "knap (\w+)"\n(.*?)(?=^\.S[SH])', page,
                                   re.MULTILINE | re.DOTALL))
        self.assertLessEqual(set(COMMANDS), set(sections))
        for command, text in sections.items():
            heads = re.findall(r"^\.TP\n(.*)$", text, re.MULTILINE)
            flags = [flag.replace("\\-", "-") for head in heads
                     for flag in re.findall(r"\\fB(.*?)\\fR", head)]
            self.assertEqual(flags_of_help(command), sorted(flags), command)

    def test_says_what_the_help_says(self):
        page = MAN_PAGE.read_text()
        self.assertIn("\\fB\\-\\-alpha\\fR \\fINUMBER\\fR\n", page)
        self.assertIn("[points; 3 .. 255; default 30]", page)
        for section in ("NAME", "SYNOPSIS", "DESCRIPTION", "COMMANDS", "EXAMPLES", "EXIT STATUS"):
            self.assertIn(f".SH {section}\n", page)

    def test_no_line_is_taken_for_a_request(self):
        requests = {match[1] for match in re.finditer(r"^[.'](\S*)", MAN_PAGE.read_text(),
                                                      re.MULTILINE)}
        self.assertLessEqual(requests, {"TH", "SH", "SS", "TP", "PP", "br", "nf", "fi", "RS", "RE"})


if __name__ == "__main__":
    unittest.main()
