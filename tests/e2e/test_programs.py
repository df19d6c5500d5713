"""What the programs say without a ROS graph: version, help, and what is wrong with a file."""

import json
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


@pytest.mark.parametrize(
    ["given", "told"],
    [
        ("connections_max:=ten", 'connections_max: "ten" is wrong, expected a whole number'),
        ("listen.port:=abc", 'listen.port: "abc" is wrong, expected a whole number'),
        ("dead_after:=[3.0]", "dead_after: [3.0] is wrong, expected a number"),
        ("allow_plaintext:=1", "allow_plaintext: 1 is wrong, expected true or false"),
        ("rules:=look", 'rules: "look" is wrong, expected a list of strings: ["look"]'),
        ("use_sim_time:=maybe", 'use_sim_time: "maybe" is wrong, expected true or false'),
        ("dead_after", "-p dead_after: expected KEY:=VALUE"),
        ("dead_after:=", "-p dead_after: expected a value behind :="),
    ],
)
def test_an_argument_that_does_not_fit_is_refused_over_a_file_that_does(tmp_path, given, told):
    file = tmp_path / "robot.yaml"
    file.write_text(
        "connect_server: {ros__parameters: {auth: {token: 0123456789abcdef}, connections_max: 8,"
        " listen: {port: 0}, dead_after: 3, allow_plaintext: true, rules: [], use_sim_time: true}}",
        encoding="ascii",
    )
    refused = run("server", "--ros-args", "--params-file", file, "-p", given)
    assert refused.returncode == 2
    assert told in refused.stderr


@pytest.fixture
def missing_rmw(monkeypatch):
    """A shell whose RMW is named and not installed."""
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_nowhere_cpp")
    return "RMW_IMPLEMENTATION=rmw_nowhere_cpp; installed: rmw_"


def test_ctl_finds_that_the_rmw_is_missing(tmp_path, missing_rmw):
    file = tmp_path / "robot.yaml"
    file.write_text(
        "/**: {ros__parameters: {auth: {token: 0123456789abcdef}}}", encoding="ascii"
    )
    checked = run("ctl", "check", file)
    assert checked.returncode == 2
    assert f"the RMW is not installed ({missing_rmw}" in checked.stderr
    assert "or unset RMW_IMPLEMENTATION" in checked.stderr
    for words in ([], [file], ["ws://127.0.0.1:1"]):
        found = run("ctl", "doctor", "--json", *words)
        assert found.returncode == 1, found.stderr
        first = json.loads(found.stdout)["findings"][0]
        assert first["id"] == "rmw_missing" and first["detail"].startswith(missing_rmw)
    # It is the fault of the shell: a program of ROS does not start there.
    assert "rmw_nowhere_cpp" in run("server", "--ros-args", "--params-file", file).stderr


def test_ctl_needs_no_rmw(tmp_path, missing_rmw, monkeypatch):
    file = tmp_path / "robot.yaml"
    file.write_text(
        "/**: {ros__parameters: {auth: {token: 0123456789abcdef}}}", encoding="ascii"
    )
    for words in (["--help"], ["explain", file, "--topic", "/a"], ["token", "anna"],
                  ["config-doc"], ["doctor", "--list"]):
        told = run("ctl", *words)
        assert told.returncode in (0, 1) and "[rcl]" not in told.stderr, told.stderr
    monkeypatch.setenv("RMW_IMPLEMENTATION", "")
    assert run("ctl", "check", file).returncode == 0
    monkeypatch.setenv("RCL_ASSERT_RMW_ID_MATCHES", "rmw_nowhere_cpp")
    assert "RCL_ASSERT_RMW_ID_MATCHES=rmw_nowhere_cpp" in run("ctl", "check", file).stderr


def test_ctl_says_what_was_meant():
    told = run("ctl", "chek", "robot.yaml")
    assert told.returncode == 2
    assert told.stderr == '"chek" is unknown: did you mean check?\n', "the help would hide it"
    told = run("relay", "--robt", "r@relay:443")
    assert (told.returncode, told.stderr) == (2, "--robt is unknown: did you mean --robot?\n")
    told = run("server", "--ros-args", "--parms-file", "robot.yaml")
    assert told.returncode == 2
    assert "unknown ROS argument --parms-file: did you mean --params-file?" in told.stderr
    told = run("ctl", "doctor", "robot:9090")
    assert told.returncode == 2
    assert told.stderr == "robot:9090: no such file; did you mean wss://robot:9090?\n"


def test_a_relay_without_files_names_its_first_command(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    own = run("relay")
    assert own.returncode == 2
    assert f"'relay --robot NAME@HOST:443' makes {tmp_path}/.connect_relay/relay.yaml" in own.stderr
    given = run("relay", tmp_path / "relay.yaml")
    assert (given.returncode, "--robot" in given.stderr) == (2, False)
