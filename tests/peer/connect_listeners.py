"""Section 5 of docs/protocol.md, `listeners`: the listeners at the other side."""

from connect_control import LISTENERS_MAX
from connect_records import ILLEGAL, TOO_LARGE, require


class Listening:
    """The listeners that a peer receives and sends."""

    def __init__(self):
        super().__init__()
        self.listeners = {}  # of the peer's graph, by number

    def listen(self, number, name, kind, removed=()):
        """Sends that somebody at this side listens to a topic of the peer."""
        told = {"listener": number, "name": name, "type": kind}
        self.send_control(type="listeners", added=[told], removed=list(removed))

    def listeners_of(self, name):
        return [told for told in self.listeners.values() if told["name"] == name]

    def _on_listeners(self, message):
        for gone in message["removed"]:
            self.listeners.pop(gone, None)
        for told in message["added"]:
            require(told["listener"] not in self.listeners, "number in use", ILLEGAL)
            self.listeners[told["listener"]] = told
        require(len(self.listeners) <= LISTENERS_MAX, "too many listeners", TOO_LARGE)
