"""Section 5 of docs/protocol.md: control messages, checked, and patterns."""

import json
import re

from connect_records import (
    MALFORMED,
    STAMP_MAX,
    TOO_LARGE,
    Refused,
    check_text,
    require,
)

# Section 12
TEXT_MAX = 262_144
VALUES_MAX = 16_384
MEMBERS_MAX = 64  # of an object
ADDED_MAX = 64  # origins of a channel in an offer; origins or listeners that a message adds
REMOVED_MAX = 1024
CHANNELS_MAX = 4096  # of a withdraw
DEMANDED_MAX = 1024  # channels of a demand
DECODES_MAX = 16  # words
HAS_MAX = 64  # origins of a `has`
CALLS_MAX = 8192
ENTRIES_MAX = 4096  # patterns and types of all rules and of `deny` together
WILDCARDS_MAX = 256  # of these, patterns with a star
WILDCARD_BYTES_MAX = 4096  # of these, each from its first star on
ORIGINS_MAX = 1024  # of a channel
LISTENERS_MAX = 1024  # of a link
ASKED_MAX = 64  # names of an ask
FINDINGS_MAX = 16
CREDENTIAL_MAX = 3900


def _integer(word):
    return (
        int(word) if word.isdigit() and len(word) <= 20 and int(word) < 1 << 64 else float(word)
    )  # a float is not an integer


def _no_number(word):
    raise Refused(MALFORMED, f"{word} is no JSON")


def _limits(text):
    require(len(text.encode("utf-8", "replace")) <= TEXT_MAX, "message too long", TOO_LARGE)
    depth = 0
    for bracket in re.findall(r"[\[{\]}]", re.sub(r'"(?:[^"\\]|\\.)*"', '""', text)):
        depth += 1 if bracket in "[{" else -1
        require(depth <= 8, "nested too deeply", TOO_LARGE)


def _object(members):
    require(len(members) <= MEMBERS_MAX, "too many members", TOO_LARGE)
    return dict(members)


def _count(value):
    """Counts the values, and checks every string."""
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
    for entry in items(of, key, ENTRIES_MAX):
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
    _check_qos(origin)


def _check_qos(of):
    qos = member(of, "qos", dict)
    _word(qos, "reliability", ("reliable", "best_effort"))
    _word(qos, "durability", ("volatile", "transient_local"))
    _word(qos, "history", ("keep_last", "keep_all"))
    _word(qos, "liveliness", ("automatic", "manual_by_topic"))
    require(member(qos, "depth", int, 0) < 1 << 32, "depth")
    for key in ("deadline_ns", "lifespan_ns", "liveliness_lease_ns"):
        require(member(qos, key, int, 0) <= STAMP_MAX, key)


def _check_listeners(message):
    for told in items(message, "added", ADDED_MAX):
        number(member(told, "listener", int))
        for key in ("name", "type"):
            string(told, key, 255)
        string(told, "type_hash", 255, "")
    for gone in items(message, "removed", REMOVED_MAX):
        number(gone)


def _check_ask(message):
    for asked in items(message, "names", ASKED_MAX):
        for key in ("kind", "name", "type"):
            string(asked, key, 255)


def _check_answer(message):
    for code in items(message, "codes", ASKED_MAX):
        require(type(code) is str, "codes holds no string")
        require(len(code.encode()) <= 32, "code too long", TOO_LARGE)
        require(re.fullmatch("[a-z0-9_]+", code), "code")


def _check_offer(message):
    for channel in items(message, "channels", 256):
        number(member(channel, "channel", int))
        string(channel, "name", 255)
        kind = string(channel, "kind")
        if kind not in ("topic", "service"):
            continue
        string(channel, "type", 255)
        string(channel, "action_type", 255, "")
        _word(channel, "priority", ("normal", "urgent", "high", "bulk"))
        if kind == "service":
            string(channel, "node", 255, "")
            number(member(channel, "epoch", int))
            continue
        string(channel, "type_hash", 255, "")
        member(channel, "newest_only", bool, False)
        member(channel, "resume", bool, False)
        for origin in items(channel, "origins", ADDED_MAX):
            _check_origin(origin)
    member(message, "complete", bool, False)


