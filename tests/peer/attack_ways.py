"""How the connections of an attack come to the server: as they are, or through a proxy that tells,
or does not, for whom it connects. What a proxy would put before a connection (the PROXY protocol,
version 2) is made here."""

import ipaddress
import random
import struct

SIGNATURE = b"\r\n\r\n\0\r\nQUIT\n"
LOCAL, PROXY, TCP4 = 0x20, 0x21, 0x11
OPERATOR_ADDRESS, ATTACKER_ADDRESS = "192.0.2.1", "203.0.113.5"
CLIENTS = ipaddress.ip_network("198.18.0.0/15")

DIRECT, TOLD, TOLD_ONE, UNTOLD = "direct", "told", "told_one", "untold"
WAYS = {
    DIRECT: "without a proxy, all from one address of the loopback",
    TOLD: "through a proxy that tells addresses; each connection of the attacker has another one",
    TOLD_ONE: "through a proxy that tells addresses; the attacker has one",
    UNTOLD: "through a proxy that tells nothing",
}


def header(way, address):
    """What the proxy says before the first byte of a connection from this address."""
    if way == DIRECT:
        return b""
    if way == UNTOLD:
        return SIGNATURE + struct.pack(">BBH", LOCAL, 0, 0)
    ends = ipaddress.ip_address(address).packed + bytes([10, 0, 0, 1])
    return SIGNATURE + struct.pack(">BBH", PROXY, TCP4, 12) + ends + struct.pack(">HH", 50000, 443)


def attackers_header(way):
    another = CLIENTS[random.randrange(CLIENTS.num_addresses)]
    return header(way, another if way == TOLD else ATTACKER_ADDRESS)


def listen_parameters(way):
    """What the server is told of the proxy."""
    if way == DIRECT:
        return {}
    return {"trusted_proxies": ["127.0.0.1"], "proxy_header": "proxy_protocol"}
