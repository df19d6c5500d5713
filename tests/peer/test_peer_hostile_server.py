"""What a server may try with a client: one that was broken into, or that is not the right one."""

import time

import pytest
from connect_bridge_test_interfaces.action import Fibonacci
from graph import Graph, until
from harness.domains import free_port, release_domains, take_domains
from harness.programs import Side
from rcl_interfaces.msg import ParameterEvent
from rclpy.action import ActionServer
from std_msgs.msg import String
from std_srvs.srv import SetBool

from connect_control import PARAMETER_EVENTS
from connect_server import Host, Listener
from peer_world import event_of

TOKEN = "token-of-the-operator"
DEAD_AFTER = 60.0  # nothing here is about that, and a machine may be busy


class Operator:
    """A client with its graph, and a port for its server."""

    def __init__(self, folder):
        self.domains = take_domains(1)
        self.graph = Graph(self.domains[0])
        self.port = free_port()
        parameters = {
            "url": f"ws://127.0.0.1:{self.port}",
            "auth": {"method": "token", "token": TOKEN},
            "dead_after": DEAD_AFTER,
        }
        self.client = Side("client", self.domains[0], parameters, folder)

    def close(self):
        code = self.client.stop()
        self.graph.close()
        release_domains(self.domains)
        assert code == 0, self.client.text()


@pytest.fixture
def operator(tmp_path):
    made = Operator(tmp_path)
    yield made
    made.close()


@pytest.fixture
def listener(operator):
    made = Listener(operator.port)
    yield made
    made.close()


ALL = dict.fromkeys(("imports", "services", "actions", "parameters"), ["/**", "/_*/**"])


def test_a_client_without_rules_gives_topics_alone(operator, listener):
    graph = operator.graph
    graph.tester.create_service(SetBool, "/work", lambda request, response: response)
    with graph.still():
        action = ActionServer(graph.tester, Fibonacci, "/walk", lambda goal: None)
    graph.node("tuned", start_parameter_services=True)
    graph.publisher(String, "/words")
    operator.client.start()
    host = Host(listener, dead_after=DEAD_AFTER, **ALL)
    assert host.login == {"method": "token", "credential": TOKEN.encode()}
    host.find("/words")
    host.until(lambda: host.complete, "the first round")
    time.sleep(1)  # a service is offered some time after it is there
    graph.publisher(String, "/last_words")
    host.find("/last_words")
    assert {offer["kind"] for offer in host.offers.values()} == {"topic"}
    names = {offer["name"] for offer in host.offers.values()}
    assert PARAMETER_EVENTS not in names and not any("/_action/" in name for name in names)
    assert "/rosout" not in names
    # Nor is it enough to guess a number.
    host.send_control(type="attach", channel=4000, requests=host.next_number())
    assert host.wait_closed() == 4010
    with graph.still():
        action.destroy()


def test_a_server_does_not_speak_for_the_nodes_of_a_client(operator, listener):
    """A client without rules imports the parameters of all nodes of its server; with an event of
    one of its own it could be given another clock."""
    collector = operator.graph.collector(ParameterEvent, PARAMETER_EVENTS)
    operator.client.start()
    host = Host(listener, dead_after=DEAD_AFTER)
    host.until(lambda: host.complete, "the first round")
    gids = [(host.side + bytes([number])).ljust(24, b"\0").hex() for number in (1, 2)]
    origins = [
        {"origin": 1, "gid": gids[0], "node": "/far", "qos": {}},
        {"origin": 2, "gid": gids[1], "node": "/tester", "qos": {}},
    ]
    host.offer(PARAMETER_EVENTS, "rcl_interfaces/msg/ParameterEvent", origins=origins)
    channel = host.channel_of(PARAMETER_EVENTS)

    def arrives():
        host.publish(channel, event_of("/far"))
        time.sleep(0.02)
        return any(event.node == "/far" for event in list(collector.messages))

    until(arrives, "an event of a node that is far")
    time.sleep(1)  # a graph knows an endpoint before the name of its node
    host.publish(channel, event_of("/tester"))
    host.publish(channel, event_of("/tester"), origin=2)
    host.publish(channel, event_of("/far", 5))
    collector.wait_for(lambda event: event.stamp.sec == 5)
    assert not any(event.node == "/tester" and event.stamp.sec == 1 for event in collector.messages)
