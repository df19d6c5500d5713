#!/usr/bin/env python3
"""Manual pages and a completion for bash, from what the built programs say of themselves.

Usage: manuals.py <build folder> <target folder>. From `--help` of each program, that of each
subcommand of ctl, and the table of `ctl config-doc`.
"""

import pathlib
import re
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
    return sorted(set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", text)))


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


def completion(keys, helps, of_ctl):
    def words(items):
        return " ".join(items)

    of = "".join(f"    {name}) words='{words(opts)}' ;;\n" for name, opts in of_ctl.items())
    text = f"""# bash completion for connect_bridge
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
    server) words='--ros-args --params-file -p {words(helps['server'])}' ;;
    client) words='--ros-args --params-file -p {words(helps['client'])}' ;;
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
    (target / "connect_bridge.bash").write_text(text, encoding="utf-8")


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
completion([cells[0] for _, cells in table], helps, of_ctl)
print(f"[manuals] {target}: {len(NAMES) + 2} pages, {len(table)} parameters, "
      f"{len(of_ctl)} subcommands of ctl")
sys.exit(0 if table and of_ctl else 1)
