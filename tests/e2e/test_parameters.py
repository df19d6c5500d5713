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
