"""A ROS graph as its nodes see it: rclpy nodes in one domain id, in a context of their own."""

import contextlib
import os
import pathlib
import subprocess
import threading
import time
import traceback
from unittest import mock

import rclpy
from connect_bridge_test_interfaces.msg import Everything
from harness.programs import build_dir, rmw_of
from rclpy.exceptions import InvalidHandle
from rclpy.executors import (
    ExternalShutdownException,
    MultiThreadedExecutor,
    SingleThreadedExecutor,
)
from rclpy.node import Node
from rclpy.qos import QoSProfile

WAIT = 20.0  # time limit in seconds on a busy machine; a passing test takes milliseconds
_ended = {}  # graph -> why its callbacks run no longer
# With Fast DDS's defaults a process that starts is at times known only when the others announce
# themselves again, up to 3 s later: most of a test with a restart would be that wait. This is for
# the nodes of a Graph alone: the programs, and nodes in processes of their own, have what users
# have.
_PROFILE = str(pathlib.Path(__file__).with_name("soon_known.xml"))
_SOON_KNOWN = {"FASTDDS_DEFAULT_PROFILES_FILE": _PROFILE}


def until(condition, what, timeout=WAIT, step=0.01):
    """Waits until the condition holds and returns what it returned."""
    end = time.monotonic() + timeout
    while True:
        value = condition()
        if value:
            return value
        if _ended:  # otherwise a wait for a callback would look like a lost message
            raise AssertionError("\n".join(_ended.values()))
        if time.monotonic() > end:
            raise AssertionError(f"not within {timeout:g} s: {what() if callable(what) else what}")
        time.sleep(step)


def here(seconds):
    """A limit for a program, in seconds: as given where nothing else runs. Others may keep the
    machine busy: then as many times longer as a program that only tells its version needs more
    than 0.1 s, several times what it needs alone."""
    begin = time.monotonic()
    subprocess.run([build_dir() / "server", "--version"], check=True, capture_output=True)
    return seconds * max(1.0, (time.monotonic() - begin) / 0.1)


class Collector:
    """What one subscription received, in order. Messages of other runs can be cleared."""

    def __init__(self, node, kind, topic, qos, raw=False):
        self.topic = topic
        self.messages = []
        self.times = []
        self._node = node
        self._subscription = node.create_subscription(kind, topic, self._received, qos, raw=raw)

    def _received(self, message):
        self.times.append(time.monotonic())
        self.messages.append(message)

    def wait(self, count=1, timeout=WAIT):
        """The messages, once there are so many."""
        until(
            lambda: len(self.messages) >= count,
            lambda: f"{count} messages on {self.topic}, there are {len(self.messages)}",
            timeout,
        )
        return self.messages

    def wait_for(self, condition, what="a message", timeout=WAIT):
        until(
            lambda: any(condition(m) for m in list(self.messages)),
            f"{what} on {self.topic}",
            timeout,
        )

    def clear(self):
        self.messages.clear()
        self.times.clear()

    def close(self):
        self._node.destroy_subscription(self._subscription)


class _Pausing:
    """An executor that can be stopped from waiting for ready callbacks. Running callbacks are not
    affected."""

    def __init__(self, *arguments, **options):
        self._looks = False
        self._pauses = 0
        self._changed = threading.Condition()
        super().__init__(*arguments, **options)

    def wait_for_ready_callbacks(self, *arguments, **options):
        with self._changed:
            self._changed.wait_for(lambda: not self._pauses)
            self._looks = True
        try:
            return super().wait_for_ready_callbacks(*arguments, **options)
        finally:
            with self._changed:
                self._looks = False
                self._changed.notify_all()

    @contextlib.contextmanager
    def paused(self):
        with self._changed:
            self._pauses += 1
        try:
            self.create_task(lambda: None)  # found at once, so the wait ends
            with self._changed:
                self._changed.wait_for(lambda: not self._looks)
            yield
        finally:
            with self._changed:
                self._pauses -= 1
                self._changed.notify_all()


class _OneThread(_Pausing, SingleThreadedExecutor):
    pass


class _ManyThreads(_Pausing, MultiThreadedExecutor):
    pass


