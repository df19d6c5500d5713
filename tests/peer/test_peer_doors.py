"""Which services, parts of actions and parameters a peer can see and may offer."""

import struct
import time

import pytest
import rclpy.parameter
from graph import until
from rclpy.action import ActionServer

from connect_control import PARAMETER_EVENTS
from peer_services import GET_PARAMETERS, SET_BOOL, attached, in_graph, names_request


def test_services_are_offered_only_where_they_are_accepted(world, peer, service):
    for name in ("/s/right/a", "/s/right/b", "/s/right/_hidden", "/secret/service"):
        service(name)
    plain = peer()
    plain.until(lambda: plain.complete, "the first round")
    assert all(offer["kind"] == "topic" for offer in plain.offers.values())
    mine = peer(services=["/s/right/a", "/secret/**"])
    mine.find("/s/right/a")
    mine.until(lambda: mine.complete, "the first round")
    names = {offer["name"] for offer in mine.offers.values() if offer["kind"] == "service"}
    assert names == {"/s/right/a"}


def parts_of(action):
    return {
        f"{action}/_action/{part}"
        for part in ("send_goal", "cancel_goal", "get_result", "feedback", "status")
    }


def test_an_action_is_its_five_parts(world, peer):
    interfaces = pytest.importorskip("connect_bridge_test_interfaces.action")
    server = ActionServer(world.graph.tester, interfaces.Fibonacci, "/a/fib", lambda goal: None)
    try:
        mine = peer(actions=["/a/*"])
        mine.find("/a/fib/_action/status")
        found = {o["name"]: o for o in mine.offers.values() if o["name"].startswith("/a/")}
        assert set(found) == parts_of("/a/fib")
        assert {offer["action_type"] for offer in found.values()} == {
            "connect_bridge_test_interfaces/action/Fibonacci"
        }
        assert found["/a/fib/_action/feedback"]["kind"] == "topic"
        # An unknown goal is rejected by the real server.
        cancel = attached(mine, "/a/fib/_action/cancel_goal")
        answer = mine.call(cancel, b"\0\1\0\0" + bytes(range(16)) + bytes(8))
        assert answer[4] == 2  # ERROR_UNKNOWN_GOAL_ID
        # Neither patterns of topics and services nor those of a part allow it.
        other = peer(
            services=["/**", "/**/_action/*", "/a/fib/_action/send_goal"],
            imports=["/**", "/a/fib/_action/status"],
            actions=["/a/fib/_action/send_goal"],
        )
        other.until(lambda: other.complete, "the first round")
        assert not {o["name"] for o in other.offers.values()} & parts_of("/a/fib")
    finally:
        in_graph(world, server.destroy)
    mine.until(
        lambda: not {o["name"] for o in mine.offers.values()} & parts_of("/a/fib"),
        "withdraw of all five",
    )


def test_parameters_of_a_node_that_is_named(world, peer):
    nodes = [
        world.graph.node(name, start_parameter_services=True) for name in ("open_node", "closed")
    ]
    for node in nodes:
        node.declare_parameter("speed", 1)
    try:
        mine = peer(parameters=["/**"])
        get = attached(mine, "/open_node/get_parameters")
        answer = mine.call(get, names_request("speed"))
        assert struct.unpack_from("<IB", answer, 4) == (1, 2)  # one value, an integer
        channel = mine.find(PARAMETER_EVENTS)
        mine.until(lambda: mine.complete, "the first round")

        def offered():
            return {o["name"] for o in mine.offers.values() if o["kind"] == "service"}

        mine.until(lambda: len(offered()) >= 6, "the services, which a graph may show late")
        services = offered()
        assert len(services) == 6 and {n.rsplit("/", 1)[0] for n in services} == {"/open_node"}
        assert {origin["node"] for origin in mine.offers[channel]["origins"]} == {"/open_node"}
        mine.demand(channel)

        def event_arrives():
            for number, node in enumerate(nodes):
                node.set_parameters([rclpy.parameter.Parameter("speed", value=number)])
            time.sleep(0.05)
            return mine.samples.get(channel)

        until(event_arrives, "an event")
        assert all(b"/open_node\0" in s.data for s in mine.samples[channel])
        other = peer(services=["/**", "/open_node/*", "/**/get_parameters"], imports=["/**"])
        other.until(lambda: other.complete, "the first round")
        offered = {offer["name"] for offer in other.offers.values()}
        assert not offered & services and PARAMETER_EVENTS not in offered
    finally:
        for node in nodes:
            world.graph.remove(node)


FIB = "connect_bridge_test_interfaces/action/Fibonacci"


@pytest.mark.parametrize(
    "name, kind, more",
    [
        ("/not/allowed", SET_BOOL, {}),
        ("/p/bad//name", SET_BOOL, {}),
        ("/p/type", "std_msgs/msg/String", {}),
        ("/p/type", "no type", {}),
        ("/p/node/get_parameters", GET_PARAMETERS, {}),
        ("/open_node/get_parameters", SET_BOOL, {}),
        ("/open_node/get_parameters", GET_PARAMETERS, {}),  # its parameters are exported only
        ("/p/fib/_action/send_goal", f"{FIB}_SendGoal", {}),
        ("/p/fib/_action/send_goal", f"{FIB}_SendGoal", {"action_type": FIB}),
        ("/b/fib/_action/send_goal", f"{FIB}_SendGoal", {"action_type": "other/action/Type"}),
        ("/b/fib/_action/cancel_goal", "action_msgs/srv/CancelGoal", {}),
        ("/b/fib/_action/cancel_goal", SET_BOOL, {"action_type": FIB}),
        ("/b/fib/_action/anything", SET_BOOL, {"action_type": FIB}),
    ],
)
def test_services_that_are_declined(peer, name, kind, more):
    mine = peer()
    mine.until(lambda: mine.complete, "opening")
    channel = mine.serve(name, kind, None, **more)
    mine.until(lambda: channel in mine.declined, "decline")
    assert mine.declined[channel][0] == "not_permitted"
    assert not mine.served[channel].requests
