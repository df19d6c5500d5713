"""The demo says what crossed, and leaves no process behind however it ends."""

import os
import pathlib
import pty
import re
import select
import signal
import subprocess
import sys
import time

import pytest

from graph import until
from harness.programs import ROOT

sys.path.insert(0, str(ROOT / "tools" / "demo"))
import table  # noqa: E402

MARK = "CONNECT_DEMO_TEST"


def marked(value):
    """Processes that were started, at any remove, with the mark in their environment."""
    found = []
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            if f"{MARK}={value}".encode() in (process / "environ").read_bytes().split(b"\0"):
                found.append((process / "cmdline").read_bytes().replace(b"\0", b" ").decode())
        except OSError:
            pass  # it has just ended
    return found


def start(value, **options):
    env = {k: v for k, v in os.environ.items() if k not in ("ROS_DOMAIN_ID", "DEMO_SECONDS")}
    env.update({MARK: value, **options.pop("more", {})})
    return subprocess.Popen([ROOT / "tools" / "demo" / "run"], env=env, **options)


def test_every_topic_crosses_and_it_ends_by_itself():
    demo = start("timed", more={"DEMO_SECONDS": "8"}, stdout=subprocess.PIPE, text=True)
    said = demo.communicate(timeout=60)[0]
    assert demo.returncode == 0, said
    assert "Every topic crossed" in said and "\x1b[" not in said
    assert "service, action and parameter change were answered" in said
    shown = said.split("Waiting for the first messages ...")[1]
    assert "of 3 frames" in shown and not re.search(r"[012] of 3 frames|\s-\s+-\s", shown), said
    assert not marked("timed")


def report(megabytes):
    """One of a side that has seen so much, at 500 MB/s."""
    topic = {"messages": megabytes, "bytes": megabytes * 1_000_000, "late_ms": [1.0, 2.0, 90.0]}
    return {"time": megabytes / 500, "topics": {"/camera/image": topic}}


def test_columns_stay_apart_and_the_median_is_one():
    seen = table.Seen()
    for megabytes in (1000, 1500):
        seen.add(report(megabytes))
    assert seen.cells("/camera/image").split() == ["500.0", "500000.0", "1500.000", "2.00"]


def test_what_did_not_cross_is_named(tmp_path):
    """With a client that reaches nobody it fails."""
    for name in ("server", "client"):
        program = tmp_path / name
        logged = {"server": "listening on nothing", "client": ": connected to nobody"}[name]
        program.write_text(f"#!/bin/sh\necho {logged}\nexec sleep 60\n", encoding="ascii")
        program.chmod(0o755)
    more = {"DEMO_SECONDS": "4", "CONNECT_BUILD_DIR": str(tmp_path)}
    demo = start("broken", more=more, stdout=subprocess.PIPE, text=True)
    said = demo.communicate(timeout=60)[0]
    assert demo.returncode == 1
    topics = ("/chatter", "/camera/image", "/tf", "/cmd_vel", "'lidar'", "'imu'", "'camera'")
    for name in (*topics, "/arm/enable", "/lookup", "/talker"):
        assert name in said.split("Did not cross:")[1].split("\n")[0], said
    assert not marked("broken")


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_nothing_is_left_after_a_signal(how):
    """On a terminal, as for a user: the table is redrawn in place until Ctrl-C."""
    master, slave = pty.openpty()
    value = f"signal{int(how)}"
    demo = start(value, stdout=slave, stderr=slave)
    os.close(slave)
    text = b""
    end = time.monotonic() + 40
    # One reading may end anywhere, also in the middle of a table.
    while not (b"\x1b[" in text and b"/camera/image" in text) and time.monotonic() < end:
        if select.select([master], [], [], 1)[0]:
            text += os.read(master, 4096)
    assert b"\x1b[" in text and b"/camera/image" in text, text.decode()
    assert len(marked(value)) >= 5
    demo.send_signal(how)
    assert demo.wait(10) == (-how if how == signal.SIGKILL else 0)
    os.close(master)
    until(lambda: not marked(value), lambda: f"all have ended: {marked(value)}", 5)
