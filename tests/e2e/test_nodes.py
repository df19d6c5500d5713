"""Parameters of remote nodes, and remote nodes as nodes of this graph."""

import time

from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from std_msgs.msg import String
from std_srvs.srv import Trigger

from graph import connect, until
from lacking import services_of_any_type

SERVER = {
    "rules": ["all"],
    "rule": {
        "all": {
            "export_topics": ["/**"],
            "export_services": ["/**"],
            "parameters": ["/open/*"],
        },
    },
}


def robot_node(pair, name):
    node = pair.robot.node(name, namespace="/open", start_parameter_services=True)
    node.declare_parameter("speed", 1.5)
    node.declare_parameter("name", "wheel")
    return node


def client_of(pair, node):
    return AsyncParameterClient(pair.operator.tester, node)


def wait_ready(client):
    until(client.services_are_ready, "the parameter services", step=0.01)


def done(future):
    until(future.done, "an answer")
    return future.result()


def test_get_set_list_and_describe(pair):
    node = robot_node(pair, "base")
    client = client_of(pair, "/open/base")
    wait_ready(client)
    (speed,) = done(client.get_parameters(["speed"])).values
    assert speed.double_value == 1.5
    (set_,) = done(client.set_parameters([Parameter("speed", value=2.5)])).results
    assert set_.successful and node.get_parameter("speed").value == 2.5
    names = done(client.list_parameters([], 0)).result.names
    assert {"speed", "name"} <= set(names)
    (described,) = done(client.describe_parameters(["name"])).descriptors
    assert described.name == "name"
    types = done(client.get_parameter_types(["speed", "name"])).types
    assert list(types) == [Parameter.Type.DOUBLE.value, Parameter.Type.STRING.value]
    both = [Parameter("speed", value=3.5), Parameter("name", value="arm")]
    assert done(client.set_parameters_atomically(both)).result.successful
    assert node.get_parameter("name").value == "arm"


def names_in(graph):
    return {
        (space.rstrip("/") + "/" + name)
        for name, space in graph.tester.get_node_names_and_namespaces()
    }


@services_of_any_type
def test_graph_of_nodes(make_pair):
    """The operator's graph lists the robot's nodes, and they own the mirrors of what they have."""
    pair = make_pair(server=SERVER)
    node = robot_node(pair, "arm")
    publisher = pair.robot.publisher(String, "/open/state", 10, node)
    node.create_service(Trigger, "/open/reset", lambda _, response: response)
    collector = pair.operator.collector(String, "/open/state")
    connect(publisher, collector, String(data="x"))
    until(lambda: "/open/arm" in names_in(pair.operator), "the remote node is listed")
    (mirror,) = pair.operator.wait_publishers("/open/state", 1)
    assert (mirror.node_namespace, mirror.node_name) == ("/open", "arm")
    client = pair.operator.tester.create_client(Trigger, "/open/reset")
    until(client.service_is_ready, "the service")
    of_node = pair.operator.tester.get_service_names_and_types_by_node
    # Of which node a service is comes by itself, and may come a moment later.
    until(lambda: "/open/reset" in dict(of_node("arm", "/open")), "the node owns the service")
    wait_ready(client_of(pair, "/open/arm"))
    (speed,) = done(client_of(pair, "/open/arm").get_parameters(["speed"])).values
    assert speed.double_value == 1.5
    # The proxy is not a node of the operator's: nothing of it is exported back.
    time.sleep(0.5)
    assert len(pair.robot.publishers("/open/state")) == 1
    pair.robot.remove(node)
    until(lambda: "/open/arm" not in names_in(pair.operator), "the proxy is gone")


def test_the_robots_graph_need_not_show_the_operators_nodes(make_pair):
    pair = make_pair()
    node = pair.operator.node("joystick")
    publisher = pair.operator.publisher(String, "/o/joystick", 10, node)
    connect(publisher, pair.robot.collector(String, "/o/joystick"), String(data="x"))
    (mirror,) = pair.robot.wait_publishers("/o/joystick", 1)
    assert mirror.node_name == "connect_server"
    assert "/joystick" not in names_in(pair.robot)


def test_merged_graph_has_one_bridge_node(make_pair):
    pair = make_pair(server=SERVER, client={"graph": "merged"})
    node = robot_node(pair, "hidden_one")
    publisher = pair.robot.publisher(String, "/open/merged", 10, node)
    connect(publisher, pair.operator.collector(String, "/open/merged"), String(data="x"))
    (mirror,) = pair.operator.wait_publishers("/open/merged", 1)
    assert mirror.node_name == "connect_client"
    assert "/open/hidden_one" not in names_in(pair.operator)
