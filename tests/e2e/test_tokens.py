"""Tokens while the sides run: made, withdrawn, changed, expired, renewed."""

import datetime
import subprocess
import time

import pytest
from std_msgs.msg import String

from graph import connect, until
from harness.domains import free_port
from harness.programs import build_dir
from tokens import entry, write, write_tokens

ANNA, BERT = "token-of-anna-0123456789", "token-of-bert-0123456789"
RULES = {"rules": ["ops"], "rule": {"ops": {"export_topics": ["/t/**"], "groups": ["ops"]}}}


def in_seconds(seconds):
    return datetime.datetime.now(datetime.timezone.utc) + datetime.timedelta(seconds=seconds)


class World:
    """A server with a token file, and clients whose tokens are in files."""

    def __init__(self, folder, domains, make_side, make_graph):
        self.folder, self.make_side = folder, make_side
        self.domains = domains(2)
        self.robot, self.operator = (make_graph(d) for d in self.domains)
        self.port = free_port()
        self.tokens = folder / "tokens.yaml"

    def allow(self, *entries):
        write_tokens(self.tokens, *entries)

    def serve(self, *entries):
        self.allow(*entries)
        self.server = self.make_side(
            "server",
            self.domains[0],
            {
                "listen": {"port": self.port},
                "auth": {"token_file": str(self.tokens)},
                **RULES,
            },
        )
        self.server.start().wait_listening()
        return self.server

    def token_file(self, name, token):
        return write(self.folder / f"{name}.token", token + "\n")

    def client(self, name, token):
        client = self.make_side(
            "client",
            self.domains[1],
            {
                "url": f"ws://127.0.0.1:{self.port}",
                "auth": {"token_file": self.token_file(name, token)},
            },
            name=name,
        )
        return client.start()


@pytest.fixture
def world(tmp_path, domains, make_side, make_graph):
    return World(tmp_path, domains, make_side, make_graph)


def test_a_withdrawn_token_ends_its_link_and_no_other(world):
    world.serve(entry("anna", ANNA), entry("bert", BERT))
    anna, bert = world.client("anna", ANNA), world.client("bert", BERT)
    anna.wait_linked()
    bert.wait_linked()
    world.allow(entry("bert", BERT))
    world.server.wait_for(r"closing the link .*the login of anna was withdrawn \(revoked\)", 5)
    world.server.wait_for("1 tokens, 1 withdrawn")
    anna.wait_for("the login of anna was withdrawn; the server's log says why", 5)
    anna.wait_for("login refused", 10)  # it retries slowly
    assert bert.links(), "bert is not concerned"
    assert "lost the link" not in bert.text()


def test_a_new_token_before_the_old_one_expires_leaves_no_gap(world):
    expires = in_seconds(9)
    newer = "a-newer-token-of-anna"
    world.serve(entry("anna", ANNA, expires=expires), entry("anna", newer))
    anna = world.client("anna", ANNA)
    anna.wait_linked()
    publisher = world.robot.publisher(String, "/t/count", 100)
    collector = world.operator.collector(String, "/t/count", 100)
    connect(publisher, collector, String(data="-1"))
    world.token_file("anna", newer)
    sent = 0
    while in_seconds(0) < expires + datetime.timedelta(seconds=1.5):
        publisher.publish(String(data=str(sent)))
        sent += 1
        time.sleep(0.02)
    anna.wait_for("renewed the login at .*; the link stays open")
    world.server.wait_for("has renewed its login as anna")
    numbers = [int(m.data) for m in collector.messages]
    got = [n for n in numbers if n >= 0]
    until(lambda: len(collector.messages) >= sent, "the last one")
    got = [int(m.data) for m in collector.messages if int(m.data) >= 0]
    assert got == list(range(sent)), "every message came, in order"
    assert anna.text().count(": connected to") == 1


def test_ctl_token_makes_a_token_that_logs_in(world):
    def make(*arguments):
        return subprocess.run(
            [build_dir() / "ctl", "token", *arguments], capture_output=True, text=True, timeout=20
        )

    world.serve(entry("bert", BERT))
    # It appends to a file of entries in the documented form, not to JSON.
    write(world.tokens, f"- identity: bert\n  token_sha256: {entry('bert', BERT)['token_sha256']}")
    file = ("--file", str(world.tokens))
    made = make("anna", "--group", "ops", "--days", "30", "--comment", 'her "laptop": old', *file)
    assert made.returncode == 0, made.stderr
    token = made.stdout.strip()
    assert len(token) == 64 and token not in made.stderr
    text = world.tokens.read_text(encoding="ascii")
    assert token not in text and "identity: \"anna\"" in text and "expires: " in text
    assert world.tokens.stat().st_mode & 0o777 == 0o600
    world.server.wait_for("was read again: 2 tokens")
    world.client("anna", token).wait_linked()
    world.server.wait_for("as anna")
    world.tokens.chmod(0o666)
    doubtful = make("dora", *file)
    assert doubtful.returncode == 0 and "The server refuses the file as it is" in doubtful.stderr
    assert "chmod go-w" in doubtful.stderr
    world.tokens.chmod(0o600)
    text = world.tokens.read_text(encoding="ascii")
    printed = make("cora")
    assert "token_sha256" in printed.stderr and len(printed.stdout.strip()) == 64
    for wrong in (
        ["anna", "--expires", "2027-02-30"],
        ["anna", "--expires", "2020-01-01"],
        ["a\nb"],
        ["anna", "--days", "0"],
    ):
        refused = make(*wrong, "--file", str(world.tokens))
        assert refused.returncode != 0 and not refused.stdout
        assert wrong[1:2] != ["--expires"] or "--expires: " in refused.stderr, refused.stderr
    assert world.tokens.read_text(encoding="ascii") == text, "nothing was changed"
    one = world.folder / "one.token"
    one.write_text(ANNA, encoding="ascii")
    refused = make("anna", "--file", str(one))
    assert refused.returncode == 2 and "holds one token" in refused.stderr
    assert one.read_text(encoding="ascii") == ANNA
