"""Rules that change while links are open: by the file, SIGHUP and `ros2 param set`."""

import os
import pty
import signal
import socket
import subprocess
import time

import pytest
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, SetParameters, SetParametersAtomically
from rclpy.parameter import Parameter as RosParameter
from std_msgs.msg import String

from calls import Caller
from graph import connect, until
from harness.domains import free_port

BEFORE = {"rules": ["see"], "rule": {"see": {"export_topics": ["/t/a", "/t/b"]}}}
AFTER = {
    "rules": ["see", "more"],
    "rule": {"see": {"export_topics": ["/t/a"]}, "more": {"export_topics": ["/t/c"]}},
}


@pytest.fixture
def world(make_pair):
    pair = make_pair(server=BEFORE)
    for name in "abc":
        pair.robot.publisher(String, f"/t/{name}")
    pair.operator.wait_publishers("/t/a", 1)
    pair.operator.wait_publishers("/t/b", 1)
    return pair


def with_rules(pair, rules, **more):
    parameters = {k: v for k, v in pair.server.parameters.items() if k not in ("rules", "rule")}
    return {**parameters, **rules, **more}


def expect(pair, names):
    def seen():
        return [n for n in "abc" if pair.operator.publishers(f"/t/{n}")]

    until(lambda: seen() == names, lambda: f"{names}, not {seen()}", 10)


def check_links_stay(pair):
    assert pair.server.text().count(": connected to") == 1
    assert pair.client.text().count(": connected to") == 1


def test_by_a_change_of_the_file(world):
    publisher = world.robot.publisher(String, "/t/a")
    collector = world.operator.collector(String, "/t/a")
    connect(publisher, collector, String(data="x"))
    world.server.set_parameters(with_rules(world, AFTER))
    world.server.wait_for(r"rules: 1 added \(more\), 1 changed \(see\)", 10)
    expect(world, ["a", "c"])
    world.client.wait_for(r"cannot export /t/b, and says: no rule allows exporting it any longer")
    collector.clear()
    publisher.publish(String(data="still"))
    collector.wait_for(lambda m: m.data == "still")
    check_links_stay(world)
    # The node's parameters show the values of the file.
    node = world.server.node
    caller = Caller(world.robot, f"/{node}/get_parameters", GetParameters).wait_ready()
    values = caller.call(GetParameters.Request(names=["rules", "rule.more.export_topics"])).values
    assert [v.string_array_value for v in values] == [["see", "more"], ["/t/c"]]


def test_a_file_that_others_may_change_changes_nothing(make_pair):
    listen = {"address": "0.0.0.0", "port": free_port()}
    pair = make_pair(
        server={**BEFORE, "listen": listen, "allow_plaintext": True},
        client={"url": f"ws://127.0.0.1:{listen['port']}/"},
    )
    pair.server.parameters_file.chmod(0o666)
    pair.server.set_parameters(with_rules(pair, AFTER))
    pair.server.wait_for(r"the parameters stay as they were: .* every user .* may change", 10)
    pair.server.parameters_file.chmod(0o600)
    pair.server.wait_for(r"rules: 1 added \(more\), 1 changed \(see\)", 10)


def test_a_wrong_file_changes_nothing(world):
    world.server.parameters_file.write_text("connect_server: {ros__parameters: [", encoding="ascii")
    world.server.wait_for(r"the parameters stay as they were: .*params\.yaml", 10)
    wrong = {"rules": ["see"], "rule": {"see": {"export_topic": ["/t/c"], "max_rate": -1.0}}}
    world.server.set_parameters(with_rules(world, wrong))
    why = r"the parameters stay as they were: in the parameter file: .*export_topic"
    world.server.wait_for(why, 10)
    world.server.wait_for(r"rule\.see\.max_rate: -1")
    refused = lambda: world.server.status().get("refused_parameters", {})  # noqa: E731
    until(lambda: "export_topic" in refused().get("problem", ""), "the status says so", 10)
    world.server.parameters_file.unlink()
    time.sleep(3)
    expect(world, ["a", "b"])
    world.server.set_parameters(with_rules(world, AFTER))
    expect(world, ["a", "c"])
    until(lambda: not refused(), "the status says it no longer", 10)
    check_links_stay(world)


@pytest.mark.parametrize("left", ["", "connect_cleint: {ros__parameters: {rules: [drive]}}\n"])
def test_a_file_without_anything_for_the_node_changes_nothing(domains, make_side, left):
    """The address is no key of the file, so that a client could start without it: too freely."""
    parameters = {
        "rules": ["drive"],
        "rule": {"drive": {"export_topics": ["/t/a"]}},
    }
    url = ("-p", f"url:=ws://127.0.0.1:{free_port()}")
    token = {"CONNECT_BRIDGE_TOKEN": "a-token-for-one-run"}
    side = make_side(
        "client", domains(1)[0], parameters, env=token, arguments=("--ros-args", *url)
    )
    side.start()
    until(lambda: side.status_file.exists(), "it runs", 20)
    side.parameters_file.write_text(left, encoding="ascii")
    why = r"the parameters stay as they were: .* has nothing for /connect_client any longer"
    side.wait_for(why, 10)
    side.process.send_signal(signal.SIGHUP)
    until(lambda: side.text().count("any longer") == 2, "it says so again", 10)
    assert "rules: 1" not in side.text()
    changed = {**parameters, "rule": {"drive": {"export_topics": ["/t/b"]}}}
    side.set_parameters(changed)
    side.wait_for(r"rules: 1 changed \(drive\)", 10)


