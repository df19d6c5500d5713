"""Both programs are ordinary nodes: their parameters through rclpy's own client."""

import time

import pytest
from rcl_interfaces.msg import ParameterType, ParameterValue
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from graph import WAIT, until

NODES = {"server": "connect_server", "client": "connect_client"}


def result(future):
    until(future.done, "an answer of the parameter service")
    return future.result()


@pytest.fixture(params=["server", "client"])
def remote(request, pair):
    """A parameter client of one side's node."""
    graph = pair.robot if request.param == "server" else pair.operator
    client = AsyncParameterClient(graph.tester, NODES[request.param])
    assert client.wait_for_services(WAIT)
    return client


def values(remote, *names):
    return [
        v.string_value
        or v.double_value
        or v.integer_value
        or v.bool_value
        or list(v.string_array_value)
        for v in result(remote.get_parameters(list(names))).values
    ]


def test_list_get_and_describe(remote):
    names = result(remote.list_parameters([], 0)).result.names
    assert {"use_sim_time", "dead_after", "max_message_size"} <= set(names)
    assert values(remote, "dead_after", "max_message_size") == [3.0, 64 << 20]
    described = result(remote.describe_parameters(["dead_after", "auth.method"])).descriptors
    assert [d.type for d in described] == [
        ParameterType.PARAMETER_DOUBLE,
        ParameterType.PARAMETER_STRING,
    ]
    assert all(d.description for d in described)
    assert described[0].floating_point_range[0].from_value > 0
    types = result(remote.get_parameter_types(["dead_after", "no_such"])).types
    assert list(types) == [ParameterType.PARAMETER_DOUBLE, ParameterType.PARAMETER_NOT_SET]


def test_secrets_are_not_readable(remote, pair):
    names = result(remote.list_parameters([], 0)).result.names
    assert not [name for name in names if "token" in name and "file" not in name]
    secret = pair.client.parameters["auth"]["token"]
    everything = str(result(remote.get_parameters(["auth.token", *names])))
    assert secret not in everything
    assert secret not in str(result(remote.describe_parameters(["auth.token", *names])))


def test_read_only_and_unknown_parameters_are_refused(remote):
    answer = result(
        remote.set_parameters([Parameter("dead_after", value=1.0), Parameter("no_such", value=1)])
    )
    assert [r.successful for r in answer.results] == [False, False]
    assert all(r.reason for r in answer.results)
    assert values(remote, "dead_after") == [3.0]


def test_use_sim_time(remote, pair, request):
    graph = pair.robot if "server" in request.node.name else pair.operator
    node = NODES["server" if graph is pair.robot else "client"]

    def follows():
        return [s for s in graph.subscriptions("/clock") if s.node_name == node]

    answer = result(remote.set_parameters([Parameter("use_sim_time", value=True)]))
    assert answer.results[0].successful
    until(follows, "it subscribes to /clock")
    clock = graph.publisher(Clock, "/clock", 1)
    clock.publish(Clock())
    assert (
        result(remote.set_parameters([Parameter("use_sim_time", value=False)]))
        .results[0]
        .successful
    )
    until(lambda: not follows(), "it lets /clock go")
    graph.tester.destroy_publisher(clock)


def test_rules_change_at_run_time_all_or_nothing(make_pair):
    """A right that is taken away ends the mirror; a pattern that is wrong changes nothing."""
    pair = make_pair()
    remote = AsyncParameterClient(pair.robot.tester, "connect_server")
    assert remote.wait_for_services(WAIT)
    pair.robot.publisher(String, "/t/a")
    pair.robot.publisher(String, "/t/b")
    pair.operator.wait_publishers("/t/a", 1)
    pair.operator.wait_publishers("/t/b", 1)
    patterns = "rule.all.export_topics"
    refused = result(
        remote.set_parameters_atomically(
            [Parameter(patterns, value=["/t/a"]), Parameter("rule.all.priority", value="fastest")]
        )
    )
    assert not refused.result.successful
    assert "fastest" in refused.result.reason
    time.sleep(0.5)
    assert pair.operator.publishers("/t/b")
    assert (
        result(remote.set_parameters([Parameter(patterns, value=["/t/a"])])).results[0].successful
    )
    pair.operator.wait_publishers("/t/b", 0)
    assert pair.operator.publishers("/t/a")
    assert (
        result(remote.set_parameters([Parameter(patterns, value=["/t/**"])])).results[0].successful
    )
    pair.operator.wait_publishers("/t/b", 1)


def test_changes_are_told_on_parameter_events(make_pair):
    from rcl_interfaces.msg import ParameterEvent

    pair = make_pair()
    events = pair.robot.collector(ParameterEvent, "/parameter_events", 100)
    remote = AsyncParameterClient(pair.robot.tester, "connect_server")
    assert remote.wait_for_services(WAIT)

    def told():
        result(remote.set_parameters([Parameter("rule.all.max_rate", value=50.0)]))
        return any(
            e.node == "/connect_server"
            and [p.name for p in (*e.changed_parameters, *e.new_parameters)]
            == ["rule.all.max_rate"]
            for e in list(events.messages)
        )

    until(told, "an event that names the parameter", step=0.2)


def test_remapped_name_and_namespace(domains, make_side, make_graph):
    (domain,) = domains(1)
    parameters = {"listen": {"port": 0}, "auth": {"token": "x" * 20}, "rules": []}
    side = make_side(
        "server",
        domain,
        parameters,
        node="/**",
        arguments=("--ros-args", "-r", "__ns:=/fleet", "-r", "__node:=gate"),
    )
    side.start().wait_listening()
    graph = make_graph(domain)
    until(lambda: ("gate", "/fleet") in graph.tester.get_node_names_and_namespaces(), "its name")
    remote = AsyncParameterClient(graph.tester, "/fleet/gate")
    assert remote.wait_for_services(WAIT)
    got = result(remote.get_parameters(["listen.address"])).values[0]
    assert got == ParameterValue(type=ParameterType.PARAMETER_STRING, string_value="127.0.0.1")
    assert side.stop() == 0
