"""A bad line between client and server: cut, silent, and back. All of it without a restart."""

import threading
import time

import pytest
from connect_bridge_test_interfaces.msg import Blob
from std_msgs.msg import String

from graph import connect, qos, until
from relay import Relay

PARTS = 2  # that run side by side

PARTS = 2  # that run side by side


@pytest.fixture
def relayed(make_pair):
    """relayed(**options): a pair with a relay between its sides."""
    relays = []

    def make(**options):
        pair = make_pair(start=False, **options)
        relay = Relay(pair.bridge.port)
        relays.append(relay)
        url = f"ws://127.0.0.1:{relay.port}"
        pair.client.set_parameters({**pair.client.parameters, "url": url})
        pair.bridge.start()
        return pair, relay

    yield make
    for relay in relays:
        relay.close()


def gone_after(graph, topic, timeout=10):
    begin = time.monotonic()
    until(lambda: not graph.publishers(topic), f"{topic} vanishes", timeout)
    return time.monotonic() - begin


def back_after(publisher, collector, timeout=10):
    """Seconds until something that is published now arrives."""
    collector.clear()
    begin = time.monotonic()
    while not collector.messages:
        assert time.monotonic() - begin < timeout, "nothing comes back"
        publisher.publish(String(data="back"))
        time.sleep(0.02)
    return time.monotonic() - begin


@pytest.mark.slow
@pytest.mark.parametrize("how", ["cut", "stall"])
def test_dead_after_3_s_and_back_within_2_s(relayed, how):
    """With the defaults: what users get."""
    pair, relay = relayed()
    down, received = pair.opened(String, "/t/down", String(data="x"))
    up, arrived = pair.opened(String, "/o/up", String(data="x"), backward=True)
    for _ in range(2):
        getattr(relay, how)()
        times = [0.0, 0.0]
        threads = []
        for i, (graph, topic) in enumerate([(pair.operator, "/t/down"), (pair.robot, "/o/up")]):

            def measure(i=i, graph=graph, topic=topic):
                times[i] = gone_after(graph, topic)

            threads.append(threading.Thread(target=measure))
            threads[-1].start()
        for thread in threads:
            thread.join()
        assert all(2.0 < t < 4.5 for t in times), f"mirrors vanished after {times} s"
        relay.heal()
        begin = time.monotonic()
        pair.operator.wait_publishers("/t/down", 1)
        pair.robot.wait_publishers("/o/up", 1)
        mirrored = time.monotonic() - begin
        assert mirrored < 2.0, f"mirrors were back after {mirrored:.2f} s"
        connect(down, received, String(data="x"))
        connect(up, arrived, String(data="x"))


def test_a_short_silence_is_survived(relayed):
    """Shorter than dead_after: the same connection goes on, its messages are late, not lost."""
    pair, relay = relayed()
    publisher, collector = pair.opened(Blob, "/t/steady", Blob(), qos(100))
    connections = relay.connections
    relay.stall()
    for sequence in range(1, 31):
        publisher.publish(Blob(sequence=sequence))
        time.sleep(0.05)
    relay.heal(keep=True)
    collector.wait(30)
    assert [m.sequence for m in collector.messages] == list(range(1, 31))
    assert relay.connections == connections


def test_a_break_reconnects_at_once(relayed):
    """The connection ends, the network is there: mirrors stay, messages flow again soon."""
    pair, relay = relayed()
    publisher, collector = pair.opened(String, "/t/steady", String(data="x"))
    (mirror,) = pair.operator.publishers("/t/steady")
    for _ in range(5):
        relay.break_connections()
        assert back_after(publisher, collector) < 2
    (same,) = pair.operator.publishers("/t/steady")
    assert list(same.endpoint_gid) == list(mirror.endpoint_gid), "the mirror was made anew"


@pytest.mark.slow
def test_a_cut_of_many_seconds(relayed):
    """The back-off has a ceiling: after a long time the link is back as quickly."""
    pair, relay = relayed()
    publisher, collector = pair.opened(String, "/t/steady", String(data="x"))
    relay.cut()
    time.sleep(12)
    relay.heal()
    assert back_after(publisher, collector) < 2.5


def test_the_server_forgets_a_client_that_vanished(relayed):
    """kill -9 behind a silent line: the server learns it from silence alone."""
    pair, relay = relayed()
    pair.operator.publisher(String, "/o/up")
    pair.robot.wait_publishers("/o/up", 1)
    relay.stall()
    pair.client.kill()
    pair.robot.wait_publishers("/o/up", 0, 6)
    until(lambda: not pair.server.links(), "the link is gone from the status", 10)
    relay.heal()
    pair.client.start().wait_linked()
    pair.robot.wait_publishers("/o/up", 1)


def test_topics_that_change_during_a_cut(relayed):
    """What comes and goes meanwhile is as it should be afterwards."""
    pair, relay = relayed()
    goes = pair.robot.publisher(String, "/t/goes")
    pair.operator.wait_publishers("/t/goes", 1)
    relay.break_connections()
    relay.cut()
    pair.robot.tester.destroy_publisher(goes)
    comes = pair.robot.publisher(String, "/t/comes")
    time.sleep(0.5)
    relay.heal()
    connect(comes, pair.operator.collector(String, "/t/comes"), String(data="new"))
    pair.operator.wait_publishers("/t/goes", 0)


def test_flapping(relayed):
    """A line that breaks every 100 ms for a while: no crash, no pile-up, and then all is well."""
    pair, relay = relayed()
    publisher, collector = pair.opened(Blob, "/t/steady", Blob())
    for sequence in range(1, 51):
        relay.break_connections()
        publisher.publish(Blob(sequence=sequence, data=bytes(50_000)))
        time.sleep(0.1)
    connect(publisher, collector, Blob())
    assert len(pair.server.links()) <= 1
    seen = [m.sequence for m in collector.messages]
    assert len(seen) == len(set(seen))