class Graph:
    """Nodes of one domain id. Callbacks run on a thread of its own; everything else on the test's.

    With `threads` they run on so many, for servers with slow callbacks."""

    def __init__(self, domain, threads=1, name="tester"):
        self.domain = domain
        self.context = rclpy.Context()
        self._nodes = []
        self._closing = False
        # harness.two_middlewares looks there, and Fast DDS at the first node of this process.
        with mock.patch.dict(os.environ, {**_SOON_KNOWN, **os.environ, **rmw_of(domain)}):
            rclpy.init(context=self.context, domain_id=domain)
            self._executor = (
                _OneThread(context=self.context)
                if threads == 1
                else _ManyThreads(threads, context=self.context)
            )
            self.tester = self.node(name)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _spin(self):
        try:
            while self.context.ok():
                with contextlib.suppress(InvalidHandle):  # destroyed by a test just then
                    self._executor.spin_once(timeout_sec=0.2)
        except ExternalShutdownException:
            pass
        except Exception:
            if not self._closing:
                _ended[self] = f"the callbacks of domain {self.domain} have come to an end:\n" + (
                    traceback.format_exc()
                )

    def still(self):
        """A context in which the executor does not wait for ready callbacks. rclpy's actions need
        it when they are created, destroyed or called: an executor that sees a half-created or
        half-destroyed one fails (ros2/rclpy#1589), and an answer that is taken before the call has
        returned is lost (ros2/rclpy#1123)."""
        return self._executor.paused()

    def node(self, name, kind=Node, **options):
        options = {"enable_rosout": False, "start_parameter_services": False, **options}
        node = kind(name, context=self.context, **options)
        self._executor.add_node(node)
        self._nodes.append(node)
        return node

    def remove(self, node):
        self._nodes.remove(node)
        self._executor.remove_node(node)
        node.destroy_node()

    def publisher(self, kind, topic, qos=10, node=None):
        return (node or self.tester).create_publisher(kind, topic, qos)

    def collector(self, kind, topic, qos=10, node=None, raw=False):
        return Collector(node or self.tester, kind, topic, qos, raw)

    def publishers(self, topic):
        """The publishers of a topic, as `ros2 topic info --verbose` shows them."""
        return self.tester.get_publishers_info_by_topic(topic)

    def subscriptions(self, topic):
        return self.tester.get_subscriptions_info_by_topic(topic)

    def topics(self):
        """Name -> types of all that is published here."""
        return {
            name: types
            for name, types in self.tester.get_topic_names_and_types()
            if self.tester.count_publishers(name)
        }

    def wait_publishers(self, topic, count, timeout=WAIT):
        until(
            lambda: len(self.publishers(topic)) == count,
            lambda: f"{count} publishers of {topic} in domain {self.domain}, there are "
            + str([f"{p.node_namespace} {p.node_name}" for p in self.publishers(topic)]),
            timeout,
        )
        return self.publishers(topic)

    def close(self):
        self._closing = True
        _ended.pop(self, None)
        for node in list(self._nodes):
            self.remove(node)
        self.context.try_shutdown()
        self._thread.join(5)
        self._executor.shutdown(0.1)


def connect(publisher, collector, message, timeout=WAIT):
    """Publishes until something arrives, waits until nothing more is on its way, and forgets it."""
    end = time.monotonic() + timeout
    while not collector.messages:
        assert time.monotonic() < end, f"nothing of {collector.topic} arrives within {timeout:g} s"
        publisher.publish(message)
        time.sleep(0.05)
    before = 0
    while before != len(collector.messages):
        before = len(collector.messages)
        time.sleep(0.2)
    collector.clear()


def everything():
    """Each kind of text, sequence and bound, with something in it."""
    return Everything(
        text="grüße",
        short_text="kurz",
        wide_text="日本",
        short_wide_text="東京",
        numbers=[1, 65535],
        few_numbers=[1, 2, 3, 4, 5],
        texts=["", "a"],
        few_texts=["b"],
        few_short_texts=["vier", ""],
        wide_texts=["日", "", "本本"],
    )


def qos(depth=10, **policies):
    return QoSProfile(depth=depth, **policies)
