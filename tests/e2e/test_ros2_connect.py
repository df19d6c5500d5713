"""`ros2 connect`, as the package installs it: found by its entry point, it starts the programs. A
ROS 2 without ros2cli has a small class in its place here, which calls the command as ros2cli does.
"""

import importlib.util
import os
import subprocess
import sys

import pytest

from harness.programs import build_dir

WITHOUT_CLI = """
import argparse, importlib.metadata, sys
command = importlib.metadata.entry_points(group="ros2cli.command")["connect"].load()()
parser = argparse.ArgumentParser(formatter_class=argparse.RawDescriptionHelpFormatter)
command.add_arguments(parser, "ros2")
sys.exit(command.main(parser=parser, args=parser.parse_args(sys.argv[2:])))
"""
WITH_CLI = "import sys; from ros2cli.cli import main; sys.exit(main())"


@pytest.fixture(scope="module")
def ros2(tmp_path_factory):
    prefix = tmp_path_factory.mktemp("prefix")
    subprocess.run(["cmake", "--install", build_dir(), "--prefix", prefix],
                   check=True, capture_output=True, timeout=120)
    (modules,) = {found.parent for found in prefix.rglob("ros2connect.py")}
    has_cli = importlib.util.find_spec("ros2cli") is not None
    paths = [str(modules), *os.environ.get("PYTHONPATH", "").split(":")]
    if not has_cli:
        stand_in = tmp_path_factory.mktemp("cli") / "ros2cli"
        stand_in.mkdir()
        (stand_in / "__init__.py").touch()
        (stand_in / "command.py").write_text("class CommandExtension:\n    pass\n")
        paths.append(str(stand_in.parent))

    def run(*words):
        return subprocess.run(
            [sys.executable, "-B", "-c", WITH_CLI if has_cli else WITHOUT_CLI, "connect", *words],
            env=dict(os.environ, PYTHONPATH=":".join(paths)),
            capture_output=True, text=True, timeout=60)

    return run


@pytest.mark.parametrize("words, code, said", [
    (("--help",), 0, "server --pair"),
    ((), 0, "\nSubcommands:\n"),
    (("doctor", "--list"), 0, "| `host_unknown` |"),
    (("check", "--help"), 0, "parameter file"),
    (("check", "absent.yaml"), 2, "absent.yaml"),
    (("pair", "--no-such-word"), 2, "--no-such-word"),
    (("relay", "--version"), 0, "connect_bridge "),
    (("ctl", "--version"), 0, "connect_bridge "),
    (("no-such-command",), 2, "no-such-command"),
])
def test_the_programs_are_a_command_of_the_ros_2_cli(ros2, words, code, said):
    done = ros2(*words)
    assert said in done.stdout + done.stderr
    assert done.returncode == code
