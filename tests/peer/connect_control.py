"""Section 5 of docs/protocol.md: control messages, checked, and patterns."""

import json
import re

from connect_records import (
    MALFORMED,
    MESSAGE_MAX,
    STAMP_MAX,
    TOO_LARGE,
    Refused,
    check_text,
    require,
)


def _integer(word):
    return (
        int(word) if word.isdigit() and len(word) < 20 else float(word)
    )  # a float is no integer to anybody


def _no_number(word):
    raise Refused(MALFORMED, f"{word} is no JSON")


def _limits(text):
    require(len(text.encode("utf-8", "replace")) <= MESSAGE_MAX, "message too long", TOO_LARGE)
    depth = 0
    for bracket in re.findall(r"[\[{\]}]", re.sub(r'"(?:[^"\\]|\\.)*"', '""', text)):
        depth += 1 if bracket in "[{" else -1
        require(depth <= 8, "nested too deeply", TOO_LARGE)


def _count(value):
    """How many values there are, after a look at every string."""
    if isinstance(value, dict):
        return 1 + sum(map(_count, value.values()))
    if isinstance(value, list):
        return 1 + sum(map(_count, value))
    require(
        not (isinstance(value, str) and re.search("[\ud800-\udfff]", value)), "a lone surrogate"
    )
    return 1


_ABSENT = object()


def member(of, key, kind, default=_ABSENT):
    require(isinstance(of, dict), "no object")
    if key not in of and default is not _ABSENT:
        return default
    require(key in of, f"no {key}")
    require(type(of[key]) is kind, f"{key} has the wrong type")
    return of[key]


def string(of, key, most=None, default=_ABSENT):
    value = member(of, key, str, default)
    require(most is None or len(value.encode()) <= most, f"{key} too long", TOO_LARGE)
    return check_text(value)


def items(of, key, most):
    value = member(of, key, list)
    require(len(value) <= most, f"{key} too many", TOO_LARGE)
    return value


def number(value):
    require(type(value) is int and 1 <= value < 1 << 32, "a number of a channel or an origin")
    return value


def _strings(of, key):
    for entry in items(of, key, 4096):
        require(type(entry) is str, f"{key} holds no string")
        require(len(entry.encode()) <= 255, f"entry of {key} too long", TOO_LARGE)
        check_text(entry)


def _word(of, key, words):
    require(string(of, key, default=words[0]) in words, key)


def _check_origin(origin):
    number(member(origin, "origin", int))
    gid = string(origin, "gid", 48)
    require(re.fullmatch("[0-9a-f]{48}", gid), "gid")
    string(origin, "node", 255, "")
    qos = member(origin, "qos", dict)
    _word(qos, "reliability", ("reliable", "best_effort"))
    _word(qos, "durability", ("volatile", "transient_local"))
    _word(qos, "history", ("keep_last", "keep_all"))
    _word(qos, "liveliness", ("automatic", "manual_by_topic"))
    require(member(qos, "depth", int, 0) < 1 << 32, "depth")
    for key in ("deadline_ns", "lifespan_ns", "liveliness_lease_ns"):
        require(member(qos, key, int, 0) <= STAMP_MAX, key)


def _check_offer(message):
    for channel in items(message, "channels", 256):
        number(member(channel, "channel", int))
        string(channel, "name", 255)
        if string(channel, "kind") != "topic":
            continue
        string(channel, "type", 255)
        string(channel, "type_hash", 255, "")
        _word(channel, "priority", ("normal", "urgent", "high", "bulk"))
        member(channel, "newest_only", bool, False)
        for origin in items(channel, "origins", 1024):
            _check_origin(origin)
    member(message, "complete", bool, False)


def decode_control(text):
    """The message as an object, checked."""
    _limits(text)
    try:
        message = json.loads(text, parse_int=_integer, parse_constant=_no_number)
    except ValueError as error:
        raise Refused(MALFORMED, f"no JSON: {error}") from None
    require(_count(message) <= 200_000, "too many values", TOO_LARGE)
    kind = string(message, "type")
    if kind == "accepts":
        for rule in items(message, "rules", 1024):
            _strings(rule, "topics")
            _strings(rule, "types")
        _strings(message, "deny")
    elif kind == "offer":
        _check_offer(message)
    elif kind == "origins":
        number(member(message, "channel", int))
        for origin in items(message, "added", 1024):
            _check_origin(origin)
        for origin in items(message, "removed", 1024):
            number(origin)
    elif kind in ("withdraw", "demand"):
        for channel in items(message, "channels", 65536):
            number(channel)
        if kind == "demand":
            member(message, "on", bool)
    elif kind == "decline":
        number(member(message, "channel", int))
        require(re.fullmatch("[a-z0-9_]+", string(message, "code", 32)), "code")
        string(message, "reason", 512, "")
    else:
        raise Refused(MALFORMED, "unknown type")
    return message


def encode_control(message):
    return json.dumps(message, ensure_ascii=False, separators=(",", ":"))


def _token_matches(pattern, token, deny):
    if token.startswith("_") and not deny and not pattern.startswith("_"):
        return False
    return re.fullmatch(re.escape(pattern).replace(r"\*", ".*"), token) is not None


def _tokens_match(pattern, name, deny):
    if not pattern:
        return not name
    if pattern[0] != "**":
        here = bool(name) and _token_matches(pattern[0], name[0], deny)
        return here and _tokens_match(pattern[1:], name[1:], deny)
    for count in range(0 if pattern[1:] else 1, len(name) + 1):
        hidden = not deny and any(token.startswith("_") for token in name[:count])
        if not hidden and _tokens_match(pattern[1:], name[count:], deny):
            return True
    return False


def matches(pattern, name, deny=False):
    if not pattern.startswith("/"):
        return False
    return _tokens_match(pattern[1:].split("/"), name[1:].split("/"), deny)


def is_accepted(accepts, name, kind):
    """Whether the sender of `accepts` would import this topic."""
    if name == "/parameter_events" or "_action" in name.split("/"):
        return False
    if any(matches(pattern, name, True) for pattern in accepts["deny"]):
        return False
    return any(
        any(matches(pattern, name) for pattern in rule["topics"])
        and (not rule["types"] or kind in rule["types"])
        for rule in accepts["rules"]
    )
