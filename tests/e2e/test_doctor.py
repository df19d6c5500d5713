"""`ctl doctor`: faults of the link and of a running pair that are injected, and recognised.

Those of files and of a status are values in tests/unit/ops/doctor/diagnosis_test.cpp."""

import contextlib
import json
import os
import pathlib
import signal
import socket
import ssl
import subprocess
import tempfile
import threading
import time

import pytest
from geometry_msgs.msg import PointStamped, Twist, TwistStamped
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import String
from std_srvs.srv import SetBool

from calls import Caller, EchoServer
from graph import until
from harness.domains import free_port
from harness.programs import build_dir, ros_parameters, uses_rmw

TOKEN = "token-of-the-doctor-0123456789"


def doctor(*words, env=None):
    made = subprocess.run(
        [str(build_dir() / "ctl"), "doctor", "--json", *map(str, words)],
        capture_output=True,
        text=True,
        timeout=60,
        env=env,
        check=False,
    )
    assert made.returncode in (0, 1), made.stderr
    found = json.loads(made.stdout)["findings"]
    assert (made.returncode == 1) == any(not one["hint"] for one in found)
    for one in found:
        assert one["cause"] and one["cure"]
    return found


def ids(*words, env=None):
    return {one["id"] for one in doctor(*words, env=env)}


class Fake:
    """Something that listens in place of the server, and gives every connection to `answer`."""

    def __init__(self, answer, context=None, at=None):
        self.answer, self.context = answer, context
        if at:
            self.socket = socket.socket(socket.AF_UNIX)
            self.socket.bind(str(at))
            self.socket.listen()
        else:
            self.socket = socket.create_server(("127.0.0.1", 0))
        self.port = None if at else self.socket.getsockname()[1]
        threading.Thread(target=self.serve, daemon=True).start()

    def serve(self):
        with contextlib.suppress(OSError):
            while True:
                connection, _ = self.socket.accept()
                threading.Thread(target=self.serve_one, args=(connection,), daemon=True).start()

    def serve_one(self, connection):
        with contextlib.suppress(OSError, ssl.SSLError):
            connection.settimeout(20)
            if self.context:
                connection = self.context.wrap_socket(connection, server_side=True)
            self.answer(connection)
            connection.close()

    def close(self):
        self.socket.shutdown(socket.SHUT_RDWR)
        self.socket.close()


@pytest.fixture
def fake():
    made = []

    def make(answer, context=None, at=None):
        made.append(Fake(answer, context, at))
        return made[-1].port

    yield make
    for one in made:
        one.close()


def http(status, body="", headers=""):
    """Answers each request with this."""

    def answer(connection):
        connection.recv(4096)
        page = body.encode()
        head = f"HTTP/1.1 {status}\r\nContent-Length: {len(page)}\r\n{headers}\r\n"
        connection.sendall(head.encode() + page)
        connection.recv(4096)

    return answer


# ---- the way to the server


def test_nobody_is_there():
    assert ids(f"ws://127.0.0.1:{free_port()}") == {"port_closed"}
    assert ids("wss://robot.invalid:9090") == {"host_unknown"}


