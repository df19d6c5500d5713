"""Services of any type, called as if their server were here."""

import time

import pytest
from connect_bridge_test_interfaces.srv import Download, Reflect, Upload
from rclpy.qos import qos_profile_services_default

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
from lacking import services_of_any_type

pytestmark = services_of_any_type
SERVER = OPEN_CALLS
MIB = 1 << 20


@pytest.fixture
def service(request):
    return "/s/" + "".join(c if c.isalnum() else "_" for c in request.node.name)


def serve(graph, kind, service, answer):
    graph.tester.create_service(kind, service, answer)


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
