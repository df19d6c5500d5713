"""The status by HTTP: what it says, to whom; in Prometheus, in a browser, with ctl.

What needs promtool or chromium is skipped where these are not there: they are too large for the
packages of CI (Debian: prometheus, chromium)."""

import http.client
import json
import pathlib
import shutil
import socket
import ssl
import subprocess
import tempfile
import urllib.error
import urllib.request

import pytest
from std_msgs.msg import String

from browser import CHROMIUM, Browser
from graph import until
from harness.domains import free_port
from harness.programs import build_dir
from tokens import entry, write_tokens

TOKEN, OTHER = "token-of-anna-0123456789", "token-of-bert-0123456789"
ANNA_AND_BERT = (entry("anna", TOKEN), entry("bert", OTHER, ["x"]))
PROMTOOL = shutil.which("promtool")


class OfFile(http.client.HTTPConnection):
    """HTTP at a socket in the file system."""

    def __init__(self, file):
        super().__init__("localhost", timeout=10)
        self.file = str(file)

    def connect(self):
        self.sock = socket.socket(socket.AF_UNIX)
        self.sock.settimeout(10)
        self.sock.connect(self.file)


@pytest.fixture
def world(make_pair, tmp_path):
    """A linked pair whose server is looked at, on loopback and in a runtime folder."""
    # The path of a socket is short: pytest's folders may be too long.
    with tempfile.TemporaryDirectory(prefix="cb") as runtime:
        port = free_port()
        server = {
            "auth": {"token_file": write_tokens(tmp_path / "tokens.yaml", *ANNA_AND_BERT)},
            "status": {"listen": f"127.0.0.1:{port}"},
            "rules": ["all"],
            "rule": {"all": {"export_topics": ["/t/**"], "import_topics": ["/o/**"]}},
        }
        client = {
            "auth": {"token": TOKEN},
            "rules": ["all"],
            "rule": {"all": {"import_topics": ["/t/**"], "export_topics": ["/o/**"]}},
        }
        pair = make_pair(server=server, client=client, env={"XDG_RUNTIME_DIR": runtime})
        pair.http, pair.runtime = f"http://localhost:{port}", runtime
        yield pair


def get(url, context=None, **headers):
    headers = {name.replace("_", "-"): value for name, value in headers.items()}
    request = urllib.request.Request(url, headers=headers)
    return urllib.request.urlopen(request, timeout=10, context=context)


def refused(url, context=None, **headers):
    with pytest.raises(urllib.error.HTTPError) as error:
        get(url, context, **headers)
    return error.value.code


def text(url, **headers):
    with get(url, **headers) as answer:
        return answer.read().decode()


def socket_of(world, name):
    (found,) = pathlib.Path(world.runtime).glob(f"connect_bridge/{name}-*.status")
    return found


def ctl(world, *words):
    return subprocess.run(
        [build_dir() / "ctl", "status", *words],
        env={**world.server.env, "XDG_RUNTIME_DIR": world.runtime},
        capture_output=True,
        text=True,
        timeout=20,
        check=False,
    )


def flows(world, topic):
    publisher, collector = world.opened(String, topic, String(data="first"))
    for i in range(20):
        publisher.publish(String(data=str(i)))
    collector.wait(10)
    return publisher


def test_who_sees_what(world, topic):
    flows(world, topic)
    assert text(world.http + "/healthz") == "alive\n"
    assert text(world.http + "/readyz") == "ready\n"

    def with_topic():  # a picture may be as old as a second
        status = json.loads(text(world.http + "/api/status"))
        assert status["schema"] == 1
        return [k for k in status["links"] if topic in [t["topic"] for t in k["topics"]]]

    until(with_topic, "the topic in the status")
    (link,) = with_topic()
    assert link["node"] == "/connect_client" and link["open"]
    assert link["identity"] == ""  # every user of this machine may look
    asked = OfFile(socket_of(world, "connect_server"))
    asked.request("GET", "/api/status")
    assert json.loads(asked.getresponse().read())["links"][0]["identity"] == "anna"
    assert refused(world.http + "/api/status", Host="evil.example") == 421
    assert refused(world.http + "/nothing") == 404
    client = OfFile(socket_of(world, "connect_client"))
    client.request("GET", "/readyz")
    assert client.getresponse().status == 200
    world.server.stop()
    until(lambda: not world.client.links(), "the client has lost its link")
    client = OfFile(socket_of(world, "connect_client"))
    client.request("GET", "/readyz")
    answer = client.getresponse()
    assert answer.status == 503 and b"no link" in answer.read()
    assert not list(pathlib.Path(world.runtime).glob("connect_bridge/connect_server-*"))


