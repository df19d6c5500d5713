"""Login by JSON Web Tokens and by a plugin."""

import base64
import hashlib
import hmac
import http.server
import json
import shutil
import ssl
import subprocess
import threading
import time

import pytest
from std_msgs.msg import String

from graph import connect, until
from harness.domains import free_port
from harness.programs import build_dir
from tokens import write

SECRET = b"a secret of thirty-two bytes or more"
MAY_SEE = {"export_topics": ["/t/**"], "groups": ["ops", "plugin"]}
RULES = {"rules": ["see"], "rule": {"see": MAY_SEE}}
PLUGIN = build_dir() / "plugins" / "auth_plugin.so"


def plugin_in(folder):
    """The test's own copy: the folder of the build may belong to somebody else (strict_modes)."""
    return shutil.copy(PLUGIN, folder)


def base64url(data):
    return base64.urlsafe_b64encode(data).rstrip(b"=").decode()


def jwt(seconds, secret=SECRET, **more):
    claims = {"iss": "tests", "aud": "robot", "sub": "anna", "groups": ["ops"], **more}
    claims["exp"] = int(time.time()) + seconds
    parts = [base64url(json.dumps(part).encode()) for part in ({"alg": "HS256"}, claims)]
    code = hmac.new(secret, ".".join(parts).encode(), hashlib.sha256).digest()
    return ".".join([*parts, base64url(code)])


@pytest.fixture
def sides(domains, make_side):
    """serve(auth) and dial(name, auth), each with a graph of its own."""
    numbers, port = domains(2), free_port()

    class Sides:
        domains = numbers

        def serve(self, **auth):
            parameters = {"listen": {"port": port}, "auth": auth, **RULES}
            side = make_side("server", numbers[0], parameters)
            side.start().wait_listening()
            return side

        def dial(self, name, **auth):
            parameters = {"url": f"ws://127.0.0.1:{port}", "auth": auth}
            return make_side("client", numbers[1], parameters, name=name).start()

    return Sides()


def serve_jwt(sides, folder):
    key = {"kty": "oct", "kid": "1", "k": base64url(SECRET)}
    return sides.serve(
        method="jwt",
        jwt_keys=write(folder / "keys.json", json.dumps({"keys": [key]})),
        jwt_issuer="tests",
        jwt_audience="robot",
    )


def test_a_jwt_logs_in_is_renewed_and_expires(sides, tmp_path, make_graph):
    server = serve_jwt(sides, tmp_path)
    robot, operator = (make_graph(domain) for domain in sides.domains)
    file = tmp_path / "anna.jwt"
    first, second = jwt(7), jwt(11)
    anna = sides.dial("anna", method="jwt", token_file=write(file, first))
    anna.wait_linked()
    server.wait_for("as anna")
    publisher = robot.publisher(String, "/t/jwt")
    collector = operator.collector(String, "/t/jwt")
    connect(publisher, collector, String(data="in"))
    write(file, second)
    anna.wait_for("renewed the login at .*; the link stays open", 6)
    anna.wait_for("the login of anna has expired", 25)
    assert anna.text().count(": connected to") == 1, "the first one did not end it"
    anna.wait_for("login refused")
    server.wait_for("jwt: it has expired")
    for secret in (first, second, SECRET.decode(), base64url(SECRET)):
        assert secret not in server.text() + anna.text()


def test_a_wrong_jwt_is_refused_and_a_withdrawn_key_ends_links(sides, tmp_path):
    server = serve_jwt(sides, tmp_path)
    forged = sides.dial("forged", method="jwt", token=jwt(60, secret=b"x" * 32))
    forged.wait_for("login refused")
    server.wait_for("jwt: the signature is wrong")
    other = sides.dial("other", method="jwt", token=jwt(60, aud="another robot"))
    other.wait_for("login refused")
    token = sides.dial("token", method="token", token="a-token-that-is-none")
    token.wait_for("login refused")
    anna = sides.dial("anna", method="jwt", token=jwt(60))
    anna.wait_linked()
    another = {"kty": "oct", "kid": "2", "k": base64url(b"y" * 32)}
    write(tmp_path / "keys.json", json.dumps({"keys": [another]}))
    anna.wait_for("the login of anna was withdrawn", 6)


