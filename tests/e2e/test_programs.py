"""What the programs say without a ROS graph: version, help, and what is wrong with a file."""

import re
import subprocess

import pytest

from harness.programs import build_dir


def run(name, *words):
    command = [build_dir() / name, *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=20)


@pytest.mark.parametrize("name", ["server", "client", "ctl", "relay"])
def test_version(name):
    told = run(name, "--version")
    assert told.returncode == 0, told.stderr
    assert re.fullmatch(r"connect_bridge \d+\.\d+\.\d+ \(protocol 1; [^()]+\)\n", told.stdout)


# A file that cannot be opened would be told if anything began.
@pytest.mark.parametrize("name", ["server", "client"])
@pytest.mark.parametrize("word", ["--help", "-h"])
def test_help(name, word):
    told = run(name, word, "--ros-args", "--params-file", "/nowhere.yaml")
    assert told.returncode == 0 and told.stderr == ""
    assert told.stdout.startswith(f"Usage: ros2 run connect_bridge {name} ")
    assert f"named connect_{name}." in told.stdout and "auth.token_file" in told.stdout


def test_a_file_without_its_token_is_explained_all_the_same(tmp_path, monkeypatch):
    monkeypatch.delenv("CONNECT_BRIDGE_TOKEN", raising=False)
    file = tmp_path / "robot.yaml"
    file.write_text("connect_server:\n  ros__parameters:\n    listen: {port: 4711}\n",
                    encoding="ascii")
    checked = run("ctl", "check", file)
    assert checked.returncode == 2
    assert f"{file}: 1 problem\n  auth.token_file: expected a token" in checked.stderr
    assert checked.stdout.startswith("The rest of the file means:\nlistens: on ")
    assert ", port 4711, " in checked.stdout


def test_rules_that_others_may_change_are_refused(tmp_path):
    """Where other machines reach this side; else a warning."""
    file = tmp_path / "robot.yaml"
    file.write_text(
        "/**: {ros__parameters: {listen: {address: 0.0.0.0}, allow_plaintext: true,"
        " auth: {token: 0123456789abcdef}}}",
        encoding="ascii",
    )
    file.chmod(0o602)
    refused = run("server", "--ros-args", "--params-file", file)
    assert refused.returncode == 2
    assert f"every user of this machine may change {file} (chmod go-w)" in refused.stderr
    assert run("ctl", "check", file).returncode == 2
    file.write_text(file.read_text("ascii").replace("0.0.0.0", "127.0.0.1"), encoding="ascii")
    checked = run("ctl", "check", file)
    assert checked.returncode == 0 and "may change" in checked.stdout