def test_metrics(world, topic):
    flows(world, topic)
    series = f'connect_bridge_topic_messages_total{{direction="export",topic="{topic}"}}'
    until(lambda: series in text(world.http + "/metrics"), series)
    with get(world.http + "/metrics", Accept="application/openmetrics-text") as answer:
        assert answer.headers["Content-Type"].startswith("application/openmetrics-text")
        metrics = answer.read().decode()
    assert metrics.endswith("# EOF\n")
    assert series in metrics and "anna" not in metrics and "127.0.0.1" not in metrics


@pytest.mark.skipif(not PROMTOOL, reason="no promtool")
def test_promtool_finds_nothing_wrong(world, topic):
    flows(world, topic)
    metrics = text(world.http + "/metrics")
    checked = subprocess.run(
        [PROMTOOL, "check", "metrics"], input=metrics, text=True, capture_output=True, check=False
    )
    assert (checked.returncode, checked.stdout + checked.stderr) == (0, "")


def test_events(world):
    with get(world.http + "/api/events") as stream:
        assert stream.headers["Content-Type"] == "text/event-stream"
        for _ in range(2):
            line = stream.readline()
            assert line.startswith(b"data: ")
            assert json.loads(line[6:])["node"] == "/connect_server"
            assert stream.readline() == b"\n"


def test_beyond_loopback(make_side, domains, authority, tmp_path):
    tokens = tmp_path / "tokens.yaml"
    port = free_port()
    server = make_side(
        "server",
        domains(1)[0],
        {
            "listen": {"port": free_port()},
            "auth": {"token_file": write_tokens(tokens, *ANNA_AND_BERT)},
            "tls": {
                "certificate": str(authority / "server.pem"),
                "private_key": str(authority / "server.key"),
            },
            "status": {"listen": f"0.0.0.0:{port}", "groups": ["ops"]},
            "strict_modes": False,
        },
    )
    server.start().wait_listening()
    trust = ssl.create_default_context(cafile=str(authority / "ca.pem"))
    url = f"https://localhost:{port}/api/status"
    assert refused(url, trust) == 401
    assert refused(url, trust, Authorization="Bearer token-of-nobody-0123456789") == 401
    assert refused(url, trust, Authorization=f"Bearer {OTHER}") == 403
    with get(url, trust, Authorization=f"Bearer {TOKEN}") as answer:
        assert json.load(answer)["node"] == "/connect_server"
    assert refused(url, trust, Authorization=f"Bearer {TOKEN}", Host="evil.example") == 421
    write_tokens(tokens, ANNA_AND_BERT[1])  # anna's is withdrawn
    until(lambda: _status(url, trust) == 401, "the token is withdrawn", step=0.5)


def _status(url, trust):
    try:
        get(url, trust, Authorization=f"Bearer {TOKEN}").close()
        return 200
    except urllib.error.HTTPError as error:
        return error.code


ROWS = """[...document.querySelectorAll('#topics tbody tr:not(.detail)')]
    .map(row => [...row.cells].map(cell => cell.textContent))"""


BUTTONS = "[...document.querySelectorAll('#topics td.name button')]"


