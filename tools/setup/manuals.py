#!/usr/bin/env python3
"""Manual pages and completions for bash, zsh and fish, from what the built programs say.

Usage: manuals.py <build folder> <target folder>. From `--help` of each program, that of each
subcommand of ctl, and the table of `ctl config-doc`.
"""

import pathlib
import re
import shlex
import subprocess
import sys

build, target = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
NAMES = {
    "server": "the side of a ROS 2 bridge that listens",
    "client": "the side of a ROS 2 bridge that dials",
    "ctl": "make tokens and certificates, check configurations of a ROS 2 bridge",
    "relay": "meeting point of robots and operators that nobody can dial",
}
SEE = "connect_bridge-server(1), connect_bridge-client(1), connect_bridge-ctl(1), " \
      "connect_bridge-relay(1), connect_bridge.yaml(5)"


def said(name, *words):
    text = subprocess.run([build / name, *words], capture_output=True, text=True, check=True).stdout
    command = "connect_bridge-relay" if name == "relay" else f"connect_bridge {name}"
    text = re.sub(rf"\S*/{name}\b", command, text)
    return text.replace("ros2 run connect_bridge ", "connect_bridge ")


def roff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-").replace("'", "\\(aq")
    return re.sub(r"^\.", r"\\&.", text, flags=re.MULTILINE)


def page(title, section, name, what, body):
    version = said("ctl", "--version").split()[1]
    head = f'.TH {title.upper()} {section} "" "connect_bridge {version}" "ROS2 Connect"\n'
    head += f".SH NAME\n{roff(name)} \\- {roff(what)}\n"
    text = head + body + f".SH SEE ALSO\n{roff(SEE)}\n"
    (target / f"{title}.{section}").write_text(text, encoding="utf-8")


def prose(text):
    """Lines as they are: the programs' texts have lists and files in them."""
    return f".nf\n{roff(text.strip())}\n.fi\n"


def subcommands(text):
    listed = re.search(r"^Subcommands:\n((?:  .*\n?)+)", text, re.MULTILINE)
    return re.findall(r"^  ([a-z-]+) ", listed.group(1), re.MULTILINE) if listed else []


def options(text):
    """Those of the usage and of the list of options: other lines speak of other programs."""
    lines = [line for line in text.splitlines() if re.match(r"Usage:| +or:| +-", line)]
    return sorted(set(re.findall(r"(?<![\w-])-(?:-[a-z][a-z-]*|p\b)", "\n".join(lines))))


def rows():
    """(section, cells) of each parameter."""
    section = ""
    for line in said("ctl", "config-doc").splitlines():
        if line.startswith("## "):
            section = line[3:]
        elif line.startswith("| `"):
            cells = [c.strip() for c in re.split(r"(?<!\\)\|", line)[1:-1]]
            cells = [c.replace("\\|", "|").replace("`", "") for c in cells]
            if cells[0].endswith(" *"):
                cells[:2] = cells[0][:-2], cells[1] + "; may change while it runs"
            yield section, cells


def parameter_page(table):
    body = ".SH DESCRIPTION\nParameters of the nodes connect_server and connect_client, in a ROS 2 "
    body += "parameter file. In the package it is /etc/connect_bridge/server.yaml or client.yaml.\n"
    last = ""
    for section, (key, kind, default, meaning) in table:
        if section != last:
            body += f".SH {roff(section.upper())}\n"
            last = section
        facts = [kind] + [f"default {default}"] * bool(default)
        body += f".TP\n.B {roff(key)}\n({roff('; '.join(facts))})\n.br\n{roff(meaning)}\n"
    page("connect_bridge.yaml", 5, "connect_bridge.yaml", "parameters of a ROS 2 bridge", body)


def words(items):
    return " ".join(items)


def bash_completion(keys, helps, of_ctl):
    of = "".join(f"    {name}) words='{words(opts)}' ;;\n" for name, opts in of_ctl.items())
    return f"""# bash completion for connect_bridge
_connect_bridge() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} words=
  compopt +o nospace
  if [ "$COMP_CWORD" = 1 ]; then
    COMPREPLY=($(compgen -W 'server client ctl --help --version' -- "$word"))
    return
  fi
  case ${{COMP_WORDS[1]}}:$before in
    *:--params-file | *:--file) COMPREPLY=($(compgen -f -- "$word")); return ;;
    server:-p | client:-p)
      compopt -o nospace
      COMPREPLY=($(compgen -S ':=' -W '{words(keys)}' -- "$word"))
      return ;;
  esac
  case ${{COMP_WORDS[1]}} in
    server) words='{words(helps['server'])}' ;;
    client) words='{words(helps['client'])}' ;;
    ctl)
      if [ "$COMP_CWORD" = 2 ]; then
        COMPREPLY=($(compgen -W '{words(of_ctl)} {words(helps['ctl'])}' -- "$word"))
        return
      fi
      case ${{COMP_WORDS[2]}} in
{of}      esac ;;
  esac
  COMPREPLY=($(compgen -W "$words" -- "$word"))
  [ "${{word#-}}" != "$word" ] || COMPREPLY+=($(compgen -f -- "$word"))
}}
complete -o filenames -F _connect_bridge connect_bridge
"""


