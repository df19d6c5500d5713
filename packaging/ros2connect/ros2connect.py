"""`ros2 connect`: the programs of connect_bridge as a command of the ROS 2 CLI."""
from argparse import REMAINDER
import os
import pathlib
import re
import subprocess

from ros2cli.command import CommandExtension

PROGRAMS = ('client', 'ctl', 'relay', 'server')
HELP = """\
Words and what they start:
  server, client, relay  these programs
  pair                   server --pair
  status, doctor, ...    the commands of ctl; without a word their list"""


def path_of(program):
    """Return the installed program: its folder is beside that of Python's modules."""
    for folder in pathlib.Path(__file__).absolute().parents:
        path = folder / 'connect_bridge' / program
        if os.access(path, os.X_OK):
            return path
    raise RuntimeError(f"'{program}' of the package connect_bridge is not installed")


def words_for(words):
    """Return the program and its arguments."""
    first = words[0] if words else '--help'
    if first == 'pair':
        return ['server', '--pair', *words[1:]]
    return list(words) if first in PROGRAMS else ['ctl', first, *words[1:]]


def first_words(**_):
    """Return what may follow `ros2 connect`."""
    said = subprocess.run([path_of('ctl'), '--help'], capture_output=True, text=True).stdout
    return [*PROGRAMS, 'pair', *re.findall(r'^  ([a-z-]+)  ', said, re.MULTILINE)]


class ConnectCommand(CommandExtension):
    """Join this ROS 2 graph with another one (ROS2 Connect)."""

    def add_arguments(self, parser, cli_name):
        parser.epilog = HELP
        parser.add_argument('words', nargs=REMAINDER).completer = first_words

    def main(self, *, parser, args):
        program, *arguments = words_for(args.words)
        path = path_of(program)
        os.execv(path, [str(path), *arguments])