def test_ctl(world, topic):
    publisher = flows(world, topic)
    several = ctl(world)
    assert several.returncode == 0, several.stderr
    assert "/connect_server (server)  1 link open" in several.stdout
    assert "/connect_client (client)  1 link open" in several.stdout
    assert "anna" in several.stdout and topic in several.stdout
    publisher.publish(String(data="one more"))
    asked = json.loads(ctl(world, "--json", str(socket_of(world, "connect_client"))).stdout)
    assert asked["node"] == "/connect_client" and asked["schema"] == 1
    by_address = ctl(world, world.http.removeprefix("http://"))
    assert topic in by_address.stdout and "anna" not in by_address.stdout
    assert ctl(world, "--json").returncode == 2  # of which?
    assert ctl(world, f"127.0.0.1:{free_port()}").returncode == 1
    assert ctl(world, "nowhere").returncode == 2
    world.client.kill()  # what it leaves is removed
    assert "/connect_client (client)" not in ctl(world).stdout
    assert socket_of(world, "connect_server").exists()
    assert not list(pathlib.Path(world.runtime).glob("connect_bridge/connect_client-*"))
    world.client.start().wait_linked()


@pytest.mark.skipif(not CHROMIUM, reason="no chromium")
def test_the_page_shows_what_the_json_says(world, topic, tmp_path):
    publisher = flows(world, topic)
    page = Browser(world.http + "/")
    try:
        until(lambda: topic in str(page.value(ROWS)), "the topic is on the page", step=0.2)
        (shown,) = [row for row in page.value(ROWS) if row[0] == topic]
        status = json.loads(text(world.http + "/api/status"))
        (link,) = status["links"]
        (said,) = [t for t in link["topics"] if t["topic"] == topic]
        assert shown[1:3] == [str(link["link"]), said["direction"]]
        assert said["state"] == "flows" and shown[8:] == ["flows"]
        page.value(f"{BUTTONS}.find(button => button.textContent === '{topic}').click()")
        detail = page.value("document.querySelector('#topics .detail').innerText")
        assert all(said[name] in detail for name in ("type", "rule", "keep", "keep_because"))
        whole = page.value("document.body.innerText")
        assert page.value("document.documentElement.scrollWidth") <= 1280
        assert link["node"] in whole and link["peer"] in whole and "1 link open" in whole
        for _ in range(40):
            publisher.publish(String(data="rate"))
        until(lambda: any(row[3] not in ("", "0") for row in page.value(ROWS)), "a rate", step=0.2)
        # The keyboard: / leads to the filter, which is text as all else.
        page.press("/")
        page.type("<img src=x onerror=alert(1)>")
        until(lambda: page.value(ROWS) == [], "nothing fits the filter", step=0.2)
        assert page.complaints() == []
        assert all(url.startswith(world.http + "/") for url in page.requests())
    finally:
        page.close()
    phone = Browser(world.http + "/", width=400, height=800, dark=True)
    try:
        until(lambda: topic in str(phone.value(ROWS)), "the topic is on the page", step=0.2)
        assert phone.value("document.documentElement.scrollWidth") <= 400
    finally:
        phone.close()


