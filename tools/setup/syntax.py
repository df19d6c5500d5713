#!/usr/bin/env python3
"""Runs a compiler, for its warnings only, on sources that are configured in a build folder but not
built.

Usage: syntax.py [--part N/M] <build folder> [<source folder>...]

So that compiler sees every file of the project, in a sixth of the time. The files of the source
folders are checked one by one: what is compiled together does not show that each file includes
what it needs. With --part only every M-th of these, from the N-th (0 to M-1).
"""

import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys

parser = argparse.ArgumentParser()
parser.add_argument("--part", default="0/1")
parser.add_argument("build", type=pathlib.Path)
parser.add_argument("folders", nargs="*", type=pathlib.Path)
options = parser.parse_args()
build = options.build
alone = [f"{folder.resolve()}/" for folder in options.folders]
part, parts = map(int, options.part.split("/"))
if not 0 <= part < parts:
    parser.error("--part: N is from 0 to M-1")


def sources_of(entry):
    """The files that a command compiles: itself, or those that CMake has put together."""
    file = pathlib.Path(entry["file"])
    if file.parent.name != "Unity":
        return [str(file)]
    return re.findall(r'^#include "(.*)"$', file.read_text(), re.MULTILINE)


def is_built(entry):
    """Whether there is an object that is not older than its sources."""
    made = build / re.search(r" -o (\S+)", entry["command"]).group(1)
    files = [entry["file"], *sources_of(entry)]
    return made.exists() and made.stat().st_mtime >= max(os.stat(file).st_mtime for file in files)


def checks():
    """The commands, each with its folder. A file of two targets is checked as both compile it."""
    found, one_by_one = {}, {}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        sources = sources_of(entry)
        built = is_built(entry)
        if sources != [entry["file"]] and all(s.startswith(tuple(alone)) for s in sources):
            for file in sources:
                one_by_one[entry["command"].replace(entry["file"], file)] = entry["directory"]
        elif not built:
            found[entry["command"]] = entry["directory"]
    return list(found.items()) + list(one_by_one.items())[part::parts]


def check(command, folder):
    done = subprocess.run(
        command + " -fsyntax-only", shell=True, text=True, cwd=folder, capture_output=True
    )
    return done.returncode, done.stdout + done.stderr


todo = checks()
with concurrent.futures.ThreadPoolExecutor(int(os.environ.get("JOBS") or os.cpu_count())) as pool:
    results = list(pool.map(check, *zip(*todo))) if todo else []
failed = [(status, text) for status, text in results if status]
for _, text in results:
    sys.stdout.write(text)
print(f"[syntax] {build}: {len(todo)} files that are not built there by themselves, "
      f"{len(failed)} with errors")
sys.exit(1 if failed else 0)
