"""A bad line between client and server: cut, silent, and back; always without a restart."""

import contextlib
import threading
import time

import pytest
from connect_bridge_test_interfaces.msg import Blob
from geometry_msgs.msg import Twist, Vector3
from std_msgs.msg import String

from action_msgs.msg import GoalStatus
from actions import Client, FibonacciServer, Goal
from calls import OPEN_CALLS, servers_graph
from conftest import OPEN
from graph import connect, qos, until

PARTS = 2  # that run side by side
SOON_DEAD = {"dead_after": 1.0}


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
#What one break leaves behind does not hinder the next one.
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


@contextlib.contextmanager
def awaited_result(pair, name, seconds):
    """A goal of so many seconds, whose client waits for the result: a list of that."""
    robot = servers_graph(pair, 4)
    server = FibonacciServer(robot, name)
    client = Client(pair.operator, name)
    until(client.server_is_ready, "the action is ready")
    goal = Goal(client, 20, period_ms=int(seconds * 1000 / 19))
    assert goal.handle.accepted
    results = []
    thread = threading.Thread(target=lambda: results.append(goal.result(30)))
    thread.start()
    yield results, client
    thread.join()
    client.destroy()
    server.stop()
    robot.close()


def test_a_result_outlasts_a_break(relayed):
    """The link is gone for three times dead_after while the goal runs, and its client gets the
    result."""
    pair, relay = relayed(server={**OPEN_CALLS, **SOON_DEAD}, client=SOON_DEAD)
    with awaited_result(pair, "/a/long", 6) as (results, client):
        time.sleep(1)
        relay.cut()
        until(lambda: not client.server_is_ready(), "the action has vanished")
        time.sleep(2)
        relay.heal()
        until(lambda: results, "a result", 20)
    assert results[0].status == GoalStatus.STATUS_SUCCEEDED
    assert len(results[0].result.sequence) == 21
    assert pair.client.status()["made_unanswered"] == 0


def test_a_goal_is_aborted_when_the_break_is_too_long(relayed):
    pair, relay = relayed(
        server={**OPEN_CALLS, **SOON_DEAD}, client={**SOON_DEAD, "resume": {"seconds": 2.0}}
    )
    with awaited_result(pair, "/a/longer", 10) as (results, _):
        time.sleep(1)
        relay.cut()
        until(lambda: results, "an end", 10)
    assert results[0].status == GoalStatus.STATUS_ABORTED
    assert pair.client.status()["made_unanswered"] == 1
    assert "get no answer" in pair.client.text(whole=True)


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
