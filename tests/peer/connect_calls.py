"""Section 9 of docs/protocol.md: calls of services of the other side, and own services."""

import time

from connect_packets import frames_of
from connect_records import ILLEGAL, UNKNOWN_CHANNEL, require

NUMBERS_END = 0xF0000000


class Attachment:
    """A service of the peer which this side may call."""

    def __init__(self, channel, requests):
        self.channel, self.requests = channel, requests
        self.attached = None  # the message
        self.answers = {}  # call: bytes
        self.refused = {}  # call: code
        self.last = 0

    def settled(self, call):
        return call in self.answers or call in self.refused


class Served:
    """A service of this side which the peer may call."""

    def __init__(self, name, epoch, handler, ready):
        self.name, self.epoch, self.handler, self.ready = name, epoch, handler, ready
        self.requests = None  # of the attachment
        self.attached = False
        self.seen = 0
        self.open = []  # calls without an answer
        self.got = []  # (call, request), in order
        self.forgotten = []


class Calls:
    """A peer's messages about services. `offers`, `offered`, send_control ... are the Peer's."""

    def __init__(self):
        self.attachments = {}  # channel of the peer: Attachment
        self.served = {}  # channel of this side: Served
        self.ended = set()  # `requests` of this side whose channel is gone
        self._expected = {}  # `requests` of the peer: own channel, None when it is gone

    # -- services of the peer

    def attach(self, channel):
        """Attaches to it, and waits until it can be called."""
        attachment = Attachment(channel, self.next_number())
        self.attachments[channel] = attachment
        self.send_control(type="attach", channel=channel, requests=attachment.requests)
        attached = self.until(lambda: attachment.attached, "attached")
        attachment.last = attached.get("seen", 0)
        return attachment

    def request(self, attachment, data, call=None, **options):
        """Sends a request and returns the call's number."""
        if call is None:
            call = attachment.last + 1
        attachment.last = max(attachment.last, call)
        for frame in self.frames_for(attachment.requests, data, origin=call, **options):
            self.send_packet([frame])
        return call

    def call(self, attachment, data, **options):
        """The answer to a request."""
        call = self.request(attachment, data, **options)
        self.until(lambda: attachment.settled(call), f"answer to call {call}")
        return attachment.answers[call]

    def detach(self, attachment):
        del self.attachments[attachment.channel]
        self.send_control(type="withdraw", channels=[attachment.requests])

    def _on_attached(self, message):
        number = message["channel"]
        require(number in self.offers, "attached to no such channel", UNKNOWN_CHANNEL)
        attachment = self.attachments.get(number)
        if attachment is None or attachment.requests != message["requests"]:
            return
        require(attachment.attached is None, "attached twice", ILLEGAL)
        require(message.get("seen", 0) < NUMBERS_END, "seen beyond all numbers", ILLEGAL)
        attachment.attached = message

    def _on_refuse(self, message):
        number = message["channel"]
        require(number in self.offers, "calls of no such channel", UNKNOWN_CHANNEL)
        attachment = self.attachments.get(number)
        for call in message["calls"] if attachment else ():
            if not attachment.settled(call):
                attachment.refused[call] = message["code"]

    def _on_response(self, number, head, data):
        attachment = self.attachments.get(number)
        call = head["origin"]
        if attachment and call <= attachment.last:
            assert not attachment.settled(call), f"call {call} is answered twice"
            attachment.answers[call] = data

    def _service_withdrawn(self, number):
        attachment = self.attachments.pop(number, None)
        if attachment:
            self.ended.add(attachment.requests)
            self.send_control(type="withdraw", channels=[attachment.requests])

    # -- services of this side

    def serve(self, name, kind, handler, ready=True, epoch=7, **more):
        """Offers a service and returns its channel. `handler` makes a response from a request;
        None: no response now."""
        with self._changed:
            channel = self.next_number()
            self.offered[channel] = name
            self.served[channel] = Served(name, epoch, handler, ready)
        described = {"channel": channel, "kind": "service", "name": name, "type": kind}
        described |= {"node": "/python", "epoch": epoch, **more}
        self.send_control(type="offer", channels=[described])
        return channel

    def become_ready(self, channel):
        with self._changed:
            self.served[channel].ready = True
            if self.served[channel].requests and not self.served[channel].attached:
                self._send_attached(channel)

    def respond(self, channel, call, data, **options):
        with self._changed:
            self.served[channel].open.remove(call)
        for frame in self.frames_for(channel, data, origin=call, **options):
            self.send_packet([frame])

    def refuse(self, channel, call, code):
        with self._changed:
            self.served[channel].open.remove(call)
        self.send_control(type="refuse", channel=channel, calls=[call], code=code)

    def wait_requests(self, channel, count=1):
        served = self.served[channel]
        self.until(lambda: len(served.got) >= count, f"{count} requests of {served.name}")
        return served.got

    def withdraw(self, channel):
        with self._changed:
            served = self.served.pop(channel)
            del self.offered[channel]
            if served.requests:
                self._expected[served.requests] = None
            self.send_control(type="withdraw", channels=[channel])

    def _send_attached(self, channel):
        served = self.served[channel]
        served.attached = True
        message = {"channel": channel, "requests": served.requests, "seen": served.seen}
        self.send_control(type="attached", **message, calls=served.open)

    def _on_attach(self, message):
        channel, requests = message["channel"], message["requests"]
        require(channel <= self.last_number, "attached to no such channel", UNKNOWN_CHANNEL)
        require(requests not in self._expected, "requests in use", ILLEGAL)
        require(requests not in self.offers, "requests in use", ILLEGAL)
        if channel not in self.offered:
            self._expected[requests] = None
            return
        require(channel in self.served, "attached to a topic", ILLEGAL)
        served = self.served[channel]
        require(not served.requests, "attached already", ILLEGAL)
        served.requests = requests
        self._expected[requests] = channel
        if served.ready:
            self._send_attached(channel)

    def _on_forget(self, message):
        channel = message["channel"]
        require(channel <= self.last_number, "forget of no such channel", UNKNOWN_CHANNEL)
        served = self.served.get(channel)
        for call in message["calls"] if served else ():
            if call in served.open:
                served.open.remove(call)
                served.forgotten.append(call)

    def _requests_withdrawn(self, number):
        """Whether this is a channel of requests; if so, it is removed."""
        if number not in self._expected:
            return False
        served = self.served.get(self._expected.pop(number))
        if served:
            served.requests, served.attached, served.open = None, False, []
        return True

    def expects(self, number):
        return number in self._expected

    def _on_request(self, number, head, data):
        channel = self._expected[number]
        if channel is None:
            return
        served, call = self.served[channel], head["origin"]
        require(served.attached, "a request before attached", ILLEGAL)
        if call <= served.seen:
            return
        served.seen = call
        served.got.append((call, data))
        served.open.append(call)
        response = served.handler(data) if served.handler else None
        if response is not None:
            self.respond(channel, call, response)

    def frames_for(self, channel, data, stamp=None, origin=1, **options):
        self._sequences[channel] = sequence = self._sequences.get(channel, 0) + 1
        stamp = time.time_ns() if stamp is None else stamp
        options.setdefault("demand", self.demanded.get(channel, 0))
        return frames_of(channel, origin, sequence, stamp, data, **options)
