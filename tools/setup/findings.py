#!/usr/bin/env python3
"""Writes docs/findings.md: each finding of `ctl doctor` under a heading of its name, so that links
and search engines find it.

Usage: findings.py <build folder> <file>.
"""

import pathlib
import re
import subprocess
import sys

HEAD = """\
# Findings of ctl doctor

`ctl doctor` prints the name of each finding. A *hint* may be as you want it, all others are faults.
[troubles.md](troubles.md) begins with symptoms. `tools/setup/findings.py` makes this page from
`ctl doctor --list`.
"""


def sentence(text):
    text = re.sub(r"\bdocs/([a-z_]+\.md)", r"[\1](\1)", text.replace("\\|", "|"))
    text = re.sub(r"<([A-Z_a-z]+)>", r"\\<\1>", text)
    return text[0].upper() + text[1:] + ("" if text.endswith((".", "?")) else ".")


build, target = map(pathlib.Path, sys.argv[1:])
command = [build / "ctl", "doctor", "--list"]
table = subprocess.run(command, capture_output=True, text=True, check=True).stdout
page = HEAD
for row in table.splitlines()[2:]:
    name, cause, cure = (cell.strip() for cell in re.split(r"(?<!\\)\|", row)[1:-1])
    word, hint = re.fullmatch(r"`(\w+)`( \(hint\))?", name).groups()
    page += f"\n## {word}\n\n{'Hint. ' if hint else ''}{sentence(cause)}\n\n"
    page += f"**Do:** {sentence(cure)}\n"
target.write_text(page, encoding="utf-8")