def zsh_completion(keys, helps, of_ctl):
    of = "".join(f"        {name}) compadd -- {words(opts)} ;;\n" for name, opts in of_ctl.items())
    return f"""#compdef connect_bridge
_connect_bridge() {{
  local before=${{words[CURRENT-1]}}
  if (( CURRENT == 2 )); then compadd -- server client ctl --help --version; return; fi
  case ${{words[2]}}:$before in
    *:--params-file | *:--file) _files; return ;;
    server:-p | client:-p) compadd -S ':=' -- {shlex.join(keys)}; return ;;
  esac
  case ${{words[2]}} in
    server) compadd -- {words(helps['server'])} ;;
    client) compadd -- {words(helps['client'])} ;;
    ctl)
      if (( CURRENT == 3 )); then compadd -- {words(of_ctl)} {words(helps['ctl'])}; return; fi
      case ${{words[3]}} in
{of}      esac ;;
  esac
  _files
}}
_connect_bridge "$@"
"""


def fish_completion(keys, helps, of_ctl):
    seen = "__fish_seen_subcommand_from"

    def line(condition, rest):
        return f"complete -c connect_bridge -n '{condition}' {rest}\n"

    def options_of(condition, names):
        kinds = {True: "-l", False: "-s"}  # long, short
        return "".join(
            line(condition, f"{kinds[name.startswith('--')]} {name.lstrip('-')}") for name in names)

    text = "# fish completion for connect_bridge\n"
    text += line("__fish_use_subcommand", "-f -a 'server client ctl --help --version'")
    escaped = re.sub(r"([<>])", r"\\\1", words(f"{key}:=" for key in keys))
    for side in ("server", "client"):
        text += options_of(f"{seen} {side}", helps[side])
        text += line(f"{seen} {side}; and string match -q -- -p (commandline -opc)[-1]",
                     f"-f -a '{escaped}'")
    text += line(f"{seen} ctl; and not {seen} {words(of_ctl)}", f"-f -a '{words(of_ctl)}'")
    for name, names in of_ctl.items():
        text += options_of(f"{seen} ctl; and {seen} {name}", names)
    return text


COMPLETIONS = {  # of which shell: the file, in its own folder, by the name that the shell expects
    "connect_bridge.bash": bash_completion,
    "_connect_bridge": zsh_completion,
    "connect_bridge.fish": fish_completion,
}


target.mkdir(parents=True, exist_ok=True)
helps, of_ctl = {}, {}
for program, what in NAMES.items():
    text = said(program, "--help")
    helps[program] = options(text)
    body = ".SH DESCRIPTION\n" + prose(text)
    if program == "ctl":
        for command in subcommands(text):
            more = said("ctl", command, "--help")
            of_ctl[command] = options(more)
            body += f".SH {roff(command.upper())}\n" + prose(more)
    page(f"connect_bridge-{program}", 1, f"connect_bridge-{program}", what, body)
page("connect_bridge", 1, "connect_bridge", "start a program of a ROS 2 bridge in its environment",
     ".SH SYNOPSIS\n.B connect_bridge\nserver|client|ctl [ARGUMENT]...\n.SH DESCRIPTION\n"
     "A shell with an environment of ROS 2 keeps it; otherwise it is that of ROS_SETUP in\n"
     ".IR /etc/default/connect_bridge .\n"
     "As services: connect_bridge\\-server@USER and connect_bridge\\-client@USER, where USER runs\n"
     "the nodes of this machine.\n")
table = list(rows())
parameter_page(table)
for file, made in COMPLETIONS.items():
    text = made([cells[0] for _, cells in table], helps, of_ctl)
    (target / file).write_text(text, encoding="utf-8")
print(f"[manuals] {target}: {len(NAMES) + 2} pages, {len(table)} parameters, "
      f"{len(of_ctl)} subcommands of ctl")
sys.exit(0 if table and of_ctl else 1)
