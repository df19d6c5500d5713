"""Every kind of secret that a side can be given is looked for wherever others can read."""

import http.client
import json
import os
import pathlib
import re
import ssl
import subprocess
import time

import pytest
from rclpy.parameter_client import AsyncParameterClient

from graph import WAIT, until
from harness.domains import free_port
from harness.programs import build_dir
from test_login_methods import SECRET, HttpsServer, base64url, jwt, plugin_in, write

TOKEN = "correct-horse-battery-staple"
QUERY = "a-key-in-a-query"
PROXY_LOGIN = "anna:the-password-of-a-proxy"
ASK_AGAIN = WAIT / 4  # seconds


def argument(key, value):
    return {"arguments": ("--ros-args", "-p", f"{key}:={value}")}


def key_lines(file):
    """The lines of a PEM file that are the key."""
    return [line for line in file.read_text().splitlines() if len(line) > 20 and "-" not in line]


class Case:
    """What both sides are given, the secrets in it, and what is seen before the search."""

    def __init__(self, folder, authority):
        self.folder, self.authority, self.port = folder, authority, free_port()
        self.server = {
            "listen": {"port": self.port},
            "audit": {"file": str(folder / "audit.jsonl")},
        }
        self.client = {"url": f"ws://127.0.0.1:{self.port}/?key={QUERY}"}
        self.more = {"server": {}, "client": {}}
        self.secrets, self.sees = [QUERY], ": connected to "
        self.cleanup = lambda: None

    def home(self, sides):
        """Where secrets may be."""
        given = self.folder / "given"
        return [*given.rglob("*"), *self.authority.glob("*.key"),
                *(side.parameters_file for side in sides.values())]

    def given(self, name, text):
        """A file that is allowed to contain secrets."""
        (self.folder / "given").mkdir(exist_ok=True)
        return write(self.folder / "given" / name, text)

    def jwt(self):
        """With TLS, a client that has a certificate of its own, and files below this folder."""
        key = {"kty": "oct", "kid": "1", "k": base64url(SECRET)}
        self.server["auth"] = {
            "method": "jwt",
            "jwt_keys": os.path.relpath(self.given("keys.json", json.dumps({"keys": [key]}))),
            "jwt_issuer": "tests",
            "jwt_audience": "robot",
        }
        own = {"certificate": "server.pem", "private_key": "server.key"}
        tls = {name: str(self.authority / file) for name, file in own.items()}
        self.server["tls"] = tls
        token = jwt(60)
        self.client = {
            "url": f"wss://localhost:{self.port}/?key={QUERY}",
            "tls": {"ca": str(self.authority / "ca.pem"), **tls},
            "auth": {"method": "jwt"},
        }
        self.more["client"] = argument(
            "auth.token_file", os.path.relpath(self.given("anna.jwt", token))
        )
        self.secrets += [token, SECRET.decode(), base64url(SECRET)]
        self.secrets += key_lines(self.authority / "server.key")

    def service(self):
        """A login service whose address has a query, and a token in the arguments."""
        service = HttpsServer(self.authority)
        self.cleanup = service.close
        service.judge = lambda shown: {"identity": "anna"} if shown == TOKEN else None
        self.server["auth"] = {
            "method": "service",
            "service": f"{service.url}?key={QUERY}-of-the-service",
            "https_ca": str(self.authority / "ca.pem"),
        }
        self.client["auth"] = {"method": "service"}
        self.more["client"] = argument("auth.token", TOKEN)
        self.secrets += [TOKEN, f"{QUERY}-of-the-service"]

    def plugin(self):
        """A plugin with options, and a token of the environment."""
        secret = "anna:a-password-of-anna"
        given = self.folder / "given"
        given.mkdir()
        self.server["auth"] = {"method": "plugin", "plugin": plugin_in(given)}
        self.more["server"] = argument("auth.plugin_options", secret)
        self.client["auth"] = {"method": "plugin"}
        self.more["client"] = {"env": {"CONNECT_BRIDGE_TOKEN": secret}}
        self.secrets += [secret, secret.split(":")[1]]

    def refused(self):
        """A wrong token, given in the parameters."""
        self.server["auth"] = {"token": TOKEN}
        self.client["auth"] = {"token": "a-token-of-another-server"}
        self.secrets += [TOKEN, "a-token-of-another-server"]
        self.sees = "login refused"

    def proxy(self):
        """A proxy that is not there, with a login."""
        self.server["auth"] = {"token": TOKEN}
        self.client.update(auth={"token": TOKEN}, http_proxy="http://127.0.0.1:1")
        self.more["client"] = argument("http_proxy_login", PROXY_LOGIN)
        self.secrets += [TOKEN, PROXY_LOGIN, PROXY_LOGIN.split(":")[1]]
        self.sees = "by the proxy 127.0.0.1:1: connection refused"


def of_process(pid):
    """What others see of a process; a core dump has the name of a thread or of the program."""
    folder = pathlib.Path(f"/proc/{pid}")
    files = [folder / "cmdline", folder / "environ", *folder.glob("task/*/comm")]
    seen = {str(file): file.read_bytes().decode("utf-8", "replace") for file in files}
    return {**seen, "exe": str((folder / "exe").readlink())}