@pytest.mark.parametrize(
    ["answer", "finding"],
    [
        (http("404 Not Found"), "path_wrong"),
        (http("502 Bad Gateway"), "proxy_without_server"),
        (http("400 Bad Request"), "proxy_without_upgrade"),
        (http("426 Upgrade Required"), "proxy_without_upgrade"),
        (http("426 Upgrade Required", headers="Upgrade: TLS/1.0\r\n"), "plain_to_tls_port"),
        (http("401 Unauthorized"), "http_login"),
        (http("403 Forbidden"), "http_login"),
        (http("503 Service Unavailable", headers="Server: nginx\r\n"), "proxy_without_server"),
        (http("302 Found", headers="Location: http://portal/\r\n"), "captive_portal"),
        (http("200 OK", "<html>Welcome to our hotel</html>"), "captive_portal"),
        (http("511 Network Authentication Required"), "captive_portal"),
        (lambda connection: connection.sendall(b"SSH-2.0-OpenSSH_9.2\r\n"), "not_this_program"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_answers_is_another_program(fake, answer, finding):
    assert ids(f"ws://127.0.0.1:{fake(answer)}") == {finding}


def test_a_server_that_says_nothing(fake):
    waits = threading.Event()
    assert ids(f"ws://127.0.0.1:{fake(lambda _: waits.wait(30))}") == {"server_silent"}
    waits.set()


def test_tls_and_plain_are_mixed_up(fake, authority):
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(authority / "server.pem", authority / "server.key")
    secure = fake(http("200 OK"), context)
    mixed = ids(f"ws://localhost:{secure}")
    assert mixed and mixed <= {"plain_to_tls_port", "not_this_program", "server_silent"}
    plain = fake(http("400 Bad Request"))
    assert ids(f"wss://localhost:{plain}") == {"tls_to_plain_port"}


def signed(authority, folder, *dates):
    """A context with a certificate for localhost that is valid between these dates."""
    (folder / "ca.cnf").write_text(
        "[ca]\ndefault_ca=x\n[x]\ndatabase=index\nnew_certs_dir=.\nserial=serial\n"
        "default_md=sha256\npolicy=p\nx509_extensions=e\nunique_subject=no\n"
        "[p]\ncommonName=supplied\n[e]\nsubjectAltName=DNS:localhost\n",
        encoding="ascii",
    )
    (folder / "index").write_text("", encoding="ascii")
    (folder / "serial").write_text("01\n", encoding="ascii")
    certificate = folder / "dated.pem"
    words = ["openssl", "ca", "-batch", "-notext", "-config", "ca.cnf"]
    words += ["-cert", authority / "ca.pem", "-keyfile", authority / "ca.key"]
    words += ["-in", authority / "server.csr", "-out", certificate]
    words += ["-startdate", dates[0], "-enddate", dates[1]]
    subprocess.run(list(map(str, words)), cwd=folder, check=True, capture_output=True)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate, authority / "server.key")
    return context


@pytest.mark.parametrize(
    ["dates", "finding"],
    [
        (("20200101000000Z", "20200201000000Z"), "certificate_expired"),
        (("20900101000000Z", "20910101000000Z"), "clock_or_certificate_early"),
    ],
)
def test_certificates_out_of_their_time(fake, authority, tmp_path, dates, finding):
    port = fake(http("200 OK"), signed(authority, tmp_path, *dates))
    assert ids(f"wss://localhost:{port}", "--ca", authority / "ca.pem") == {finding}


def test_a_relays_own_certificate(authority, tmp_path):
    """A relay starts with one that has ended, robots refuse it, and it is not in order."""
    signed(authority, tmp_path, "20200101000000Z", "20200201000000Z")
    robots, file = tmp_path / "robots.yaml", tmp_path / "relay.yaml"
    subprocess.run([build_dir() / "ctl", "token", "robot7", "--file", robots], check=True,
                   capture_output=True)
    file.write_text(f"listen: {{address: 127.0.0.1, port: {free_port()}}}\n"
                    f"auth: {{token_file: {robots}}}\n"
                    f"tls: {{certificate: {tmp_path}/dated.pem,"
                    f" private_key: {authority}/server.key}}\n")
    checked = subprocess.run(
        [build_dir() / "relay", "--check", file], capture_output=True, text=True)
    assert checked.returncode == 2 and " ended " in checked.stderr, checked.stderr
    (found,) = doctor(str(file))
    assert found["id"] == "yaml_wrong" and "`relay --check FILE`" in found["detail"]


def test_certificates_of_others(fake, authority):
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(authority / "server.pem", authority / "server.key")
    port = fake(http("200 OK"), context)
    url = f"wss://localhost:{port}"
    assert ids(url, "--ca", authority / "other.pem") == {"certificate_foreign"}
    assert ids(f"wss://127.0.0.1:{port}", "--ca", authority / "ca.pem") == {"certificate_name"}
    pin = "A" * 43 + "="
    assert ids(url, "--pin", pin) == {"certificate_pin"}


def parameters(folder, values):
    file = folder / "client.yaml"
    file.write_text(ros_parameters("connect_client", values), encoding="ascii")
    return file


def test_the_http_proxy_of_a_client_s_file(fake, tmp_path):
    for answer, finding in [
        (http("407 Proxy Authentication Required"), "proxy_login"),
        (http("403 Forbidden"), "proxy_refuses"),
    ]:
        file = parameters(
            tmp_path,
            {
                "url": "wss://robot.example:9090",
                "auth": {"token": TOKEN},
                "http_proxy": f"http://127.0.0.1:{fake(answer)}",
                "rules": ["a"],
                "rule": {"a": {"import_topics": ["/t"]}},
            },
        )
        assert finding in ids(file)
        assert ids(file, "--offline") <= {"file_distrusted"}


def test_the_list_has_all_of_them():
    made = subprocess.run(
        [str(build_dir() / "ctl"), "doctor", "--list"], capture_output=True, text=True, check=True
    )
    assert made.stdout.count("\n| `") > 60


# ---- a running pair

RULES = {
    "server": {
        "rules": ["drive", "points", "look"],
        "rule": {
            "drive": {"import_topics": ["/cmd_vel"], "types": ["geometry_msgs/msg/Twist"]},
            "points": {"import_topics": ["/point"]},
            "look": {
                "export_topics": ["/t/**"],
                "export_services": ["/s/**"],
                "deny": ["/t/secret"],
            },
        },
    },
    "client": {
        "rules": ["all"],
        "rule": {
            "all": {
                "import_topics": ["/**"],
                "import_services": ["/**"],
                "export_topics": ["/cmd_vel", "/point"],
            }
        },
    },
}


@pytest.fixture
def pair(make_pair):
    # The path of a socket is short: pytest's folders may be too long.
    with tempfile.TemporaryDirectory(prefix="cb") as runtime:
        env = {"XDG_RUNTIME_DIR": runtime}
        made = make_pair(server=RULES["server"], client=RULES["client"], env=env)
        made.runtime = runtime
        yield made


def side_ids(pair, name, **more):
    """Findings of a running side, as (id, subject)."""
    (where,) = pathlib.Path(pair.runtime).glob(f"connect_bridge/connect_{name}-*.status")
    env = {**pair.server.env, "ROS_DOMAIN_ID": getattr(pair, name).env["ROS_DOMAIN_ID"], **more}
    return {(one["id"], one["subject"]) for one in doctor(where, env=env)}


def test_what_does_not_cross_is_found_at_the_side_that_wants_it(pair):
    pair.operator.publisher(TwistStamped, "/cmd_vel")
    pair.operator.collector(String, "/t/secret")
    pair.operator.collector(String, "/t/nobody")
    pair.robot.collector(Twist, "/cmd_vel")
    pair.robot.collector(String, "/robot/own")
    wanted = {
        ("not_given", "/t/secret"),
        ("not_there", "/t/nobody"),
    }
    until(lambda: wanted <= side_ids(pair, "client"), "the findings", timeout=40)
    client = side_ids(pair, "client")
    assert client & {("not_taken", "/cmd_vel"), ("other_type", "/cmd_vel")}
    server = side_ids(pair, "server")
    assert ("no_rule", "/robot/own") in server
    assert " not forwarded to " in pair.client.text()


@pytest.mark.skipif(uses_rmw("rmw_zenoh_cpp"), reason="rmw_zenoh_cpp joins any QoS")
def test_what_only_the_other_end_sees_is_found_at_both(pair):
    """The robot has a node that wants a reliable publisher, and the operator has none."""
    pair.operator.publisher(PointStamped, "/point", qos_profile_sensor_data)
    pair.robot.collector(PointStamped, "/point")
    wanted = ("qos", "/point")
    until(lambda: wanted in side_ids(pair, "server"), "the robot's finding", timeout=40)
    until(lambda: wanted in side_ids(pair, "client"), "the same at the operator", timeout=40)


def test_a_node_at_both_ends_publishes(pair):
    publishers = [side.publisher(PointStamped, "/point") for side in (pair.operator, pair.robot)]
    pair.robot.collector(PointStamped, "/point")

    def found():
        for one in publishers:
            one.publish(PointStamped())
        return ("published_here_too", "/point") in side_ids(pair, "server")

    until(found, "the second publisher", timeout=40)


def test_a_service_that_is_called_by_another_type(pair, make_graph):
    """Its mirror has the name: the caller waits for a server that never comes."""
    EchoServer(pair.robot, "/s/echo")
    Caller(pair.operator, "/s/echo").wait_ready()
    Caller(make_graph(pair.operator.domain), "/s/echo", SetBool)
    wanted = ("other_type", "/s/echo")
    until(lambda: wanted in side_ids(pair, "client"), "the finding", timeout=40)


def test_a_port_of_the_status_that_is_taken(tmp_path, fake):
    port = fake(http("404 Not Found"))
    status = {"status": {"listen": f"127.0.0.1:{port}"}}
    rules = {"rules": ["a"], "rule": {"a": {"export_topics": ["/t"]}}}
    client = {"url": "wss://robot", "auth": {"token": TOKEN}}
    file = parameters(tmp_path, {**client, **rules, **status})
    assert "port_taken" in ids(file, "--offline")


def test_a_shell_in_another_domain(pair):
    found = side_ids(pair, "server", ROS_DOMAIN_ID="231")
    assert ("domain_differs", "ROS_DOMAIN_ID") in found
    found = side_ids(pair, "server", ROS_AUTOMATIC_DISCOVERY_RANGE="OFF")
    assert ("discovery_range", "ROS_AUTOMATIC_DISCOVERY_RANGE") in found


def test_the_login(pair, tmp_path):
    url = f"ws://127.0.0.1:{pair.bridge.port}"

    def wrong_logins():
        return pair.server.status()["strangers"]["wrong_logins"]

    assert ids(url) == {"login_not_tried"}
    file = tmp_path / "a.token"
    file.write_text("", encoding="ascii")
    file.chmod(0o600)
    assert ids(url, "--token-file", file) == {"token_missing"}
    time.sleep(2)  # the status is of a second before
    assert wrong_logins() == 0
    file.write_text("another-token-than-theirs-0123", encoding="ascii")
    assert ids(url, "--token-file", file) == {"login_refused"}
    variable = {**os.environ, "CONNECT_BRIDGE_TOKEN": "another-token-than-theirs-0123"}
    assert ids(url, env=variable) == {"login_refused"}
    until(lambda: wrong_logins() == 2, "the wrong logins in the status", timeout=20)


def test_a_server_that_is_stopped(pair):
    (server,) = pathlib.Path(pair.runtime).glob("connect_bridge/connect_server-*.status")
    process = int(server.stem.rsplit("-", 1)[1])
    os.kill(process, signal.SIGSTOP)
    try:
        env = {**pair.server.env, "XDG_RUNTIME_DIR": pair.runtime}
        found = doctor(f"ws://127.0.0.1:{pair.bridge.port}", env=env)
    finally:
        os.kill(process, signal.SIGCONT)
    assert {(one["id"], one["subject"]) for one in found} >= {
        ("server_silent", f"ws://127.0.0.1:{pair.bridge.port}"),
        ("program_silent", f"process {process}"),
    }


def test_a_server_on_the_loopback(pair):
    pair.client.stop()
    until(lambda: ("loopback_alone", "") in side_ids(pair, "server"), "the finding", timeout=20)


def test_a_proxy_of_the_environment():
    dead = f"http://127.0.0.1:{free_port()}"
    (found,) = doctor("wss://robot.example:9090", env={**os.environ, "https_proxy": dead})
    assert found["id"] == "proxy_unreachable"
    assert "(https_proxy of the environment)" in found["detail"]


def test_nobody_runs(tmp_path, fake):
    env = {**os.environ, "XDG_RUNTIME_DIR": str(tmp_path)}
    env.pop("RUNTIME_DIRECTORY", None)
    nobody = {"nobody_runs", "no_bbr", "shared_memory_small"}
    found = ids(env=env)
    assert found <= nobody and "nobody_runs" in found
    # A relay is a program, too.
    with tempfile.TemporaryDirectory(prefix="cb") as runtime:
        folder = pathlib.Path(runtime) / "connect_bridge"
        folder.mkdir(0o700)
        answer = http("200 OK", json.dumps({"role": "relay", "robots": []}))
        fake(answer, at=folder / f"relay-{os.getpid()}.status")
        assert ids(env={**env, "XDG_RUNTIME_DIR": runtime}) == found - {"nobody_runs"}
