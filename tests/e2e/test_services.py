"""Services of any type, called as if their server were here."""

import time

import pytest
from connect_bridge_test_interfaces.msg import Branch, Leaf
from connect_bridge_test_interfaces.srv import Count, Download, Echo, Reflect, Upload
from rcl_interfaces.msg import LoggerLevel
from rcl_interfaces.srv import GetLoggerLevels
from rclpy.qos import qos_profile_services_default
from std_srvs.srv import SetBool, Trigger

from calls import (
    OPEN_CALLS,
    Caller,
    EchoServer,
    check_once,
    name_of,
    request_of,
    servers_graph,
)
from graph import everything, until

SERVER = OPEN_CALLS
MIB = 1 << 20


@pytest.fixture
def service(request):
    return "/s/" + "".join(c if c.isalnum() else "_" for c in request.node.name)


def serve(graph, kind, service, answer):
    graph.tester.create_service(kind, service, answer)


def test_set_bool(pair, robot, service):
    def answer(request, response):
        response.success, response.message = request.data, "grüße"
        return response

    serve(robot, SetBool, service, answer)
    caller = Caller(pair.operator, service, SetBool).wait_ready()
    for data in (True, False):
        response = caller.call(SetBool.Request(data=data))
        assert (response.success, response.message) == (data, "grüße")


def test_a_request_without_fields(pair, robot, service):
    calls = []

    def answer(_, response):
        calls.append(1)
        response.calls = len(calls)
        return response

    serve(robot, Count, service, answer)
    caller = Caller(pair.operator, service, Count).wait_ready()
    assert [caller.call(Count.Request()).calls for _ in range(5)] == [1, 2, 3, 4, 5]


def test_nested_types_and_sequences(pair, robot, service):
    EchoServer(robot, service)
    request = request_of("nested")
    leaf = Leaf(kind=Leaf.KIND_SOME, label="blatt", position=[1.0, -2.0, 3.5])
    for n in range(20):
        branch = Branch(name=f"branch {n}", leaf=leaf, leaves=[leaf] * n, pair=[leaf, Leaf()])
        branch.few = [leaf] * (n % 5)
        request.tree.branches.append(branch)
    request.tree.transform.child_frame_id = "x"
    caller = Caller(pair.operator, service).wait_ready()
    assert caller.call(request).tree == request.tree


def test_every_kind_of_field(pair, robot, service):
    def reflect(request, response):
        response.everything = request.everything
        return response

    serve(robot, Reflect, service, reflect)
    caller = Caller(pair.operator, service, Reflect).wait_ready()
    assert caller.call(Reflect.Request(everything=everything())).everything == everything()


def test_four_megabytes_each_way(pair, robot, service):
    def down(request, response):
        response.data = bytes(i % 251 for i in range(request.size))
        return response

    def up(request, response):
        response.size, response.sum = len(request.data), sum(request.data)
        return response

    serve(robot, Download, service + "_down", down)
    serve(robot, Upload, service + "_up", up)
    caller = Caller(pair.operator, service + "_down", Download).wait_ready()
    response = caller.call(Download.Request(size=4 * MIB))
    assert bytes(response.data) == bytes(i % 251 for i in range(4 * MIB))
    data = bytes(i % 253 for i in range(4 * MIB))
    caller = Caller(pair.operator, service + "_up", Upload).wait_ready()
    response = caller.call(Upload.Request(data=data))
    assert (response.size, response.sum) == (len(data), sum(data))


def test_a_service_of_the_operator(make_pair):
    """The other direction, with another package: the client needs a rule for it."""
    pair = make_pair(
        server=OPEN_CALLS,
        client={"rules": ["back"], "rule": {"back": {"export_services": ["/back/**"]}}},
    )

    def answer(request, response):
        response.levels = [LoggerLevel(name=name, level=20) for name in request.names]
        return response

    serve(pair.operator, GetLoggerLevels, "/back/levels", answer)
    caller = Caller(pair.robot, "/back/levels", GetLoggerLevels).wait_ready()
    response = caller.call(GetLoggerLevels.Request(names=["a", "b"]))
    assert [level.name for level in response.levels] == ["a", "b"]


