"""A peer of the ROS2 Connect protocol, written from docs/protocol.md alone.

connect_records, connect_control and connect_packets encode and decode; this is a client that is
logged in: sections 2, 4, 7, 8, 9 and 10.
"""

import secrets
import threading
import time

from websockets.exceptions import ConnectionClosed

from connect_asking import Asking
from connect_calls import Calls
from connect_control import (
    ORIGINS_MAX,
    PARAMETER_EVENTS,
    decode_control,
    encode_control,
    is_accepted,
    offer_messages,
)
from connect_listeners import Listening
from connect_packets import Reassembly, TextHistory, decode_packet, encode_packet
from connect_records import (
    ILLEGAL,
    SILENT,
    TOO_LARGE,
    UNKNOWN_CHANNEL,
    Refused,
    decode_welcome,
    encode_hello,
    encode_login,
    require,
)
from connect_renew import Renewals
from connect_socket import open_socket

WINDOW = 16 << 20
ACK_BYTES, ACK_AFTER = 1 << 20, 0.1
TIMING = ("ack", "ack_request", "time_request", "time_reply")


class Sample:
    def __init__(self, head, data):
        self.origin, self.sequence, self.stamp = head["origin"], head["sequence"], head["stamp_ns"]
        self.codec, self.data = head["codec"], data


