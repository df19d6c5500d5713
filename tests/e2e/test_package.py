"""What a package has besides the programs: manual pages, completion, bill of materials."""

import json
import os
import subprocess
import sys

import pytest

from harness.programs import ROOT, build_dir


def made_by(script, target):
    command = [sys.executable, "-B", ROOT / "tools" / "setup" / script, build_dir(), target]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr


def test_every_parameter_has_a_manual_entry_and_is_completed(tmp_path):
    made_by("manuals.py", tmp_path)
    page = (tmp_path / "connect_bridge.yaml.5").read_text(encoding="utf-8")
    table = subprocess.run([build_dir() / "ctl", "config-doc"], capture_output=True, text=True)
    keys = [line.split("`")[1] for line in table.stdout.splitlines() if line.startswith("| `")]
    assert len(keys) > 50
    completed = (tmp_path / "connect_bridge.bash").read_text(encoding="utf-8").split()
    for key in keys:
        assert ".B " + key.replace("-", "\\-") + "\n" in page
        assert key in {word.strip("'") for word in completed}
    for program in ("server", "client", "ctl", "relay"):
        assert (tmp_path / f"connect_bridge-{program}.1").stat().st_size > 500


def test_the_bill_names_what_is_linked_and_what_is_compiled_in(tmp_path):
    made_by("sbom.py", tmp_path / "sbom.json")
    bill = json.loads((tmp_path / "sbom.json").read_text(encoding="utf-8"))
    assert bill["bomFormat"] == "CycloneDX" and bill["specVersion"] == "1.5"
    versions = {each["name"]: each.get("version") for each in bill["components"]}
    for linked in ("libssl3", "libzstd1", "ros-", "libboost", "nlohmann-json3-dev"):
        found = [version for name, version in versions.items() if name.startswith(linked)]
        assert found and all(found), linked


@pytest.mark.parametrize("file", sorted((ROOT / "examples").glob("*.yaml")), ids=lambda f: f.name)
def test_an_example_is_understood(file):
    environment = dict(os.environ, CONNECT_BRIDGE_TOKEN="0" * 48)
    checked = subprocess.run(
        [build_dir() / "ctl", "check", file, "--role", "server"],
        env=environment, capture_output=True, text=True,
    )
    assert checked.returncode == 0, checked.stderr
    page = file.with_suffix(".md").read_text(encoding="utf-8")
    assert file.name in page and file.with_suffix(".launch.xml").name in page
