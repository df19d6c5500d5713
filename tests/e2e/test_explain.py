"""`ctl explain`: which rule decides about a name, and why."""

import subprocess

import pytest

from harness.programs import build_dir

FILE = """/**:
  ros__parameters:
    rules: [drive, look, shut]
    rule:
      drive: {import_topics: [/cmd_vel], identities: [ops], groups: [crew]}
      look: {export_topics: ["/camera/**"]}
      shut: {deny: ["/camera/secret"]}
"""


def ctl(*words):
    return subprocess.run(
        [build_dir() / "ctl", "explain", *words], capture_output=True, text=True, timeout=20
    )


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "robot.yaml"
    path.write_text(FILE, encoding="ascii")
    return str(path)


def test_it_says_which_rule_decides(file):
    made = ctl(file, "--identity", "ops", "--topic", "/cmd_vel")
    assert made.returncode == 1, "it is not exported"
    exported, imported = made.stdout.split("import (")
    assert exported.startswith(
        "groups of ops: none given (--group)\n"
        "export (the topic here, for the peer), /cmd_vel: not allowed\n"
    )
    assert imported.startswith("the topic of the peer, here), /cmd_vel: allowed\n")
    assert 'allowed by rule "drive" (rule.drive.import_topics: "/cmd_vel")' in imported
    assert "export_topics" in imported  # what the peer needs
    crew = ctl(file, "--identity", "x", "--group", "crew", "--direction", "import", "--topic",
               "/cmd_vel")
    assert crew.stdout == "import (" + imported
    nobody = ctl(file, "--direction", "import", "--topic", "/cmd_vel")
    assert "not allowed" in nobody.stdout and 'only for identities ["ops"]' in nobody.stdout
    assert (crew.returncode, nobody.returncode) == (0, 1)


@pytest.mark.parametrize(
    ["words", "said"],
    [
        ([], "A subcommand is required"),
        (["bogus"], '"bogus" is unknown: a subcommand is required'),
        (["check"], "file is required"),
        (["check", "--bogus", "x"], "The following argument was not expected: --bogus"),
    ],
)
def test_wrong_arguments_are_told_with_the_right_ones(words, said):
    done = subprocess.run([build_dir() / "ctl", *words], capture_output=True, text=True, timeout=20)
    assert done.returncode == 2
    assert done.stderr.startswith(f"{said}\n\n") and "Usage: " in done.stderr
    assert done.stdout == ""


def test_what_is_wrong_is_told(file, tmp_path):
    for words in (
        [file, "--topic", "cmd_vel"],
        [file, "--topic", "/a/_action/feedback"],
        [file, "--service", "/a/set_parameters"],
        [file, "--topic", "/a", "--type", "p/srv/T"],
        [str(tmp_path / "nowhere.yaml"), "--topic", "/a"],
    ):
        wrong = ctl(*words)
        assert wrong.returncode == 2 and wrong.stderr and not wrong.stdout, words
    for words in ([file], [file, "--topic", "/a", "--service", "/b"], [file, "--topic"]):
        assert ctl(*words).returncode == 2, words


def test_help():
    shown = ctl("--help")
    assert shown.returncode == 0
    for word in ("--identity", "--group", "--topic", "--service", "--action", "--parameters",
                 "--type", "--direction", "export, or both", "Exit code: 0 if it is allowed"):
        assert word in shown.stdout