def of_parameters(graph, role):
    """What `ros2 param` shows: names, values, descriptions."""
    client = AsyncParameterClient(graph.tester, f"connect_{role}")
    assert client.wait_for_services(WAIT)

    # The middleware drops an answer if the server finds the client too late: then it asks again.
    def answer(ask):
        futures = []

        def answered():
            if not futures or time.monotonic() > futures[-1][0] + ASK_AGAIN:
                futures.append((time.monotonic(), ask()))
            return any(future.done() for _, future in futures)

        until(answered, "an answer of the parameter service")
        return next(future.result() for _, future in futures if future.done())

    hidden = ["auth.token", "auth.plugin_options", "http_proxy_login"]
    names = list(answer(lambda: client.list_parameters([], 0)).result.names)
    got = answer(lambda: client.get_parameters([*names, *hidden]))
    assert len(got.values) >= len(names) > 20
    described = answer(lambda: client.describe_parameters(names))
    return f"{names} {got} {described}"


def of_page(case):
    """The text of a web page of the server."""
    plain = "tls" not in case.server
    context = ssl.create_default_context(cafile=str(case.authority / "ca.pem"))
    page = (
        http.client.HTTPConnection("localhost", case.port, timeout=5)
        if plain
        else http.client.HTTPSConnection("localhost", case.port, timeout=5, context=context)
    )
    page.request("GET", "/")
    answer = page.getresponse()
    return f"{answer.headers} {answer.read()}"


def of_report(folder, sides, case):
    """What `ctl bugreport` gathers of programs that run, with what somebody might have logged."""
    logs = folder / "ros_log"
    logs.mkdir()
    # What is in no file is known to nobody but the program: it would stand beside its name.
    files = [file for file in case.home(sides) if file.is_file()]
    home = "".join(file.read_text(errors="replace") for file in files)
    planted = "\n".join(
        secret if secret in home else f"CONNECT_BRIDGE_TOKEN={secret}"
        for secret in case.secrets
        if secret in home or " " not in secret
    )
    ours, foreign, ended = (logs / f"server_{n}_{n}.log" for n in (1, 2, 3))
    ours.write_text(f"[INFO] [1.2] [connect_server]: a line\n{planted}\nframe_of_others\n"
                    "the last line\n")
    foreign.write_text("[INFO] [1.2] [somebody_else]: of another program\n")
    ended.write_text("[INFO] [1.2] [robot1.connect_server]: of one that has ended\n")
    pipe, shared = logs / "pipe", logs / "shared.yaml"
    os.mkfifo(pipe)
    mine = {"auth": {"token_file": str(pipe)}, "qos_overrides": {"/t": {"history": "the last"}}}
    sections = {"connect_client": mine, "camera": {"frame_id": "frame_of_others"}}
    shared.write_text(json.dumps({node: {"ros__parameters": p} for node, p in sections.items()}))
    report = folder / "report.txt"
    dds = "file:///a.xml,<CycloneDDS><Domain><Security>a-word-of-dds"
    env = {**sides["client"].env, "ROS_LOG_DIR": str(logs), "CYCLONEDDS_URI": dds}
    subprocess.run([build_dir() / "ctl", "bugreport", "--output", report, "--config", shared],
                   env=env, check=True, capture_output=True, timeout=60, cwd="/")
    assert report.stat().st_mode & 0o777 == 0o600
    _, *parts = re.split(r"^==== (.+)\n", report.read_text(), flags=re.MULTILINE)
    found = {f"report/{name}": text for name, text in zip(parts[::2], parts[1::2])}
    report.unlink()
    for file in (ours, foreign, ended, pipe, shared):
        file.unlink()
    assert "frame_of_others\nthe last line" in found["report/logs/server_1_1.log"]
    assert "report/logs/server_2_2.log" not in found
    assert "report/logs/server_3_3.log" in found
    configurations = "".join(text for name, text in found.items() if "/config/" in name)
    for side in sides.values():
        assert str(side.parameters_file) in configurations
        assert f"report/status/{side.node}-{side.pid}.json" in found
    assert "[" in found["report/doctor.txt"] or "nothing is wrong" in found["report/doctor.txt"]
    assert "net/core/rmem_max" in found["report/system.txt"]
    assert "CYCLONEDDS_URI: (set, inline)" in found["report/system.txt"]
    return found


@pytest.mark.parametrize("kind", ["jwt", "service", "plugin", "refused", "proxy"])
def test_no_secret_is_anywhere(kind, tmp_path, authority, domains, make_side, make_graph):
    case = Case(tmp_path, authority)
    getattr(case, kind)()
    sides, graphs = {}, {}
    for role, domain in zip(("server", "client"), domains(2)):
        parameters = getattr(case, role)
        sides[role] = make_side(role, domain, parameters, **case.more[role]).start()
        graphs[role] = make_graph(domain)
        if role == "server":
            sides[role].wait_listening()
    try:
        sides["client"].wait_for(re.compile(case.sees))
        places = {"page": of_page(case)}
        for role, side in sides.items():
            until(side.status, "a status")
            places[f"parameters of the {role}"] = of_parameters(graphs[role], role)
            places.update(of_process(side.pid))
        places.update(of_report(tmp_path, sides, case))
        for side in sides.values():
            assert side.stop() == 0
    finally:
        case.cleanup()
    home = [case.folder / "given", *(side.parameters_file for side in sides.values())]
    for file in tmp_path.rglob("*"):
        if file.is_file() and not any(file.is_relative_to(one) for one in home):
            places[file.name] = file.read_text(encoding="utf-8")
    written = {"server.log", "client.log", "server.status.json", "audit.jsonl"}
    assert written <= set(places)
    for place, text in places.items():
        for secret in case.secrets:
            assert secret not in text, f"{secret} in {place}"
