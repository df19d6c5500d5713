#!/usr/bin/env python3
"""The software bill of materials of a build, CycloneDX 1.5 in JSON.

Usage: sbom.py <build folder> <file>

Components are the packages of the libraries that the built programs load, and of the headers that
were compiled into them (ninja knows which): packages of the system by dpkg, of a prefix made from
wheels by the wheels' records. A file of no package is a component of its own, by its name.
"""

import datetime
import json
import os
import pathlib
import re
import subprocess
import sys
import xml.etree.ElementTree

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAMS = ("server", "client", "ctl", "relay", "auth_jwt.so", "auth_service.so")


def lines_of(*command, **options):
    done = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    return done.stdout.splitlines()


def loaded(build):
    """Files of the libraries; a library that is not found is a fault of the environment."""
    found = set()
    for program in PROGRAMS:
        if not (build / program).exists():
            continue
        for line in lines_of("ldd", str(build / program)):
            if "not found" in line:
                sys.exit(f"sbom: {program}: {line.strip()}")
            found.update(re.findall(r"(/\S+) \(0x", line))
    return found


def compiled_in(build):
    """Headers outside the project that objects were made from."""
    listed = (line.strip() for line in lines_of("ninja", "-C", str(build), "-t", "deps"))
    return {path for path in listed if path.startswith("/") and not path.startswith(f"{ROOT}/src")}


def system_packages(files):
    """{file: (name, version)} by dpkg. A merged /usr has some files under two names."""
    owners, names = {}, {}
    for file in files:
        for name in {file, os.path.realpath(file)}:
            names.setdefault(name, file)
            names.setdefault(name.removeprefix("/usr"), file)
    wanted = sorted(names)
    for at in range(0, len(wanted), 1000):
        for line in lines_of("dpkg", "-S", *wanted[at:at + 1000]):
            package, _, path = line.partition(": ")
            if path in names and not package.startswith("diversion"):
                owners[names[path]] = package.split(",")[0].split(":")[0]
    versions = {}
    if owners:
        form = "${Package}\t${Version}\n"
        told = lines_of("dpkg-query", "-W", "-f", form, *sorted(set(owners.values())))
        versions = dict(line.split("\t") for line in told)
    return {file: (name, versions[name]) for file, name in owners.items()}


def wheel_packages(files):
    """{file: (name, version)} by the records of the wheels in the prefixes of the files."""
    owners = {}
    prefixes = {part for file in files for part in pathlib.Path(file).parents
                if (part / "pyvenv.cfg").exists()}
    for prefix in prefixes:
        for record in prefix.glob("lib/python3*/site-packages/*.dist-info/RECORD"):
            text = (record.parent / "METADATA").read_text(encoding="utf-8", errors="replace")
            facts = tuple(re.search(rf"^{key}: (.*)$", text, re.MULTILINE).group(1)
                          for key in ("Name", "Version"))
            for line in record.read_text(encoding="utf-8").splitlines():
                path = line.rsplit(",", 2)[0].strip('"')
                owners[os.path.normpath(record.parent.parent / path)] = facts
    return {file: owners[name] for file in files
            for name in (os.path.realpath(file), os.path.normpath(file)) if name in owners}


def components(build):
    files = loaded(build) | compiled_in(build)
    by_dpkg = system_packages(files)
    by_wheel = wheel_packages(files - by_dpkg.keys())
    found = {}
    for kind, owners in (("deb", by_dpkg), ("pypi", by_wheel)):
        place = "deb/debian" if kind == "deb" else "pypi"
        for name, version in owners.values():
            found[f"pkg:{place}/{name}@{version}"] = (name, version)
    listed = [{"type": "library", "name": name, "version": version, "purl": purl, "bom-ref": purl}
              for purl, (name, version) in sorted(found.items())]
    others = {os.path.basename(file) for file in loaded(build) - by_dpkg.keys() - by_wheel.keys()}
    listed += [{"type": "file", "name": name, "bom-ref": f"file:{name}"} for name in sorted(others)]
    return listed


def main():
    build, target = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    package = xml.etree.ElementTree.parse(ROOT / "package.xml").getroot()
    name, version = package.findtext("name"), package.findtext("version")
    epoch = int(os.environ.get("SOURCE_DATE_EPOCH") or (build / "build.ninja").stat().st_mtime)
    made = datetime.datetime.fromtimestamp(epoch, datetime.timezone.utc)
    listed = components(build)
    target.write_text(json.dumps({
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {
            "timestamp": made.strftime("%Y-%m-%dT%H:%M:%SZ"),
            "component": {"type": "application", "name": name, "version": version, "bom-ref": name,
                          "licenses": [{"license": {"id": package.findtext("license")}}]},
        },
        "components": listed,
        "dependencies": [{"ref": name, "dependsOn": [each["bom-ref"] for each in listed]}],
    }, indent=1) + "\n", encoding="utf-8")
    print(f"[sbom] {target}: {len(listed)} components")


main()
