"""Login by JSON Web Tokens and by a plugin."""

import base64
import hashlib
import hmac
import json
import time

import pytest
from std_msgs.msg import String

from graph import connect, until
from harness.domains import free_port
from harness.programs import build_dir

SECRET = b"a secret of thirty-two bytes or more"
MAY_SEE = {"export_topics": ["/t/**"], "groups": ["ops", "plugin"]}
RULES = {"rules": ["see"], "rule": {"see": MAY_SEE}}
PLUGIN = build_dir() / "plugins" / "auth_plugin.so"


def base64url(data):
    return base64.urlsafe_b64encode(data).rstrip(b"=").decode()


def jwt(seconds, secret=SECRET, **more):
    claims = {"iss": "tests", "aud": "robot", "sub": "anna", "groups": ["ops"], **more}
    claims["exp"] = int(time.time()) + seconds
    parts = [base64url(json.dumps(part).encode()) for part in ({"alg": "HS256"}, claims)]
    code = hmac.new(secret, ".".join(parts).encode(), hashlib.sha256).digest()
    return ".".join([*parts, base64url(code)])


def write(file, text):
    part = file.with_suffix(".new")
    part.write_text(text, encoding="ascii")
    part.chmod(0o600)
    part.rename(file)
    return str(file)


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
        jwt_algorithms=["HS256"],
    )


def test_a_jwt_logs_in_is_renewed_and_expires(sides, tmp_path, make_graph):
    server = serve_jwt(sides, tmp_path)
    robot, operator = (make_graph(domain) for domain in sides.domains)
    file = tmp_path / "anna.jwt"
    first, second = jwt(8), jwt(16)
    anna = sides.dial("anna", method="jwt", token_file=write(file, first))
    anna.wait_linked()
    server.wait_for("as anna")
    publisher = robot.publisher(String, "/t/jwt")
    collector = operator.collector(String, "/t/jwt")
    connect(publisher, collector, String(data="in"))
    write(file, second)
    anna.wait_for("logged in anew at .*; the link goes on", 6)
    anna.wait_for("the login of anna has expired", 25)
    assert anna.text().count("link open") == 1, "the first one did not end it"
    anna.wait_for("login refused")
    server.wait_for("JWT: it has expired")
    for secret in (first, second, SECRET.decode(), base64url(SECRET)):
        assert secret not in server.text() + anna.text()


def test_a_wrong_jwt_is_refused_and_a_withdrawn_key_ends_links(sides, tmp_path):
    server = serve_jwt(sides, tmp_path)
    forged = sides.dial("forged", method="jwt", token=jwt(60, secret=b"x" * 32))
    forged.wait_for("login refused")
    server.wait_for("JWT: the signature is wrong")
    other = sides.dial("other", method="jwt", token=jwt(60, aud="another robot"))
    other.wait_for("login refused")
    token = sides.dial("token", method="token", token="a-token-that-is-none")
    token.wait_for("login refused")
    anna = sides.dial("anna", method="jwt", token=jwt(60))
    anna.wait_linked()
    another = {"kty": "oct", "kid": "2", "k": base64url(b"y" * 32)}
    write(tmp_path / "keys.json", json.dumps({"keys": [another]}))
    anna.wait_for("the login of anna was withdrawn", 6)


def test_a_plugin_decides(sides, make_graph):
    secret = "anna:a-password-of-anna"
    server = sides.serve(method="plugin", plugin=str(PLUGIN), plugin_options=secret)
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


def test_a_plugin_that_does_not_start(domains, make_side):
    auth = {"method": "plugin", "plugin": str(PLUGIN), "plugin_options": "no colon"}
    side = make_side("server", domains(1)[0], {"listen": {"port": free_port()}, "auth": auth})
    side.start()
    assert side.process.wait(10) == 2, side.text()
    assert "does not start: expected NAME:PASSWORD" in side.text()
