"""An identity that may only look changes nothing, whatever its own implementation sends."""

import pytest
from std_msgs.msg import String

from connect_peer import Peer
from graph import until
from peer_services import SET_BOOL, TRUE, Service
from peer_world import STRING, World, cdr_string, message, token_of

FIB = "connect_bridge_test_interfaces/action/Fibonacci"
DRIVE = {
    "import_topics": ["/o/**"],
    "export_services": ["/s/**"],
    "import_services": ["/p/**"],
    "export_actions": ["/a/**"],
    "import_actions": ["/b/**"],
    "parameters": ["/tester"],
    "identities": ["driver"],
}


@pytest.fixture(scope="module")
def rights(tmp_path_factory):
    rules = {"look": {"export_topics": ["/t/**"]}, "drive": DRIVE}
    world = World(
        tmp_path_factory.mktemp("watcher"), ("watcher", "driver"), rules=list(rules), rule=rules
    )
    yield world
    world.close()


def offered_services(peer):
    return {offer["name"] for offer in peer.offers.values() if offer["kind"] != "topic"}


def test_a_watcher_only_looks(rights):
    heard = rights.graph.collector(String, "/o/order")
    seen = rights.graph.publisher(String, "/t/seen")
    service = Service(rights, "/s/switch")
    everything = {kind: ["/**"] for kind in ("services", "actions", "parameters")}
    watcher = Peer(rights.url, token_of("watcher"), **everything)
    driver = Peer(rights.url, token_of("driver"), **everything)

    # A driver has what a watcher has not, so all of it is there to be had.
    driver.until(lambda: "/s/switch" in offered_services(driver), "the service")
    switch = driver.attach(driver.find("/s/switch"))
    driver.call(switch, TRUE)
    order = driver.offer("/o/order", STRING)
    driver.until(lambda: order in driver.demanded, "demand")
    number = driver.offers[driver.find("/s/switch")]["channel"]

    channel = watcher.find("/t/seen")
    watcher.demand(channel)
    until(lambda: (seen.publish(String(data="look")), watcher.samples.get(channel))[1], "a sample")
    assert not offered_services(watcher)

    # It offers what would change something: a topic, a service, the parts of an action.
    tries = [
        watcher.offer("/o/order", STRING),
        watcher.offer("/t/seen", STRING),
        watcher.serve("/p/switch", SET_BOOL, None),
        watcher.serve("/s/switch", SET_BOOL, None),
        watcher.serve("/tester/set_parameters", "rcl_interfaces/srv/SetParameters", None),
        watcher.serve("/b/fib/_action/send_goal", f"{FIB}_SendGoal", None, action_type=FIB),
    ]
    for one in tries:
        watcher.until(lambda one=one: one in watcher.declined, f"decline of {one}")
        assert watcher.declined[one][0] == "not_permitted"
    # It sends all the same, and calls by a number that another link's channel has.
    for frame in message(tries[0], 1, cdr_string("go")), message(tries[2], 1, TRUE):
        watcher.send_packet([frame])
    watcher.send_control(type="attach", channel=number, requests=watcher.next_number())
    assert watcher.wait_closed() == 4010

    assert len(service.requests) == 1  # the driver's
    driver.publish(order, cdr_string("of the driver"))
    heard.wait_for(lambda m: m.data == "of the driver")
    assert [m.data for m in heard.messages] == ["of the driver"]
    driver.close()