def test_a_plugin_decides(sides, make_graph, tmp_path):
    secret = "anna:a-password-of-anna"
    server = sides.serve(method="plugin", plugin=plugin_in(tmp_path), plugin_options=secret)
    robot, operator = (make_graph(domain) for domain in sides.domains)
    stranger = sides.dial("stranger", method="plugin", token="anna:a-password-of-annx")
    stranger.wait_for("login refused")
    server.wait_for("plugin: wrong name or password")
    anna = sides.dial("anna", method="plugin", token=secret)
    anna.wait_linked()
    server.wait_for("as anna")
    robot.publisher(String, "/t/plugin")
    until(lambda: operator.publishers("/t/plugin"), "what the plugin's group may see")
    assert secret not in server.text() + anna.text()


class HttpsServer:
    """Answers GET with `keys` and POST as `judge` says; TLS by the test's authority."""

    def __init__(self, authority):
        outer = self
        self.keys, self.asked = {"keys": []}, []
        self.judge = lambda credential: None

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                self.answer(200, outer.keys)

            def do_POST(self):
                asked = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
                outer.asked.append(asked)
                identity = outer.judge(asked["credential"])
                self.answer(200 if identity else 403, identity or {})

            def answer(self, status, body):
                text = json.dumps(body).encode()
                self.send_response(status)
                self.send_header("Cache-Control", "max-age=60")
                self.send_header("Content-Length", str(len(text)))
                self.end_headers()
                self.wfile.write(text)

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(authority / "server.pem", authority / "server.key")
        self.server.socket = context.wrap_socket(self.server.socket, server_side=True)
        self.url = f"https://localhost:{self.server.server_port}/auth"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def close(self):
        self.server.shutdown()
        self.server.server_close()


@pytest.fixture
def https(authority):
    server = HttpsServer(authority)
    yield server
    server.close()


def rsa_key(folder):
    """A key, and its half for a JWKS."""
    key = folder / "rsa.pem"
    subprocess.run(["openssl", "genrsa", "-out", key, "2048"], check=True, capture_output=True)
    read = ["openssl", "rsa", "-in", key, "-noout", "-modulus"]
    said = subprocess.run(read, check=True, capture_output=True, text=True).stdout
    modulus = base64url(bytes.fromhex(said.strip().split("=")[1]))
    return key, {"kty": "RSA", "kid": "r", "n": modulus, "e": "AQAB"}


def rs256(key, seconds):
    claims = {"iss": "tests", "aud": "robot", "sub": "anna", "groups": ["ops"]}
    claims["exp"] = int(time.time()) + seconds
    header = {"alg": "RS256", "kid": "r"}
    text = ".".join(base64url(json.dumps(part).encode()) for part in (header, claims))
    sign = ["openssl", "dgst", "-sha256", "-sign", key]
    code = subprocess.run(sign, input=text.encode(), check=True, capture_output=True).stdout
    return f"{text}.{base64url(code)}"


def test_the_keys_of_a_jwt_come_from_an_address(sides, tmp_path, https, authority):
    key, public = rsa_key(tmp_path)
    https.keys = {"keys": [public]}
    of_issuer = {"jwt_issuer": "tests", "jwt_audience": "robot"}
    ca = str(authority / "ca.pem")
    server = sides.serve(method="jwt", jwt_keys=https.url, https_ca=ca, **of_issuer)
    anna = sides.dial("anna", method="jwt", token=rs256(key, 60))
    anna.wait_linked()
    server.wait_for("as anna")


def test_a_service_decides(sides, https, authority):
    token = "a-token-of-the-service"
    https.judge = lambda credential: (
        {"identity": "anna", "groups": ["ops"], "expires": time.time() + 6}
        if credential == token
        else None
    )
    server = sides.serve(method="service", service=https.url, https_ca=str(authority / "ca.pem"))
    stranger = sides.dial("stranger", method="service", token="another-token-than-that")
    stranger.wait_for("login refused")
    server.wait_for("service: refused")
    anna = sides.dial("anna", method="service", token=token)
    anna.wait_linked()
    server.wait_for("as anna")
    assert https.asked[-1]["peer"].startswith("127.0.0.1:")
    anna.wait_for("the login of anna has expired", 15)
    assert token not in server.text() + anna.text()
