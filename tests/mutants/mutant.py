"""Small faults, each of which a test must notice.

A fault is bound to code, not to a place: `find` is searched for in all of src/core, src/auth,
src/net and src/config, without comments and white space; `...` in it stands for anything inside one
statement. It must be found exactly once. Where the same code stands in several functions, `within`
names the one that is meant, with its class if need be. So code may move to another file, and lines
may be wrapped differently.
"""
from typing import NamedTuple


class Mutant(NamedTuple):
    name: str
    find: str
    put: str
    within: str = ""