def test_a_change_while_it_starts_is_noticed(domains, make_side):
    """The login waits for an address that does not answer, and the file was read before."""
    with socket.create_server(("127.0.0.1", 0)) as silent:
        login = {
            "method": "jwt",
            "jwt_keys": f"http://127.0.0.1:{silent.getsockname()[1]}/keys",
            "jwt_issuer": "issuer",
            "jwt_audience": "robot",
        }
        parameters = {"listen": {"port": free_port()}, "auth": login, **BEFORE}
        side = make_side("server", domains(1)[0], parameters).start()
        silent.settimeout(20)
        connection, _ = silent.accept()
        with connection:
            side.set_parameters({**parameters, **AFTER})
            side.wait_for(r"rules: 1 added \(more\), 1 changed \(see\)", 20)
    assert side.text().index("listening on") < side.text().index("rules: 1 added")


def test_by_sighup_and_by_parameters(world):
    world.server.process.send_signal(signal.SIGHUP)
    world.server.wait_for("the parameter file was read again; none changed")
    node = world.server.node
    caller = Caller(world.robot, f"/{node}/set_parameters", SetParameters).wait_ready()

    def set_list(name, values):
        value = ParameterValue(type=ParameterType.PARAMETER_STRING_ARRAY, string_array_value=values)
        request = SetParameters.Request(parameters=[Parameter(name=name, value=value)])
        return caller.call(request).results[0]

    assert set_list("rule.see.export_topics", ["/t/c"]).successful
    world.server.wait_for(r"rules: 1 changed \(see\)")
    expect(world, ["c"])
    refused = set_list("rules", ["see", "nobody"])
    assert not refused.successful and "nobody" in refused.reason
    world.server.wait_for("the parameters stay as they were: .*nobody")
    # The file's values are in use.
    world.server.process.send_signal(signal.SIGHUP)
    expect(world, ["a", "b"])
    check_links_stay(world)


def test_settings_that_may_change_do(world):
    """Log level, cap and status file: by a parameter and by the file, without a restart."""
    node = world.server.node
    caller = Caller(world.robot, f"/{node}/set_parameters_atomically", SetParametersAtomically)
    caller.wait_ready()

    def set_all(**values):
        request = SetParametersAtomically.Request(
            parameters=[RosParameter(name.replace("__", "."), value=value).to_parameter_msg()
                        for name, value in values.items()]
        )
        return caller.call(request).result

    refused = set_all(log_level="debug", link__bytes_per_second=-1)
    assert not refused.successful and "link.bytes_per_second" in refused.reason
    assert set_all(log_level="debug", link__bytes_per_second=50_000).successful
    world.server.wait_for("changed: log_level, link.bytes_per_second")
    publisher = world.robot.publisher(String, "/t/a")
    collector = world.operator.collector(String, "/t/a")
    connect(publisher, collector, String(data="x"))
    begin = time.monotonic()
    publisher.publish(String(data=os.urandom(100_000).hex()))
    collector.wait_for(lambda m: len(m.data) == 200_000)
    assert time.monotonic() - begin > 1, "the link that is open has the cap"
    refused = set_all(log_level="warn", dead_after=1.0)
    assert not refused.successful and "read-only" in refused.reason
    # Whoever may call this could have any file of the bridge's user overwritten.
    moved = world.server.status_file.with_name("moved.json")
    refused = set_all(log_level="warn", status_file=str(moved))
    assert not refused.successful and "read-only" in refused.reason
    world.server.set_parameters(
        with_rules(world, AFTER, status_file=str(moved), log_level="warn", dead_after=4.0)
    )
    world.server.wait_for(
        "dead_after; status_file: changed in the parameter file; this needs a restart"
    )
    needs = lambda: world.server.status().get("needs_restart")  # noqa: E731
    until(lambda: needs() == ["dead_after", "status_file"], "the status says so", 10)
    expect(world, ["a", "c"])
    said = world.server.text().count("rules:")
    world.server.set_parameters(
        with_rules(world, BEFORE, status_file=str(moved), log_level="warn", dead_after=4.0)
    )
    expect(world, ["a", "b"])
    assert world.server.text().count("rules:") == said, "what is below the level is not logged"
    assert world.client.text().count(": connected to") == 1
    assert not moved.exists()


def test_a_terminal_that_closes_ends_it(tmp_path, domains, make_side):
    (domain,) = domains(1)
    parameters = {
        "listen": {"port": free_port()},
        "auth": {"token": "a-token-for-one-run"},
        **BEFORE,
    }
    side = make_side("server", domain, parameters)
    terminal, stdin = pty.openpty()
    with open(side.log, "wb") as out:
        command = ["setsid", "--ctty", *side.command]
        process = subprocess.Popen(
            command, env=side.env, stdin=stdin, stdout=out, stderr=out
        )
    os.close(stdin)
    try:
        until(lambda: b"listening on" in side.log.read_bytes(), "it listens", 20)
        process.send_signal(signal.SIGHUP)
        until(lambda: b"none changed" in side.log.read_bytes(), "it reads again", 10)
        os.close(terminal)
        assert process.wait(10) == 0
        assert b"stopping" in side.log.read_bytes()
    finally:
        process.kill()
        process.wait()