@pytest.mark.skipif(not CHROMIUM, reason="no chromium")
def test_the_page_shows_trouble(world, topic):
    """What a pair on one machine has no cause for: the script gets a status of its own."""
    flows(world, topic)

    def shows_it():
        links = json.loads(text(world.http + "/api/status"))["links"]
        return links and any(t["topic"] == topic for t in links[0]["topics"])

    until(shows_it, "the status has the topic", step=0.2)
    status = json.loads(text(world.http + "/api/status"))
    (link,) = status["links"]
    link["topics"] = [t for t in link["topics"] if t["topic"] == topic]
    shown = link["topics"][0]
    shown.update(published=0, messages=0, wire_bytes=0, dropped={})
    for part in ("send_goal", "cancel_goal", "get_result"):
        one = {"service": f"/dock/_action/{part}", "type": "p/action/D", "direction": "export"}
        counts = dict.fromkeys(("pending", "waiting", "calls", "answered", "duplicates"), 1)
        link["services"].append({**one, "state": "ready", **counts})
    link["missing"] = [
        {
            "kind": "topic",
            "name": "/chatter",
            "type": "std_msgs/msg/String",
            "direction": "export",
            "reason": "no_rule",
            "text": "no rule here allows it",
        }
    ]
    for part in ("get_parameters", "set_parameters"):
        one = {"kind": "service", "name": f"/arm/{part}", "type": "p/srv/S", "direction": "import"}
        link["missing"].append({**one, "reason": "no_rule", "text": "no rule here allows it"})
    robots = {"kind": "topic", "name": "/robot7/odom", "type": "p/msg/M", "direction": "import"}
    link["missing"].append({**robots, "reason": "not_given", "text": "the peer's rules do not"})
    status["prefix"] = "/robot7"
    link["topics"] += [
        {**shown, "topic": "/camera", "state": "flows"},
        {**shown, "topic": "/cmd_vel", "direction": "import", "state": "flows", "wheel": "taken"},
    ]
    link["wheel"] = "taken"
    status["time"] = "2026-01-31T12:00:00.000Z"
    later = json.loads(json.dumps(status))
    (link,) = later["links"]
    link["topics"][0].update(
        state="overloaded", published=10, messages=1, dropped={"newer_available": 9}
    )
    link["topics"][1].update(published=10, messages=4, dropped={"newer_available": 6})
    link["same_graph"] = True
    link["peer_findings"] = [{"id": "stamps_old", "name": "/cmd_vel"}]
    link["breaks"] = [
        {"lost": "2026-01-31T11:00:00.000Z", "back": "2026-01-31T11:00:04.000Z", "seconds": 4.0}
    ]
    link["breaks"][0]["code"] = "connection_lost"  # loopback has no reason
    lost = {**link, "link": 99, "open": False, "state": "lost", "topics": [], "services": []}
    later["links"].append({**lost, "missing": [], "clock": None})
    later["audit"] = {"lines": 1, "left_out": 1, "problem": "No space left on device"}
    later["refused_parameters"] = {"time": later["time"], "problem": "rule.a: unknown"}
    later["relays"] = [{"relay": "wss://r@relay", "connected": False, "last_failure": "no answer"}]
    later["needs_restart"] = ["prefix"]
    later["time"] = "2026-01-31T12:00:01.000Z"
    page = Browser(world.http + "/")
    try:
        until(lambda: topic in str(page.value(ROWS)), "the topic is on the page", step=0.2)
        take = f"take({json.dumps(status)}); take({json.dumps(later)});"
        heads = "[...document.querySelectorAll('#topics th')].map(h => h.getBoundingClientRect().x)"
        page.value(f"take({json.dumps(status)})")
        places = page.value(heads)
        rows, whole, services, gaps = page.value(
            f"""{take} [{ROWS}, document.body.innerText,
            [...document.querySelectorAll('#services td.name')].map(cell => cell.textContent),
            document.querySelectorAll('.link')[1].querySelectorAll('polyline').length]"""
        )
        (row,) = [row for row in rows if row[0] == topic]
        assert row[3] == "1.0 of 10" and row[7:] == ["9 replaced by newer", "overloaded"]
        assert "the other end reports /cmd_vel stamps old" in whole
        assert services.count("/dock (action)") == 1 and not any("_action" in s for s in services)
        assert gaps == 0
        states = {row[0]: row[-1] for row in rows}
        assert states["/camera"] == "flows in part"
        assert states["/cmd_vel"] == "another operator drives"
        later["links"].pop()
        page.value(f"take({json.dumps({**later, 'time': '2026-01-31T12:00:02.000Z'})})")
        assert page.value(heads) == places  # the columns stay where they are
        for said in (
            f"fewer messages are forwarded than published on {topic}",
            "No space left on device",
            "rule.a: unknown",
            "No connection to the relay wss://r@relay: no answer",
            "1 link open, 1 lost",
            "for 4 s: connection lost",
            "both sides are in one ROS graph",
            "needs a restart: prefix",
            "another operator drives",
            "rule.NAME.import_parameters: [/arm]",
            "at the peer: rule.NAME.export_topics: [/odom]",
            "rule.NAME.export_topics: [/chatter]",
        ):
            assert said in whole, said
        assert page.complaints() == []
    finally:
        page.close()
