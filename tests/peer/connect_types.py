"""Section 5 of docs/protocol.md, `describe` and `description`: what types are made of."""

import hashlib
import json

from connect_control import DESCRIBES_MAX
from connect_records import ILLEGAL, TOO_LARGE, UNKNOWN_CHANNEL, require

INT32, FLOAT64, STRING, UINT8_SEQUENCE = 6, 11, 17, 147


def description_text(name, fields, nested=()):
    """The text of a type whose fields are (name, number of the kind)."""

    def of(name, fields):
        numbers = {"capacity": 0, "string_capacity": 0, "nested_type_name": ""}
        return {
            "type_name": name,
            "fields": [{"name": f, "type": {"type_id": kind, **numbers}} for f, kind in fields],
        }

    whole = {
        "type_description": of(name, fields),
        "referenced_type_descriptions": [of(*each) for each in nested],
    }
    return json.dumps(whole)


def hash_of(text):
    return "RIHS01_" + hashlib.sha256(text.encode()).hexdigest()


class Describing:
    """What a peer asks about types, and what it answers."""

    def __init__(self):
        super().__init__()
        self.known = {}  # descriptions that this side can give, by hash
        self.type_hashes = {}  # of the channels of this side
        self.asked = []  # channels of this side that the peer asked about
        self.descriptions = {}  # of the channels of the peer: a text, or None
        self._waiting = set()  # channels of the peer that were asked about

    def describe(self, *channels):
        """What the peer says of its channels."""
        with self._changed:
            self._waiting.update(channels)
            for channel in channels:
                self.descriptions.pop(channel, None)
        self.send_control(type="describe", channels=list(channels))
        self.until(lambda: not self._waiting & set(channels), "descriptions")
        return [self.descriptions[channel] for channel in channels]

    def _on_describe(self, message):
        for channel in message["channels"]:
            require(0 < channel <= self.last_number, "no such channel", UNKNOWN_CHANNEL)
            self.asked.append(channel)
            text = self.known.get(self.type_hashes.get(channel))
            self.send_control(
                type="description", channel=channel, **({"text": text} if text else {})
            )
        require(len(message["channels"]) <= DESCRIBES_MAX, "too many at a time", TOO_LARGE)

    def _on_description(self, message):
        channel, text = message["channel"], message.get("text") or None
        require(channel in self.offers, "no such channel", UNKNOWN_CHANNEL)
        require(channel in self._waiting, "not asked for", ILLEGAL)
        require(not text or hash_of(text) == self.offers[channel]["type_hash"], "another type")
        self._waiting.discard(channel)
        self.descriptions[channel] = text
