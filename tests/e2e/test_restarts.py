"""Either side ends, by request or by force, and comes back: nothing twice, nothing stuck."""

import signal
import threading
import time

import pytest
from connect_bridge_test_interfaces.msg import Blob

from graph import qos, until

PARTS = 3  # that run side by side
TIMES = 6


class Ticker:
    """Publishes numbers at a rate, on a thread of its own."""

    def __init__(self, publisher, hz=50):
        self._publisher, self._period = publisher, 1 / hz
        self._stop = threading.Event()
        self.sequence = 0
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        while not self._stop.wait(self._period):
            self.sequence += 1
            self._publisher.publish(Blob(sequence=self.sequence))

    def stop(self):
        self._stop.set()
        self._thread.join()


@pytest.mark.slow
@pytest.mark.parametrize("which", ["server", "client"])
def test_restarted_many_times_without_duplicates(make_pair, which):
    pair = make_pair()
    publisher = pair.robot.publisher(Blob, "/t/ticks", qos(100))
    collector = pair.operator.collector(Blob, "/t/ticks", qos(100))
    ticker = Ticker(publisher)
    collector.wait(1)
    side = getattr(pair, which)
    for number in range(TIMES):
        if number % 2:
            side.kill()
        else:
            assert side.stop(signal.SIGTERM, timeout=2) == 0
        gone = ticker.sequence
        side.start()
        until(
            lambda: collector.messages[-1].sequence > gone,
            f"messages after restart {number} of the {which}",
            step=0.02,
        )
    ticker.stop()
    seen = [m.sequence for m in collector.messages]
    assert len(seen) == len(set(seen)), "a message came twice"
    assert seen == sorted(seen), "a message overtook another"


@pytest.mark.slow
def test_a_killed_side_leaves_no_second_mirror(make_pair):
    """The mirrors of a killed client vanish from the graph, and are not taken for real
    publishers."""
    pair = make_pair()
    pair.robot.publisher(Blob, "/t/ticks")
    pair.operator.wait_publishers("/t/ticks", 1)
    pair.client.kill()
    pair.client.start().wait_linked()
    time.sleep(1)
    assert len(pair.robot.publishers("/t/ticks")) == 1, "the dead mirror has come to the robot"
    # The middleware itself forgets a killed process only when its lease is over.
    pair.operator.wait_publishers("/t/ticks", 1, timeout=40)


def test_the_server_is_absent_for_a_while(make_pair):
    """The client never gives up, and both start in any order."""
    pair = make_pair(start=False)
    pair.client.start()
    publisher = pair.robot.publisher(Blob, "/t/ticks")
    collector = pair.operator.collector(Blob, "/t/ticks")
    time.sleep(3)
    assert pair.client.running()
    begin = time.monotonic()
    pair.server.start().wait_listening()
    pair.client.wait_linked(5)
    ticker = Ticker(publisher)
    collector.wait(1)
    ticker.stop()
    assert time.monotonic() - begin < 5
