"""A side is an ordinary node: it has the name that it is given, and parameters there."""

from rcl_interfaces.msg import ParameterType, ParameterValue
from rclpy.parameter_client import AsyncParameterClient

from graph import WAIT, until


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
    got = remote.get_parameters(["listen.address"])
    until(got.done, "an answer of the parameter service")
    address = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value="127.0.0.1")
    assert got.result().values[0] == address
    assert side.stop() == 0


def test_the_last_parameter_given_wins_whatever_its_kind(domains, make_side, make_graph):
    (domain,) = domains(1)
    rule = {"export_topics": ["/a"], "types": ["std_msgs/msg/String"]}
    parameters = {
        "listen": {"port": 0},
        "auth": {"token": "x" * 20},
        "rules": ["a"],
        "rule": {"a": rule},
        "dead_after": 4,
        "connections_max": 8,
    }
    earlier = ("--ros-args", "-p", "connections_max:=7.5")
    side = make_side("server", domain, parameters, arguments=earlier)
    side.command += ["-p", "dead_after:=1.5", "--param", "rule.a.types:=[]"]
    side.start().wait_listening()
    graph = make_graph(domain)
    remote = AsyncParameterClient(graph.tester, "/connect_server")
    assert remote.wait_for_services(WAIT)

    def values():
        got = remote.get_parameters(["dead_after", "rule.a.types", "connections_max"])
        until(got.done, "an answer of the parameter service")
        dead, types, most = got.result().values
        return dead.double_value, list(types.string_array_value), most.integer_value

    assert values() == (1.5, [], 8)
    # The file is read again, and comes between the arguments, as at the start.
    rule["export_topics"] = ["/b"]
    side.set_parameters(parameters)
    side.wait_for(r"rules: 1 changed \(a\)")
    assert values() == (1.5, [], 8)
    assert side.stop() == 0
