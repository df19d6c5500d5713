"""Files of secrets, and a server's list of tokens."""

import hashlib
import json


def write(file, text):
    """Replaces the file, which is its owner's alone, in one step, as a careful writer does; its
    path as a parameter."""
    part = file.with_suffix(".new")
    part.write_text(text, encoding="ascii")
    part.chmod(0o600)
    part.rename(file)
    return str(file)


def entry(identity, token, groups=("ops",), expires=None):
    made = {
        "identity": identity,
        "token_sha256": hashlib.sha256(token.encode()).hexdigest(),
        "groups": list(groups),
    }
    if expires is not None:
        made["expires"] = f"{expires:%Y-%m-%dT%H:%M:%SZ}"
    return made


def write_tokens(file, *entries):
    return write(file, json.dumps(entries))  # JSON is YAML
