"""Parameters of remote nodes, and remote nodes as nodes of this graph."""

import time

from lifecycle_msgs.msg import State, Transition, TransitionEvent
from lifecycle_msgs.srv import (
    ChangeState,
    GetAvailableStates,
    GetAvailableTransitions,
    GetState,
)
from rcl_interfaces.msg import ParameterEvent
from rclpy.lifecycle import LifecycleNode
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from std_msgs.msg import String
from std_srvs.srv import Trigger

from graph import connect, until

SERVER = {
    "rules": ["some", "all"],
    "rule": {
        "some": {"parameters": ["/open/*"], "deny": ["/open/secret"]},
        "all": {"export_topics": ["/**"], "export_services": ["/**"]},
    },
}


def robot_node(pair, name, namespace="/open"):
    node = pair.robot.node(name, namespace=namespace, start_parameter_services=True)
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


def test_only_nodes_that_a_rule_names(pair):
    """Neither a pattern for services nor a denied node allows them."""
    for name, namespace in (("secret", "/open"), ("shut", "/closed")):
        robot_node(pair, name, namespace)
    robot_node(pair, "marker")
    wait_ready(client_of(pair, "/open/marker"))
    time.sleep(0.5)
    for node in ("/open/secret", "/closed/shut"):
        assert not client_of(pair, node).services_are_ready(), node
    trigger = pair.robot.tester.create_service(Trigger, "/closed/shut/reset", lambda _, r: r)
    plain = pair.operator.tester.create_client(Trigger, "/closed/shut/reset")
    until(plain.service_is_ready, "an ordinary service of that node")
    pair.robot.tester.destroy_service(trigger)


def test_parameter_events_of_allowed_nodes_only(pair):
    allowed, denied = robot_node(pair, "heard"), robot_node(pair, "unheard", "/closed")
    events = pair.operator.collector(ParameterEvent, "/parameter_events")

    def change(value):
        for node in (denied, allowed):
            node.set_parameters([Parameter("speed", value=value)])

    value = iter(range(1000))
    until(
        lambda: change(float(next(value)))
        or any(event.node == "/open/heard" for event in events.messages),
        "an event",
        step=0.1,
    )
    time.sleep(0.5)
    assert not [event for event in events.messages if event.node == "/closed/unheard"]


def names_in(graph):
    return {
        (space.rstrip("/") + "/" + name)
        for name, space in graph.tester.get_node_names_and_namespaces()
    }


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


LIFECYCLE = {
    "get_state": GetState,
    "change_state": ChangeState,
    "get_available_states": GetAvailableStates,
    "get_available_transitions": GetAvailableTransitions,
    "get_transition_graph": GetAvailableTransitions,
}


def test_lifecycle(pair):
    """What `ros2 lifecycle` does, which is not in the tests' ROS 2: it finds a node by the type of
    its service get_state (nodes), and calls the five services."""
    pair.robot.node("lens", LifecycleNode, namespace="/cell")
    operator = pair.operator.tester

    def listed():
        if "/cell/lens" not in names_in(pair.operator):
            return {}
        return dict(operator.get_service_names_and_types_by_node("lens", "/cell"))

    types = {f"/cell/lens/{n}": [f"lifecycle_msgs/srv/{k.__name__}"] for n, k in LIFECYCLE.items()}
    until(lambda: types.items() <= listed().items(), lambda: f"its services: {listed()}")
    clients = {n: operator.create_client(k, f"/cell/lens/{n}") for n, k in LIFECYCLE.items()}
    for name, client in clients.items():
        until(client.service_is_ready, name)

    def asked(name):
        return done(clients[name].call_async(LIFECYCLE[name].Request()))

    assert asked("get_state").current_state.label == "unconfigured"
    assert "finalized" in {s.label for s in asked("get_available_states").available_states}
    open_now = asked("get_available_transitions").available_transitions
    assert {t.transition.label for t in open_now} == {"configure", "shutdown"}
    assert len(asked("get_transition_graph").available_transitions) > len(open_now)
    events = pair.operator.collector(TransitionEvent, "/cell/lens/transition_event")
    until(lambda: pair.robot.subscriptions("/cell/lens/transition_event"), "demand for its events")
    for number, state in (
        (Transition.TRANSITION_CONFIGURE, State.PRIMARY_STATE_INACTIVE),
        (Transition.TRANSITION_ACTIVATE, State.PRIMARY_STATE_ACTIVE),
    ):
        request = ChangeState.Request(transition=Transition(id=number))
        assert done(clients["change_state"].call_async(request)).success
        assert asked("get_state").current_state.id == state
    events.wait_for(lambda e: e.goal_state.label == "active", "the event of the last state")


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