def _check_accepts(message):
    _strings(message, "deny")
    patterns, types = list(message["deny"]), 0
    for rule in items(message, "rules", 1024):
        for key in ("topics", "types", "services", "actions", "parameters"):
            if key in ("topics", "types") or key in rule:
                _strings(rule, key)
                types += len(rule[key]) if key == "types" else 0
                patterns += rule[key] if key != "types" else []
    require(len(patterns) + types <= ENTRIES_MAX, "more patterns and types", TOO_LARGE)
    stars = [pattern[pattern.index("*") :] for pattern in patterns if "*" in pattern]
    require(len(stars) <= WILDCARDS_MAX, "more patterns with wildcards", TOO_LARGE)
    require(sum(map(len, stars)) <= WILDCARD_BYTES_MAX, "longer wildcards", TOO_LARGE)
    require(0 <= member(message, "message_bytes_max", int, 0) < 1 << 32, "message_bytes_max")
    member(message, "ros_time", bool, False)
    member(message, "findings", bool, False)
    if "base" in message:
        require(re.fullmatch("[0-9a-f]{32}", string(message, "base", 32)), "base")


def _check_demand(demand):
    """Of one channel."""
    number(member(demand, "channel", int))
    require(0 <= member(demand, "number", int) < 65536, "number of a demand")
    require(0 <= member(demand, "after", int, 0) < 1 << 32, "a sequence")
    if "has" in demand:
        for held in items(demand, "has", HAS_MAX):
            number(member(held, "origin", int))
            require(0 <= member(held, "number", int) < 1 << 64, "a sample's number")
    for flag in ("resume", "live", "lossy"):
        member(demand, flag, bool, False)
    if "decodes" in demand:
        for word in items(demand, "decodes", DECODES_MAX):
            require(type(word) is str, "decodes holds no word")
            check_text(word)


def _check_wheel(message):
    number(member(message, "channel", int))
    require(("state" in message) != ("want" in message), "state and want are not exactly one")
    if "state" in message:
        require(string(message, "state") in ("free", "yours", "taken", "halted"), "state")
    else:
        require(string(message, "want") in ("take", "leave"), "want")


def _check_code(message):
    require(re.fullmatch("[a-z0-9_]+", string(message, "code", 32)), "code")
    string(message, "reason", 512, "")


def _check_call(kind, message):
    """attach, attached, refuse, forget"""
    number(member(message, "channel", int))
    if kind in ("attach", "attached"):
        number(member(message, "requests", int))
    if kind != "attach":
        for call in items(message, "calls", CALLS_MAX):
            number(call)
    if kind == "attached":
        require(0 <= member(message, "seen", int, 0) < 1 << 32, "seen")
        string(message, "type_hash", 255, "")
    if kind == "refuse":
        _check_code(message)


def decode_control(text):
    """The message as an object, checked."""
    _limits(text)
    try:
        message = json.loads(
            text, parse_int=_integer, parse_constant=_no_number, object_pairs_hook=_object
        )
    except ValueError as error:
        raise Refused(MALFORMED, f"no JSON: {error}") from None
    require(_count(message) <= VALUES_MAX, "too many values", TOO_LARGE)
    kind = string(message, "type")
    if kind == "accepts":
        _check_accepts(message)
    elif kind == "offer":
        _check_offer(message)
    elif kind == "origins":
        number(member(message, "channel", int))
        for origin in items(message, "added", ADDED_MAX):
            _check_origin(origin)
        for origin in items(message, "removed", REMOVED_MAX):
            number(origin)
        for key in ("too_large", "too_large_bytes"):
            require(0 <= member(message, key, int, 0) < 1 << 64, f"{key} out of range")
    elif kind == "demand":
        for demand in items(message, "channels", DEMANDED_MAX):
            _check_demand(demand)
    elif kind == "wheel":
        _check_wheel(message)
    elif kind == "withdraw":
        for channel in items(message, "channels", CHANNELS_MAX):
            number(channel)
        if "code" in message:
            _check_code(message)
        else:
            string(message, "reason", 512, "")
    elif kind == "decline":
        number(member(message, "channel", int))
        _check_code(message)
    elif kind in ("attach", "attached", "refuse", "forget"):
        _check_call(kind, message)
    elif kind == "listeners":
        _check_listeners(message)
    elif kind == "ask":
        _check_ask(message)
    elif kind == "answer":
        _check_answer(message)
    elif kind == "findings":
        for finding in items(message, "list", FINDINGS_MAX):
            require(re.fullmatch("[a-z0-9_]+", string(finding, "id", 32)), "id")
            string(finding, "name", 255, "")
    elif kind == "renew":
        require(re.fullmatch("[a-z0-9_]+", string(message, "method", 32)), "method")
        string(message, "credential", CREDENTIAL_MAX)
    elif kind == "renewed":
        member(message, "accepted", bool)
    else:
        raise Refused(MALFORMED, "unknown type")
    return message


