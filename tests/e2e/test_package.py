"""What a package has besides the programs: manual pages, completions, bill of materials; and the
page of findings."""

import json
import os
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree

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


# What each shell offers for the last of these words, one offer a line.
OFFERS = {
    "bash": """compopt() { :; }
. {made}/connect_bridge.bash
COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
_connect_bridge
printf '%s\\n' "${COMPREPLY[@]}"
""",
    "zsh": """compadd() { print -rl -- "$@" }
_files() { }
words=("$@") CURRENT=$#
. {made}/_connect_bridge | grep -- "^$words[$CURRENT]"
""",
    "fish": """source {made}/connect_bridge.fish
complete -C "$argv"
""",
}


@pytest.mark.parametrize("shell", OFFERS)
def test_a_shell_completes_words_options_and_parameters(shell, tmp_path):
    if shutil.which(shell) is None:
        pytest.skip(f"NOT TESTED: no {shell}")
    made_by("manuals.py", tmp_path)
    script = tmp_path / "offers"
    script.write_text(OFFERS[shell].replace("{made}", str(tmp_path)), encoding="utf-8")
    rest = {"bash": ["--norc"], "zsh": ["-f"], "fish": ["--no-config"]}[shell]

    def offers(line):
        words = ["connect_bridge", *line.split()]
        done = subprocess.run([shell, *rest, script, *words], env=dict(os.environ, HOME=tmp_path),
                              capture_output=True, text=True, timeout=30, cwd=tmp_path)
        assert done.stderr == ""
        return {word.removesuffix(":=") for word in done.stdout.split()}

    assert offers("serv") == {"server"}
    assert offers("server --pa") == {"--pair", "--params-file"}
    assert offers("client --dr") == set()  # it refuses this word
    assert offers("ctl expl") == {"explain"}
    assert offers("ctl check --ro") == {"--role"}
    assert offers("server --ros-args -p tls.p") == {"tls.pin", "tls.private_key"}
    assert offers("client --ros-args -p rule.") > {"rule.<name>.max_age"}


def test_the_page_of_findings_is_what_the_doctor_knows(tmp_path):
    made_by("findings.py", tmp_path / "findings.md")
    page = (tmp_path / "findings.md").read_text(encoding="utf-8")
    assert page.count("\n## ") > 80
    assert page == (ROOT / "docs" / "findings.md").read_text(encoding="utf-8"), \
        "tools/setup/findings.py build docs/findings.md"


def test_the_bill_names_what_is_linked_and_what_is_compiled_in(tmp_path):
    made_by("sbom.py", tmp_path / "sbom.json")
    bill = json.loads((tmp_path / "sbom.json").read_text(encoding="utf-8"))
    assert bill["bomFormat"] == "CycloneDX" and bill["specVersion"] == "1.5"
    versions = {each["name"]: each.get("version") for each in bill["components"]}
    for linked in ("libssl3", "libzstd1", "libvpx", "libturbojpeg", "ros-", "libboost",
                   "nlohmann-json3-dev"):
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


STUBS = """import sys, types
class Made:
    def __init__(self, *first, **more):
        self.first, self.__dict__ = first, {**more, "first": first}
for name, words in {"launch": "LaunchDescription", "launch.actions": "DeclareLaunchArgument "
                    "OpaqueFunction", "launch_ros": "", "launch_ros.actions": "Node"}.items():
    sys.modules[name] = types.ModuleType(name)
    for word in words.split():
        setattr(sys.modules[name], word, type(word, (Made,), {}))
"""


@pytest.mark.parametrize("program", ["server", "client"])
def test_a_launch_file_hands_every_argument_on(program):
    """Without ROS's launch, which need not be installed: with stand-ins for what it gives."""
    file = ROOT / "launch" / f"{program}.launch.py"
    script = STUBS + f"""
import json, runpy
*declared, opaque = runpy.run_path({str(file)!r})["generate_launch_description"]().first[0]
given = {{one.first[0]: one.default_value for one in declared}}
context = types.SimpleNamespace(launch_configurations={{
    **given, "params_file": "robot.yaml", "listen.port": "9091", "ros_version": "2",
    "launch_file_dir": "/x"}})
(node,) = opaque.function(context)
print(json.dumps([node.package, node.executable, node.name, node.respawn, node.arguments]))
"""
    ran = subprocess.run([sys.executable, "-B", "-c", script], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    package, executable, name, respawn, arguments = json.loads(ran.stdout)
    assert (package, executable, respawn) == ("connect_bridge", program, True)
    assert name == f"connect_{program}"
    assert arguments == ["--ros-args", "--log-level", "info", "--params-file", "robot.yaml",
                         "-p", "listen.port:=9091"]


@pytest.mark.parametrize("program", ["server", "client"])
def test_a_launch_file_in_xml_declares_what_it_uses(program):
    launch = xml.etree.ElementTree.parse(ROOT / "launch" / f"{program}.launch.xml").getroot()
    node = launch.find("node")
    assert (node.get("pkg"), node.get("exec")) == ("connect_bridge", program)
    text = (ROOT / "launch" / f"{program}.launch.xml").read_text(encoding="utf-8")
    declared = {one.get("name") for one in launch.findall("arg")}
    assert set(re.findall(r"\$\(var (\w+)\)", text)) == declared
