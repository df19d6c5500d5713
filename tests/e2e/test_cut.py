"""A bad line between client and server: cut, silent, and back; always without a restart."""

import threading
import time

import pytest
from connect_bridge_test_interfaces.msg import Blob
from geometry_msgs.msg import Twist, Vector3
from rclpy.qos import ReliabilityPolicy
from std_msgs.msg import String

from conftest import OPEN
from graph import connect, qos, until
from relay import Relay

PARTS = 2  # that run side by side
SOON_DEAD = {"dead_after": 1.0}


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
    """With the defaults, as users have them."""
    pair, relay = relayed()
    down, received = pair.opened(String, "/t/down", String(data="x"))
    up, arrived = pair.opened(String, "/o/up", String(data="x"), backward=True)
    # What one break leaves behind does not hinder the next one.
    for _ in range(2 if how == "cut" else 1):
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
    assert list(same.endpoint_gid) == list(mirror.endpoint_gid), "the mirror was made again"


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
    """kill -9 behind a silent line: the server notices it from the silence only."""
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
    """Topics that came or went meanwhile are correct afterwards."""
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


def publish_at(publisher, seconds, first, make, rate=20):
    """The number of the last one. `make` gives the message of a number."""
    last = first + int(seconds * rate)
    begin = time.monotonic()
    for number in range(first, last):
        publisher.publish(make(number))
        time.sleep(max(0, begin + (number + 1 - first) / rate - time.monotonic()))
    return last - 1


def kilobyte(number):
    return Blob(sequence=number, data=bytes(1000))


@pytest.mark.parametrize("how", ["cut", "stall"])
def test_a_reliable_topic_goes_on_where_it_was_cut(relayed, how):
    """Three times dead_after, and a second cut while what was kept comes: all arrive, each once, in
    order. (The queue is long: a busy machine may look away for a while.)"""
    pair, relay = relayed(server={**OPEN, **SOON_DEAD}, client=SOON_DEAD)
    publisher, collector = pair.opened(Blob, "/t/steady", Blob(), qos(100))
    collector.clear()
    last = publish_at(publisher, 0.5, 1, kilobyte)
    getattr(relay, how)()
    last = publish_at(publisher, 3, last + 1, kilobyte)
    until(lambda: not pair.operator.publishers("/t/steady"), "the mirror has vanished")
    relay.heal()
    until(lambda: collector.messages[-1].sequence > 15, "what was kept comes")
    getattr(relay, how)()
    last = publish_at(publisher, 0.5, last + 1, kilobyte)
    relay.heal()
    begin = time.monotonic()
    last = publish_at(publisher, 1, last + 1, kilobyte)
    collector.wait(last, 10)
    print(f"all {last} are there {time.monotonic() - begin:.2f} s after the cut")
    time.sleep(0.5)
    assert [m.sequence for m in collector.messages] == list(range(1, last + 1))


@pytest.mark.alone
def test_a_queue_of_ten_gets_what_comes_late(relayed):
    """300 messages of a cut: at once they would leave ten of them in the usual queue. A subscriber
    that has no processor for 20 ms loses some, so nothing else runs."""
    pair, relay = relayed(server={**OPEN, **SOON_DEAD}, client=SOON_DEAD)
    publisher, collector = pair.opened(Blob, "/t/steady", Blob(), qos(10))
    collector.clear()
    relay.cut()
    last = publish_at(publisher, 3, 1, kilobyte, rate=100)
    relay.heal()
    last = publish_at(publisher, 3, last + 1, kilobyte, rate=100)
    until(lambda: collector.messages and collector.messages[-1].sequence == last, "the last one")
    seen = [m.sequence for m in collector.messages]
    assert seen == sorted(set(seen))
    assert len(seen) > 0.9 * last, f"{len(seen)} of {last}"


def test_what_is_beyond_the_bound_is_counted_and_told(relayed):
    """The oldest is lost, and the robot's side says how much."""
    small = {**SOON_DEAD, "resume.bytes": 20_000}
    pair, relay = relayed(server={**OPEN, **small}, client=SOON_DEAD)
    publisher, collector = pair.opened(Blob, "/t/steady", Blob(), qos(100))
    collector.clear()
    relay.cut()
    last = publish_at(publisher, 3, 1, kilobyte)
    relay.heal()
    until(lambda: collector.messages and collector.messages[-1].sequence == last, "the last one")
    seen = [m.sequence for m in collector.messages]
    assert seen == list(range(seen[0], last + 1)) and 10 <= len(seen) < 20, seen
    lost = seen[0] - 1
    dropped = lambda: pair.server.topic("/t/steady", "export")["dropped"]  # noqa: E731
    until(lambda: dropped().get("resume_bound") == lost, lambda: f"{dropped()}, not {lost}")
    assert f"{len(seen)} messages come late, {lost} are lost" in pair.server.text()


def test_commands_are_not_replayed_after_a_cut(relayed):
    """A Twist is urgent by its type: what was published during the cut never arrives."""
    pair, relay = relayed(server={**OPEN, **SOON_DEAD}, client=SOON_DEAD)
    publisher, collector = pair.opened(Twist, "/t/drive", Twist(), qos(10))
    relay.cut()
    for _ in range(20):
        publisher.publish(Twist(linear=Vector3(x=1.0)))
        time.sleep(0.1)
    relay.heal()
    pair.operator.wait_publishers("/t/drive", 1)
    connect(publisher, collector, Twist())
    publisher.publish(Twist(linear=Vector3(x=2.0)))
    until(lambda: any(m.linear.x == 2.0 for m in collector.messages), "the new one arrives")
    assert not [m for m in collector.messages if m.linear.x == 1.0]


def test_the_first_image_after_a_cut_is_fresh(relayed):
    """Best effort: nothing of the cut is sent."""
    pair, relay = relayed(server={**OPEN, **SOON_DEAD}, client=SOON_DEAD)
    images = qos(5, reliability=ReliabilityPolicy.BEST_EFFORT)
    publisher, collector = pair.opened(Blob, "/t/camera", Blob(), images)
    relay.cut()
    start = time.monotonic()

    def frame(_):
        return Blob(sequence=int((time.monotonic() - start) * 1000), data=bytes(50_000))

    publish_at(publisher, 3, 0, frame)
    collector.clear()
    relay.heal()

    def frames_flow():
        publish_at(publisher, 0.1, 0, frame)
        return collector.messages

    until(frames_flow, "frames flow")
    age = collector.times[0] - start - collector.messages[0].sequence / 1000
    assert age < 0.2, f"the first frame after the cut is {age:.3f} s old"


def test_a_restart_is_no_break(relayed):
    """Nothing is resumed with another process, and the log says so."""
    pair, relay = relayed(server={**OPEN, **SOON_DEAD}, client=SOON_DEAD)
    publisher, collector = pair.opened(Blob, "/o/steady", Blob(), qos(10), backward=True)
    relay.cut()
    publisher.publish(Blob(sequence=1))
    pair.server.kill()
    pair.server.start()
    relay.heal()
    connect(publisher, collector, Blob())
    publisher.publish(Blob(sequence=2))
    until(lambda: any(m.sequence == 2 for m in collector.messages), "new messages flow")
    assert not [m for m in collector.messages if m.sequence == 1]
    until(lambda: "it was started again" in pair.client.text(), "the client's log")
