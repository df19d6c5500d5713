"""A stand-in for twist_mux: the same parameters file, and the rules that its documents state."""

import time

import yaml
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool


class _Handle:
    """An input. Before its first message it has expired."""

    def __init__(self, graph, kind, entry, received=lambda handle: None):
        self.priority = entry["priority"]
        self.message = kind()
        self._timeout = entry["timeout"]
        self._received = received
        self._at = float("-inf")
        graph.tester.create_subscription(kind, entry["topic"], self._take, 10)

    def _take(self, message):
        self._at = time.monotonic()
        self.message = message
        self._received(self)

    def has_expired(self):
        return self._timeout > 0 and time.monotonic() - self._at > self._timeout


class TwistMux:
    """Publishes the fresh input of the highest priority that no lock is above. A lock that has
    expired is locked."""

    def __init__(self, graph, text):
        (parameters,) = (node["ros__parameters"] for node in yaml.safe_load(text).values())
        self._output = graph.publisher(Twist, "/cmd_vel", 10)
        self._locks = {
            name: _Handle(graph, Bool, entry)
            for name, entry in parameters.get("locks", {}).items()
        }
        self._topics = [
            _Handle(graph, Twist, entry, self._choose) for entry in parameters["topics"].values()
        ]

    def is_locked(self, name):
        lock = self._locks[name]
        return lock.has_expired() or lock.message.data

    def _choose(self, handle):
        locked = [lock.priority for name, lock in self._locks.items() if self.is_locked(name)]
        above = max(locked, default=0)
        fresh = [topic for topic in self._topics if not topic.has_expired()]
        if handle.priority >= above and handle.priority == max(topic.priority for topic in fresh):
            self._output.publish(handle.message)