def test_many_calls_of_several_clients_at_once(pair, robot, service):
    """More than the limit of 64 under way: the others wait, nothing is lost or mixed up."""
    server = EchoServer(robot, service, delay=0.01)
    nodes = [pair.operator.node(f"many_{n}") for n in range(4)]
    callers = [Caller(pair.operator, service, node=node).wait_ready() for node in nodes]
    for number in range(50):
        for which, caller in enumerate(callers):
            caller.ask(f"{which}/{number}")
    for caller in callers:
        caller.wait_answers(50)
        caller.check()
    assert len(server.executed) == 200
    check_once(server)
    for node in nodes:
        pair.operator.remove(node)


def test_a_busy_server_of_the_default_depth_loses_nothing(pair, service):
    """It keeps 10 requests and takes none of them for a while."""
    robot = servers_graph(pair, 1, "busy")
    try:
        server = EchoServer(
            robot,
            service,
            delay=lambda name: 0.3 if name == "0" else 0,
            depth=qos_profile_services_default,
        )
        caller = Caller(pair.operator, service).wait_ready()
        for number in range(60):
            caller.ask(str(number))
        caller.wait_answers(60, 10)
        time.sleep(0.2)
        caller.check()
        assert server.executed == [str(number) for number in range(60)]
    finally:
        robot.close()


def test_callers_that_left_do_not_hold_up_others(pair, service):
    """Their requests stay in the server's queue until they are taken, and no longer."""
    robot = servers_graph(pair, 1, "busy")
    try:
        server = EchoServer(robot, service, delay=0.1, depth=qos_profile_services_default)
        leaving = pair.operator.node("leaving")
        caller = Caller(pair.operator, service, node=leaving).wait_ready()
        for number in range(10):
            caller.ask(str(number))
        until(lambda: server.executed, "the server has begun")
        pair.operator.remove(leaving)
        begin = time.monotonic()
        assert name_of(Caller(pair.operator, service).wait_ready().call(request_of("x"))) == "x"
        assert time.monotonic() - begin < 3, "it waits as if the server were silent"
    finally:
        robot.close()


@pytest.mark.alone
def test_answers_come_as_they_are_ready(pair, robot, service):
    EchoServer(robot, service, delay=lambda name: 1.0 if name == "slow" else 0)
    caller = Caller(pair.operator, service).wait_ready()
    caller.ask("slow")
    begin = time.monotonic()
    for number in range(10):
        assert name_of(caller.call(request_of(f"fast {number}"))) == f"fast {number}"
    assert time.monotonic() - begin < 0.9, "the slow call holds up the others"
    caller.wait_answers(1)
    caller.check()


@pytest.mark.alone
def test_wait_for_service_tells_the_truth(pair, robot, service):
    """A server that goes is gone here within 200 ms, one that comes is here as soon."""
    server = EchoServer(robot, service)
    caller = Caller(pair.operator, service).wait_ready()
    gone, back = [], []
    for _ in range(5):
        begin = time.monotonic()
        server.stop()
        caller.wait_gone()
        gone.append(time.monotonic() - begin)
        begin = time.monotonic()
        server.start()
        caller.wait_ready()
        back.append(time.monotonic() - begin)
        assert name_of(caller.call(request_of("x"))) == "x", "ready, but no answer"
    assert sorted(gone)[2] < 0.2 and sorted(back)[2] < 0.2, f"gone after {gone}, back after {back}"


def test_two_servers_of_one_name(pair, robot, service):
    """One mirror, one answer, and a warning."""
    servers = [EchoServer(robot, service, node=robot.node(f"server_{n}")) for n in range(2)]
    caller = Caller(pair.operator, service).wait_ready()
    until(
        lambda: [
            line
            for side in (pair.server, pair.client)
            for line in side.text().splitlines()
            if service in line and line.startswith("[WARN]")
        ],
        "a warning that names the service",
    )
    for number in range(10):
        caller.ask(str(number))
    caller.wait_answers(10)
    time.sleep(0.2)
    caller.check()
    for server in servers:
        check_once(server)
    mirrors = [
        name
        for node, space in pair.operator.tester.get_node_names_and_namespaces()
        for name, _ in pair.operator.tester.get_service_names_and_types_by_node(node, space)
        if name == service
    ]
    assert len(mirrors) == 1
    servers[0].stop()
    time.sleep(0.5)
    assert name_of(caller.call(request_of("after"))) == "after"


