"""Finds the code that a mutant changes by its tokens: white space and comments do not count."""
import importlib.machinery
import importlib.util
import pathlib
import re
from typing import NamedTuple

ROOT = pathlib.Path(__file__).resolve().parents[2]
TOKEN = re.compile(r'\.\.\.|"(?:\\.|[^"\\])*"|\w+|\S')


def load_tidy():
    """tools/tidy as a module: it knows comments and functions."""
    loader = importlib.machinery.SourceFileLoader("tidy", str(ROOT / "tools" / "tidy"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("tidy", loader))
    loader.exec_module(module)
    return module


TIDY = load_tidy()


def is_word(token):
    return token[0].isalnum() or token[0] == "_"


def pattern(find):
    """A regular expression for the tokens of `find`; `...` is anything inside one statement."""
    parts, before = [], "..."
    for token in TOKEN.findall(find):
        if "..." not in (before, token):
            parts.append(r"\s+" if is_word(before) and is_word(token) else r"\s*")
        if token == "...":
            parts.append("[^;]*?")
        else:
            parts.append(rf"\b{token}\b" if is_word(token) else re.escape(token))
        before = token
    return re.compile("".join(parts))


class Place(NamedTuple):
    file: pathlib.Path  # relative to the tree
    line: int
    original: str
    mutated: str

    @property
    def layer(self):
        return self.file.parts[1]

    def __str__(self):
        return f"{self.file}:{self.line}"


class Sources:
    """The sources of some layers of one tree."""

    def __init__(self, tree, layers):
        self.files = {}
        for layer in layers:
            for path in sorted((tree / "src" / layer).rglob("*.[ch]pp")):
                text = path.read_text()
                code = TIDY.without_comments(text, keep_strings=True)
                self.files[path.relative_to(tree)] = (text, code)

    def spans(self, within):
        """(file, begin, end) of every file, or of every function of this name."""
        for file, (text, code) in self.files.items():
            if not within:
                yield file, 0, len(code)
                continue
            starts = [0, *(match.end() for match in re.finditer("\n", code)), len(code)]
            for name, first, lines in TIDY.functions(text):
                if f"::{name}".endswith(f"::{within}"):
                    yield file, starts[first - 1], starts[first - 1 + lines]

    def places(self, mutant):
        wanted = pattern(mutant.find)
        for file, begin, end in self.spans(mutant.within):
            text, code = self.files[file]
            for match in wanted.finditer(code, begin, end):
                yield Place(file, code.count("\n", 0, match.start()) + 1, text,
                            text[:match.start()] + mutant.put + text[match.end():])

    def problem(self, mutant):
        """Why the mutant does not apply; empty if it does."""
        found = list(self.places(mutant))
        if len(found) == 1:
            return ""
        where = f" in {mutant.within}" if mutant.within else ""
        if found:
            return f"its code is found more than once{where}: {', '.join(map(str, found))}"
        if not mutant.within:
            return "its code is not found"
        if not list(self.spans(mutant.within)):
            where = f"; there is no function {mutant.within}"
        others = list(self.places(mutant._replace(within="")))
        there = f"; it is at {', '.join(map(str, others))}" if others else ""
        return f"its code is not found{where}{there}"
