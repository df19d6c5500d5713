"""Finds the statement that a mark in the code stands behind, and puts a fault into it."""
import importlib.machinery
import importlib.util
import pathlib
import re
from typing import NamedTuple

ROOT = pathlib.Path(__file__).resolve().parents[2]
MARK = re.compile(r"// mutant: (\w+)$", re.M)
CONDITION = re.compile(r"\b(?:if|while) \(")
VALUE = re.compile(r"(\breturn\b|[^=!<>]=(?!=))\s*")


def load_tidy():
    """tools/tidy as a module: it knows comments."""
    loader = importlib.machinery.SourceFileLoader("tidy", str(ROOT / "tools" / "tidy"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("tidy", loader))
    loader.exec_module(module)
    return module


TIDY = load_tidy()


class NoPlace(Exception):
    """Why a mutant does not apply."""


def closing(code, at):
    """Where the bracket at `at` is closed."""
    depth = 0
    for index in range(at, len(code)):
        depth += (code[index] in "([{") - (code[index] in ")]}")
        if depth == 0:
            return index
    raise NoPlace("has a bracket without an end")


def begin_of(code, end):
    """Where the statement begins that ends before `end`, with its `if` or `for`."""
    depth = 0
    for index in range(end - 1, -1, -1):
        char = code[index]
        if depth == 0 and index < end - 1 and (
                char in ";{(" or (char == "}" and re.match(r"\n|\s*else\b", code[index + 1:]))):
            return index + 1
        depth += (char in ")]}") - (char in "([{" and index < end - 1)
    return 0


def statement(code, mark):
    """(begin, end) of the statement, or of its head up to `{`, that the line of a mark ends."""
    end = len(code[:mark].rstrip())
    begin = begin_of(code, end)
    return begin + len(code[begin:end]) - len(code[begin:end].lstrip()), end


# ---- what a fault makes of a statement

def gone(_):
    """It is not there."""
    return ";"


def _condition(text, made):
    found = CONDITION.search(text)
    if not found:
        raise NoPlace("has no condition")
    begin = found.end() - 1
    return text[:begin + 1] + made(text[begin:closing(text, begin) + 1]) + \
        text[closing(text, begin):]


def never(text):
    """Its condition does not hold."""
    return _condition(text, lambda condition: f"false && {condition}")


def always(text):
    """Its condition holds."""
    return _condition(text, lambda condition: f"true || {condition}")


def value(of):
    """What it returns, or sets, is this."""
    def put(text):
        found = VALUE.search(text)
        if not found or not text.endswith(";"):
            raise NoPlace("neither returns nor sets a value")
        return f"{text[:found.end()]}{of};"
    return put


def swap(what, by):
    """This part of it is another one."""
    wanted = re.compile(r"\s+".join(map(re.escape, what.split(" "))))  # however lines are wrapped

    def put(text):
        if len(wanted.findall(text)) != 1:
            raise NoPlace(f"does not have '{what}' once")
        return wanted.sub(lambda _: by, text)
    return put


class Place(NamedTuple):
    file: pathlib.Path  # relative to the tree
    line: int
    original: str
    mutated: str

    @property
    def layer(self):
        return self.file.parts[1]


class Sources:
    """The marks in the sources of some layers of one tree."""

    def __init__(self, tree, layers):
        self.marks = {}  # name -> [(file, text, offset)]
        for layer in layers:
            for path in sorted((tree / "src" / layer).rglob("*.[ch]pp")):
                text = path.read_text()
                for match in MARK.finditer(text):
                    found = (path.relative_to(tree), text, match.start())
                    self.marks.setdefault(match.group(1), []).append(found)

    def place(self, mutant):
        """Throws NoPlace."""
        found = self.marks.get(mutant.mark, [])
        if len(found) != 1:
            where = ", ".join(str(file) for file, *_ in found)
            raise NoPlace(f"is marked more than once: {where}" if found else "has no mark")
        file, text, mark = found[0]
        begin, end = statement(TIDY.without_comments(text, keep_strings=True), mark)
        line = text.count("\n", 0, mark) + 1
        try:
            put = mutant.fault(text[begin:end])
        except NoPlace as problem:
            raise NoPlace(f"{problem} ({file}:{line})") from None
        return Place(file, line, text, text[:begin] + put + text[end:])

    def problems(self, mutants):
        """Mutants that do not apply, and marks that nobody knows."""
        for mutant in mutants:
            try:
                self.place(mutant)
            except NoPlace as problem:
                yield f"mutant '{mutant.mark}' {problem}"
        for mark in sorted(set(self.marks) - {mutant.mark for mutant in mutants}):
            yield f"mark '{mark}' in {self.marks[mark][0][0]} is of no mutant"