def test_a_local_server_wins(pair, robot, service):
    """If there is a real server, none is mirrored; when it goes, the other side's is mirrored."""
    local = EchoServer(pair.operator, service)
    remote = EchoServer(robot, service)
    caller = Caller(pair.operator, service).wait_ready()
    time.sleep(1)
    for number in range(10):
        caller.call(request_of(f"local {number}"))
    assert not remote.executed
    local.stop()
    until(
        lambda: remote.executed or (caller.ready() and caller.ask("remote")),
        "the remote server is called",
        step=0.2,
    )


def test_a_call_time_limit(make_pair):
    """The caller gets no answer, but the calls behind it do."""
    rules = {
        "rules": ["all"],
        "rule": {"all": {"export_services": ["/s/**"], "call_timeout": 0.5, "calls_max": 1}},
    }
    pair = make_pair(server=rules)
    robot = servers_graph(pair, 4)
    try:
        server = EchoServer(robot, "/s/slow", delay=lambda name: 3.0 if name == "slow" else 0)
        caller = Caller(pair.operator, "/s/slow").wait_ready()
        caller.ask("slow")
        begin = time.monotonic()
        time.sleep(0.25)  # its own timeout begins here
        caller.ask("fast")
        caller.wait_answers(1, 2.5)
        assert time.monotonic() - begin > 0.45, "two calls were under way, and one is the limit"
        time.sleep(3)
        assert list(caller.answers) == ["fast"]
        assert sorted(server.executed) == ["fast", "slow"]
    finally:
        robot.close()


def test_nothing_without_a_rule(pair, robot):
    serve(robot, Trigger, "/private/reset", lambda _, response: response)
    serve(pair.operator, Trigger, "/s/backward", lambda _, response: response)
    serve(pair.operator, Trigger, "/back/unruly", lambda _, response: response)
    EchoServer(robot, "/s/marker")
    Caller(pair.operator, "/s/marker").wait_ready()
    time.sleep(0.5)
    assert not Caller(pair.operator, "/private/reset", Trigger).ready()
    assert not Caller(pair.robot, "/s/backward", Trigger).ready()
    # The server would accept it, but a client without rules exports topics only.
    assert not Caller(pair.robot, "/back/unruly", Trigger).ready()


def test_deny_and_types(make_pair):
    pair = make_pair(
        server={
            "rules": ["echo"],
            "rule": {
                "echo": {
                    "export_services": ["/**"],
                    "deny": ["/s/secret/**"],
                    "types": ["connect_bridge_test_interfaces/srv/Echo"],
                }
            },
        }
    )
    serve(pair.robot, Trigger, "/s/trigger", lambda _, response: response)
    EchoServer(pair.robot, "/s/secret/echo")
    EchoServer(pair.robot, "/s/open/echo")
    Caller(pair.operator, "/s/open/echo").wait_ready()
    time.sleep(0.5)
    assert not Caller(pair.operator, "/s/secret/echo").ready()
    assert not Caller(pair.operator, "/s/trigger", Trigger).ready()


def test_thirteen_services_at_once(pair, robot):
    node = robot.node("thirteen")
    begin = time.monotonic()
    for n in range(13):
        EchoServer(robot, f"/s/thirteen_{n}", node=node)
    callers = [Caller(pair.operator, f"/s/thirteen_{n}") for n in range(13)]
    for caller in callers:
        caller.wait_ready()
        assert name_of(caller.call(request_of("x"))) == "x"
    print(f"13 services within {time.monotonic() - begin:.2f} s")
    robot.remove(node)
    for caller in callers:
        caller.wait_gone(5)