class Peer(Renewals, Listening, Asking, Calls):
    """A client that is logged in. A thread reads, answers, acknowledges and sends time requests."""

    def __init__(
        self,
        url,
        token,
        imports=("/**",),
        exports=(),
        session=bytes(16),
        side=None,
        seen=None,
        dead_after=3.0,
        services=(),
        actions=(),
        parameters=(),
        message_bytes_max=None,
        first_round=None,
        node="/python_peer",
    ):
        super().__init__()
        self.node = node
        self.side = side or secrets.token_bytes(16)
        self.rules = [{"topics": list(imports), "types": []}]
        for key, patterns in (
            ("services", services),
            ("actions", actions),
            ("parameters", parameters),
        ):
            if patterns:
                self.rules[0][key] = list(patterns)
        self._first_round = first_round  # called with the peer, offers in addition to `exports`
        self.last_number = 0  # of the channels of this side
        self.exports = list(exports)  # (name, type, durability)
        self.dead_after = dead_after
        self.accepts = None  # the peer's
        self.offers, self.complete, self.withdrawn = {}, False, set()  # of the peer
        self.offered, self.demanded, self.declined, self.demands = {}, {}, {}, []  # of this side
        self._demands, self._demand_of = 0, {}  # of the channels of the peer
        self.samples, self.frames, self.times = {}, [], []
        self.seen = {} if seen is None else seen  # of the link: newest number per mirror
        self.sent_bytes = self.acked = self.received_bytes = self.arrived_ns = 0
        self.acks_received, self.acks_sent, self.asked_at = [], [], []
        self.closed = None  # code and reason
        self.mute = self.deaf = False  # for tests: send nothing by itself; send no ack
        self._acked_to_peer, self._ack_due, self._sequences = 0, None, {}
        self._reassembly = Reassembly()
        self._texts = TextHistory()
        self._changed = threading.Condition(threading.RLock())
        self._sending = threading.Lock()
        self._asked = set()
        self._log_in(url, token, session)
        assert self.welcome["side"] != self.side
        limit = {} if message_bytes_max is None else {"message_bytes_max": message_bytes_max}
        self.send_control(type="accepts", rules=self.rules, deny=[], **limit)
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _log_in(self, url, token, session):
        self.socket = open_socket(url)
        self.socket.send(encode_hello(side=self.side, session=session, node=self.node))
        self.socket.send(encode_login("token", token))
        try:
            self.welcome = decode_welcome(self.socket.recv(timeout=10))
        except ConnectionClosed as error:
            self.closed = error.rcvd and (error.rcvd.code, error.rcvd.reason)
            raise

    # -- sending

    def send_control(self, **message):
        self.socket.send(encode_control(message))

    def send_packet(self, frames):
        self.send_raw(
            encode_packet(frames), wait=any(frame["type"] not in TIMING for frame in frames)
        )

    def send_raw(self, data, wait=False):
        if wait:
            self.until(
                lambda: self.sent_bytes - self.acked + len(data) < WINDOW, "room in the window"
            )
        with self._sending:
            self.sent_bytes += len(data)
            self.socket.send(data)

    def ask_time(self):
        t1 = time.time_ns()
        self._asked.add(t1)
        self.send_packet([dict(type="time_request", t1=t1)])
        return t1

    def next_number(self):
        with self._changed:
            self.last_number += 1
            return self.last_number

    def offer(self, name, kind, durability="volatile", complete=None, **more):
        """Offers a topic with one origin, and returns its channel."""
        with self._changed:
            channel = self.next_number()
            self.offered[channel] = name
        qos = {"reliability": "reliable", "durability": durability, "depth": 10}
        origin = {
            "origin": 1,
            "gid": (self.side + channel.to_bytes(2, "big")).ljust(24, b"\0").hex(),
            "node": "/python",
            "qos": qos,
        }
        described = {
            "channel": channel,
            "kind": "topic",
            "name": name,
            "type": kind,
            "origins": [origin],
            **more,
        }
        for message in offer_messages(described, complete):
            self.send_control(**message)
        return channel

    def channel_of(self, name):
        """The channel of a topic that this side offers, once there is demand for it."""

        def demanded():
            return next(
                (c for c, topic in self.offered.items() if topic == name and c in self.demanded),
                None,
            )

        return self.until(demanded, f"demand for {name}")

    def publish(self, channel, sample, **options):
        for frame in self.frames_for(channel, sample, **options):
            self.send_packet([frame])

    # -- receiving

    def until(self, condition, what, timeout=15.0):
        end = time.monotonic() + timeout
        with self._changed:
            while not (value := condition()):
                if self.closed or time.monotonic() > end:
                    raise AssertionError(f"no {what}; closed: {self.closed}")
                self._changed.wait(0.1)
            return value

    def find(self, name):
        """The channel on which the peer offers a topic."""

        def there():
            return next((c for c, offer in self.offers.items() if offer["name"] == name), None)

        return self.until(there, f"offer of {name}")

    def demand(self, *channels, on=True, **more):
        self._demands += 1
        number = self._demands if on else 0
        self._demand_of.update(dict.fromkeys(channels, number))
        if "after" in more:
            self._reassembly.go_on(dict.fromkeys(channels, more["after"]))
        demands = [dict(channel=channel, number=number, **more) for channel in channels]
        self.send_control(type="demand", channels=demands)

    def wait_samples(self, channel, count=1):
        return self.until(
            lambda: len(self.samples.get(channel, ())) >= count and self.samples[channel],
            f"{count} samples",
        )

    def wait_closed(self, timeout=10.0):
        """The code with which the peer closed."""
        self._thread.join(timeout)
        assert self.closed, "still open"
        return self.closed[0]

    def close(self, code=1000):
        self.socket.close(code)
        self._thread.join(5)

    def drop(self):
        """The connection is lost."""
        self.socket.socket.shutdown(2)
        self._thread.join(5)

    def _run(self):
        heard = asked = time.monotonic()
        try:
            while True:
                now = time.monotonic()
                if not self.mute and now - asked >= self.dead_after / 3.5:
                    self.ask_time()
                    asked = now
                if self._ack_due and now >= self._ack_due:
                    self._send_ack()
                if now - heard > self.dead_after:
                    raise Refused(SILENT, "nothing heard")
                try:
                    message = self.socket.recv(timeout=0.02)
                except TimeoutError:
                    continue
                heard = time.monotonic()
                with self._changed:
                    (self._control if isinstance(message, str) else self._packet)(message)
                    self._changed.notify_all()
        except ConnectionClosed as error:
            closed = (error.rcvd.code, error.rcvd.reason) if error.rcvd else (1006, "lost")
        except Refused as refused:
            self.socket.close(refused.code, refused.why)
            closed = (refused.code, f"by this side: {refused.why}")
        with self._changed:
            self.closed = closed
            self._changed.notify_all()

    def _send_ack(self):
        self._ack_due = None
        if not self.deaf:
            count = self._acked_to_peer = self.received_bytes
            self.acks_sent.append(count)
            self.send_packet([dict(type="ack", received_bytes=count, arrived=self.arrived_ns)])

    def _control(self, text):
        message = decode_control(text)
        getattr(self, "_on_" + message["type"])(message)

    def _on_accepts(self, message):
        first, self.accepts = self.accepts is None, message
        if first:
            for name, kind, durability in self.exports:
                if is_accepted(message, name, kind):
                    self.offer(name, kind, durability)
            if self._first_round:
                self._first_round(self)
            self.send_control(type="offer", channels=[], complete=True)

    def _on_offer(self, message):
        for channel in message["channels"]:
            number = channel["channel"]
            require(number not in self.offers, "number in use", ILLEGAL)
            self.offers[number] = channel
            require(not self.expects(number), "number in use", ILLEGAL)
            if channel["kind"] not in ("topic", "service"):
                self.send_control(type="decline", channel=number, code="unsupported")
            elif not self._is_permitted(channel):
                self.send_control(type="decline", channel=number, code="not_permitted")
        self.complete = self.complete or message.get("complete", False)

    def _is_permitted(self, channel):
        name = channel["name"]
        node = None
        if name == PARAMETER_EVENTS:
            if not channel["origins"]:
                return bool(self.rules[0].get("parameters"))
            node = channel["origins"][0].get("node", "")
        accepts = {"rules": self.rules, "deny": []}
        action = channel.get("action_type", "")
        return is_accepted(accepts, name, channel["type"], channel["kind"], action, node)

    def _on_origins(self, message):
        number = message["channel"]
        require("origins" in self.offers.get(number, ()), "no such channel", UNKNOWN_CHANNEL)
        origins = self.offers[number]["origins"]
        origins[:] = [origin for origin in origins if origin["origin"] not in message["removed"]]
        known = {origin["origin"]: origin for origin in origins}
        for origin in message["added"]:
            there = known.setdefault(origin["origin"], origin)
            there["node"] = there.get("node") or origin.get("node", "")
        origins[:] = known.values()
        require(len(origins) <= ORIGINS_MAX, "too many origins", TOO_LARGE)

    def _on_withdraw(self, message):
        for number in message["channels"]:
            self._reassembly.forget(number)
            if self._requests_withdrawn(number):
                self.withdrawn.add(number)
                continue
            require(number in self.offers, "no such channel", UNKNOWN_CHANNEL)
            del self.offers[number]
            self.withdrawn.add(number)
            self._service_withdrawn(number)

    def _on_demand(self, message):
        for demand in message["channels"]:
            self.demands.append(demand)
            number = demand["channel"]
            if number in self.offered:
                self.demanded.pop(number, None)
                if demand["number"]:
                    self.demanded[number] = demand["number"]

    def _on_findings(self, message):
        """What the side finds is for people."""

    def _on_wheel(self, message):
        """Who steers is of no interest here."""

    def _on_decline(self, message):
        self.declined[message["channel"]] = message["code"], message.get("reason", "")

    def _packet(self, data):
        arrival = time.time_ns()
        self.received_bytes += len(data)
        self.arrived_ns = time.monotonic_ns()
        frames = decode_packet(data)
        for frame in frames:
            if frame["type"] in ("message", "part"):
                self._data(frame)
            elif frame["type"] == "texts":
                for text in self._texts.read(frame):
                    self._control(text)
            elif frame["type"] == "ack":
                require(
                    frame["received_bytes"] <= self.sent_bytes, "ack of more than was sent", ILLEGAL
                )
                self.acked = max(self.acked, frame["received_bytes"])
                self.acks_received.append((time.monotonic(), frame["received_bytes"]))
            elif frame["type"] == "time_request":
                self.asked_at.append(time.monotonic())
                if not self.mute:
                    reply = dict(t1=frame["t1"], t2=arrival, t3=time.time_ns(), ros=0)
                    self.send_packet([dict(reply, type="time_reply")])
            elif frame.get("t1") in self._asked:
                self._asked.discard(frame["t1"])
                self.times.append(dict(frame, t4=arrival))
        if any(frame["type"] not in TIMING for frame in frames):
            self._ack_due = self._ack_due or time.monotonic() + ACK_AFTER * 0.7
        open_bytes = self.received_bytes - self._acked_to_peer
        if dict(type="ack_request") in frames or open_bytes >= ACK_BYTES:
            self._send_ack()

    def _data(self, frame):
        number = frame["channel"]
        expected = self.expects(number)
        require(expected or number in self.offers, "data for no channel", UNKNOWN_CHANNEL)
        self.frames.append((number, frame["type"], len(frame["part"])))
        done = self._reassembly.add(frame)
        if not done:
            return
        head, data = done
        if expected:
            self._on_request(number, head, data)
            return
        channel = self.offers[number]
        if channel["kind"] == "service":
            return self._on_response(number, head, data)
        if head["demand"] != self._demand_of.get(number):
            return
        origin = next((o for o in channel["origins"] if o["origin"] == head["origin"]), None)
        if origin is None or len(data) < 4 or data[0] or data[1] > 0x0B:
            return
        if origin["qos"].get("durability") == "transient_local":
            mirror = channel["name"], channel["type"], origin["gid"]
            if head["number"] and head["number"] <= self.seen.get(mirror, 0):
                return
            self.seen[mirror] = head["number"]
        self.samples.setdefault(number, []).append(Sample(head, data))
