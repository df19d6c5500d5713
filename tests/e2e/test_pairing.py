"""Two machines are paired by one line: server --pair, client 'wss+pair://...'."""

import os
import re
import select
import stat
import subprocess
import time

import yaml

from harness.programs import build_dir, dies_with_us, ros_environment
from pairing import LINE, Robot, invitation_of, world  # noqa: F401

_LINKED = ": connected to "


# From the start of the server to the first message: 10 s are wanted, of machines that have nothing
# else to do.
SECONDS_MAX = 60


def test_one_line_pairs_and_both_start_without_words_later(world):
    begin = time.monotonic()
    server, line = world.pair()
    assert line.startswith(f"wss+pair://localhost:{world.port}/#")
    client = world.run("client", "operator", line)
    client.wait_for("paired: from now on")
    paired = time.monotonic() - begin
    world.crosses("/first")
    seconds = time.monotonic() - begin
    print(f"paired after {paired:.1f} s, the first message after {seconds:.1f} s")
    assert seconds < SECONDS_MAX
    client.stop()
    server.stop()
    server = world.run("server", "robot")
    client = world.run("client", "operator")
    client.wait_for(_LINKED)
    world.crosses("/second")
    # And with the line of the first time, which the shell's history has.
    client.stop()
    client = world.run("client", "operator", line)
    client.wait_for(_LINKED)


def test_who_looks_cannot_operate_and_who_operates_can(world):
    robot = Robot(world)
    _, line = world.pair()
    client = world.run("client", "operator", line)
    client.wait_for("paired: from now on")
    world.crosses("/state")
    robot.stands_still()
    client.stop()
    world.started[0].stop()

    _, line = world.pair("--operate")
    world.run("client", "another operator", line)
    robot.operate()
    world.crosses("/state")
    robot.stop()


def test_the_code_works_once_and_is_nowhere_to_be_read(world):
    server, line = world.pair()
    code = line.split("#")[1].split(".")[0]
    client = world.run("client", "operator", line)
    client.wait_for("paired: from now on")
    with open(f"/proc/{client.pid}/cmdline", "rb") as words:
        assert code.encode() not in words.read()
    second = world.run("client", "stranger", line)
    second.wait_for("the server refused the invitation")
    assert second.process.wait(10) == 2
    assert "paired: from now on" not in second.text()
    server.wait_for("the code of the pairing is used up")
    for file in world.folder.rglob("*"):
        if not file.is_file() or file.name == "invitation":  # what its user is to read
            continue
        assert code.encode() not in file.read_bytes(), file
    assert code not in server.text()
    for secret in [*world.home("operator").rglob("token-*"), *world.home("robot").rglob("*.key")]:
        assert stat.S_IMODE(secret.stat().st_mode) == 0o600, secret


def test_a_terminal_shows_the_invitation(world):
    ours, its = os.openpty()
    port = ["--ros-args", "-p", f"listen.port:={world.port}"]
    server = subprocess.Popen(
        dies_with_us([str(build_dir() / "server"), "--pair", "localhost", *port]),
        env=ros_environment(world.domains["robot"], ROS_HOME=world.home("robot")),
        stdout=its,
    )
    os.close(its)
    seen = ""
    end = time.monotonic() + 20
    while not LINE.search(seen):
        assert select.select([ours], [], [], max(0.0, end - time.monotonic()))[0], seen
        seen += os.read(ours, 4096).decode()
    server.terminate()
    assert server.wait(20) == 0
    assert not list(world.home("robot").rglob("invitation"))


def test_another_key_at_the_address_is_refused(world):
    server, line = world.pair()
    server.stop()
    other = world.run(
        "server", "impostor", "--pair", "--ros-args", "-p", f"listen.port:={world.port}"
    )
    invitation_of(other)
    client = world.run("client", "operator", line)
    client.wait_for("this is not the server of the invitation .* which is not in tls.pin")
    assert client.process.wait(10) == 2
    assert not list(world.home("operator").rglob("params.yaml"))


def test_a_client_that_is_removed_loses_its_link(world):
    server, line = world.pair()
    client = world.run("client", "operator", line)
    client.wait_for("paired: from now on")
    (tokens,) = world.home("robot").rglob("tokens.yaml")
    identity, file = server.wait_for(r"ctl token (\S+) --remove --file '(.+?)'").groups()
    assert file == str(tokens)
    subprocess.run(
        [build_dir() / "ctl", "token", identity, "--remove", "--file", file], check=True
    )
    client.wait_for("was withdrawn")
    # It has a server still that starts without words.
    server.stop()
    world.run("server", "robot").wait_for("listening on")


def test_a_running_server_takes_another_client(world):
    server, line = world.pair()
    world.run("client", "operator", line).wait_for("paired: from now on")
    asks = world.run("server", "robot", "--pair", "localhost", "--operate")
    another = invitation_of(asks)
    assert asks.process.wait(10) == 0
    assert another.startswith(f"wss+pair://localhost:{world.port}/#")
    asks.wait_for(f"a server runs already .*process {server.pid}, port {world.port}")
    world.run("client", "another operator", another).wait_for("paired: from now on")
    (tokens,) = world.home("robot").rglob("tokens.yaml")
    first, second = yaml.safe_load(tokens.read_text())
    assert second["groups"] == ["paired", "operators"]
    # The same name twice: both commands are named.
    server.wait_for(f"ctl token {second['identity']} --remove --file '{tokens}'")
    server.wait_for(f"if it is the same machine: ctl token {first['identity']} --remove")


def test_what_listens_there_and_does_not_pair_is_named(world):
    world.pair()
    second = world.run(
        "server", "another robot", "--pair", "--ros-args", "-p", f"listen.port:={world.port}"
    )
    second.wait_for("a server that runs already, or another program")
    second.wait_for("End what listens there, or give this one another port")
    assert second.process.wait(10) == 2


def test_the_rules_of_a_pairing_change_at_run_time(world):
    server, line = world.pair("--operate")
    client = world.run("client", "operator", line)
    client.wait_for("paired: from now on")
    world.crosses("/first")
    file = world.home("robot") / "connect_bridge" / "connect_server" / "params.yaml"
    text = file.read_text()
    rules = re.search(r"rules: .*\n", text).group(0)
    assert '"operate"' in rules
    file.write_text(text.replace(rules, 'rules: ["look"]\n'))
    server.wait_for(r"rules: 1 removed \(operate\)", 10)
    file.write_text(text)
    server.wait_for(r"rules: 1 added \(operate\)", 10)
    client.stop()
    server.stop()
    server = world.run("server", "robot")
    server.wait_for("listening on")
    file.write_text(text.replace(rules, 'rules: ["look"]\n'))
    server.wait_for(r"rules: 1 removed \(operate\)", 10)
