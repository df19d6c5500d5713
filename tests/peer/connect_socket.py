"""A WebSocket as section 2 of docs/protocol.md has it."""

from websockets.sync.client import connect as dial

from connect_records import MESSAGE_MAX

SUBPROTOCOL = "ros2-connect.v1"


def open_socket(url, **options):
    """A WebSocket before login."""
    options = {
        "subprotocols": [SUBPROTOCOL],
        "compression": None,
        "max_size": MESSAGE_MAX,
        "ping_interval": None,
        **options,
    }
    socket = dial(url, **options)
    assert socket.subprotocol == options["subprotocols"][0]
    return socket