def origins_messages(channel, added, removed=()):
    """A change of any length. The first message removes."""
    for first in range(0, max(1, len(added)), ADDED_MAX):
        yield {
            "type": "origins",
            "channel": channel,
            "added": added[first : first + ADDED_MAX],
            "removed": list(removed) if first == 0 else [],
        }


def offer_messages(channel, complete=None):
    """A topic with any number of origins; not the last of the first round if they are many."""
    origins = channel["origins"]
    offer = {"type": "offer", "channels": [{**channel, "origins": origins[:ADDED_MAX]}]}
    yield offer if complete is None else {**offer, "complete": complete}
    if origins[ADDED_MAX:]:
        yield from origins_messages(channel["channel"], origins[ADDED_MAX:])


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


PARAMETER_EVENTS = "/parameter_events"
PARTS = {  # of an action: kind, and the type or the suffix after the action's
    "send_goal": ("service", "_SendGoal"),
    "cancel_goal": ("service", "action_msgs/srv/CancelGoal"),
    "get_result": ("service", "_GetResult"),
    "feedback": ("topic", "_FeedbackMessage"),
    "status": ("topic", "action_msgs/msg/GoalStatusArray"),
}
PARAMETER_SERVICES = {
    "describe_parameters": "DescribeParameters",
    "get_parameter_types": "GetParameterTypes",
    "get_parameters": "GetParameters",
    "list_parameters": "ListParameters",
    "set_parameters": "SetParameters",
    "set_parameters_atomically": "SetParametersAtomically",
}


def opening_of(name, kind, sort="topic", action_type="", node=None):
    """Which list of a rule allows it, under which name and type, and which name deny must match; or
    None."""
    tokens = name.split("/")[1:]
    if "_action" in tokens:
        action, part = name.rsplit("/_action/", 1) if "/_action/" in name else ("", "")
        if not action or "_action" in action.split("/") or part not in PARTS:
            return None
        of, ending = PARTS[part]
        fits = kind == (action_type + ending if ending.startswith("_") else ending)
        if of != sort or not fits or not re.fullmatch(r"\w+/action/\w+", action_type):
            return None
        return "actions", action, action_type, [action] + [f"{action}/_action/{p}" for p in PARTS]
    if sort == "topic" and name == PARAMETER_EVENTS:
        if kind != "rcl_interfaces/msg/ParameterEvent" or not node:
            return None
        return "parameters", node, None, [node, name]
    if sort == "service" and tokens[-1] in PARAMETER_SERVICES:
        owner = name.rsplit("/", 1)[0]
        if not owner or kind != f"rcl_interfaces/srv/{PARAMETER_SERVICES[tokens[-1]]}":
            return None
        return "parameters", owner, None, [owner, name]
    return f"{sort}s", name, kind, [name]


def is_accepted(accepts, name, kind, sort="topic", action_type="", node=None):
    """Whether the sender of `accepts` would import this topic (an origin of /parameter_events with
    its node) or service."""
    opening = opening_of(name, kind, sort, action_type, node)
    if opening is None:
        return False
    key, opened, of_type, names = opening
    if any(matches(pattern, each, True) for pattern in accepts["deny"] for each in names):
        return False
    return any(
        any(matches(pattern, opened) for pattern in rule.get(key, ()))
        and (of_type is None or not rule["types"] or of_type in rule["types"])
        for rule in accepts["rules"]
    )
