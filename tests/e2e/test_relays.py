"""What a relay tells of itself, and several of them."""

import json
import os
import pathlib
import re
import subprocess
import time
import urllib.request

import pytest
from connect_bridge_test_interfaces.msg import Blob

from graph import until
from harness.domains import free_port
from harness.programs import ROOT, Program, build_dir, ros_environment
from proxies import FETCHED, find
from relayed import NO_SUCH_NAME, ROBOT, answer_to, joined, relay, tls_hello  # noqa: F401


def test_its_status_says_who_is_there_and_who_was_refused(joined, relay, topic):
    pair = joined()
    pair.opened(Blob, topic, Blob())
    assert answer_to(relay.port, tls_hello("robot99"))[0] == NO_SUCH_NAME
    address = re.search(r"status is at http://(\S+?)/", relay.program.text()).group(1)

    def asked(path):
        with urllib.request.urlopen(f"http://{address}{path}", timeout=5) as answer:
            return answer.read().decode()

    status = json.loads(asked("/api/status"))
    (robot,) = status["robots"]
    assert robot["robot"] == ROBOT and robot["open"] and robot["pairs"] == 1
    assert robot["sent_bytes"] > 1000 and robot["received_bytes"] > 1000
    assert status["refused"]["no_such_robot"] == 1
    metrics = asked("/metrics")
    assert 'connect_bridge_connections_refused_total{reason="no_such_robot"} 1' in metrics
    assert "connect_bridge_robots 1" in metrics
    env = ros_environment(0)
    shown = subprocess.run([build_dir() / "ctl", "status", address], env=env, capture_output=True)
    assert "robot7" in shown.stdout.decode() and "1 no such robot" in shown.stdout.decode()
    # This user's programs are found without an address.
    found = list(pathlib.Path(env["XDG_RUNTIME_DIR"]).glob("connect_bridge/relay-*.status"))
    assert len(found) == 1


def test_two_relays_behind_one_address(joined, relay, tmp_path, topic):
    """As config/haproxy_relays.cfg has them; one of them is killed, and comes back."""
    if not find("haproxy"):
        pytest.skip("NOT TESTED: haproxy is not installed (tools/setup/proxies.sh)")
    relay.program.stop()
    programs, ports = [], []
    for number in (1, 2):
        relay.port = free_port()
        relay.file = tmp_path / f"relay{number}.yaml"
        relay.write(f"{tmp_path}/relay", trusted_proxies=["127.0.0.1"])
        programs.append(relay.another(relay.file, f"relay{number}").start())
        ports.append(relay.port)
    relay.dialled = free_port()
    text = (ROOT / "config" / "haproxy_relays.cfg").read_text()
    for old, new in (
        ("maxconn 20000", "maxconn 200\n    log stdout format raw local0"),  # what a test may have
        ("defaults\n", "defaults\n    log global\n"),
        ("bind :443", f"bind 127.0.0.1:{relay.dialled}"),
        ("192.0.2.11:443", f"127.0.0.1:{ports[0]}"),
        ("192.0.2.12:443", f"127.0.0.1:{ports[1]}"),
    ):
        assert old in text
        text = text.replace(old, new)
    config = tmp_path / "haproxy.cfg"
    config.write_text(text)
    libraries = ":".join(map(str, FETCHED.glob("usr/lib/*-linux-gnu")))
    env = dict(os.environ, LD_LIBRARY_PATH=libraries)
    haproxy = Program("haproxy", [find("haproxy"), "-W", "-f", config], env, tmp_path).start()
    try:
        for program in programs:
            program.wait_for("listens on port")
        pair = joined(dead_after=3.0)
        publisher, collector = pair.opened(Blob, topic, Blob())
        link = until(pair.server.links, "the link in the status")[0]
        assert link["peer"].startswith("127.0.0.1"), "the visitor's address"
        (here,) = [i for i, p in enumerate(programs) if f"{ROBOT} is connected" in p.text()]
        programs[here].kill()
        began = time.monotonic()
        pair.client.wait_for(r": connected to (.|\n)*: connected to ")
        print(f"by the other relay after {time.monotonic() - began:.1f} s")
        publisher.publish(Blob(sequence=7))
        until(lambda: any(m.sequence == 7 for m in collector.messages), "a message by the other")
        haproxy.wait_for(rf"relays/relay{here + 1} is DOWN")
        programs[here].start().wait_for("listens on port")
        haproxy.wait_for(rf"relays/relay{here + 1} is UP")
        pair.client.stop()
        pair.client.start().wait_linked()
        assert f"{ROBOT} is connected" not in programs[here].text()
    finally:
        haproxy.kill()
        for program in programs:
            program.kill()
