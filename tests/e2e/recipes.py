"""The recipes of docs/recipes.md: their files, and the names that they promise."""

import re

import yaml

from harness.programs import ROOT

PAGE = ROOT / "docs" / "recipes.md"
# What a list of a recipe promises: the option of `ctl explain`, the directions at the file's end,
# and the options for who asks.
PROMISES = {
    "To the operator": ("--topic", "export", ()),
    "To the robot": ("--topic", "import", ()),
    "From the robots": ("--topic", "import", ()),
    "To the robots": ("--topic", "export", ()),
    "Services": ("--service", "export", ()),
    "Services of the crew": ("--service", "export", ("--group", "crew")),
    "Actions": ("--action", "export", ()),
    "Parameters": ("--parameters", "export", ()),
}


class Recipe:
    def __init__(self, text):
        self.text = text
        self.names = {}  # a list's head -> names

    def nodes(self):
        """The sections of its file."""
        return yaml.safe_load(self.text)

    def at_a_pair(self):
        """Its parameters, without those that the pair of a test has of its own."""
        (node,) = self.nodes().values()
        own = ("auth", "url")
        return {key: value for key, value in node["ros__parameters"].items() if key not in own}


def recipes():
    """Name of the recipe -> what the page says of it, in its order."""
    found = {}
    page = PAGE.read_text(encoding="utf-8")
    parts = re.split(r"<!-- recipe: (.+) -->\n```yaml\n", page)
    for name, rest in zip(parts[1::2], parts[2::2]):
        text, after = rest.split("```\n", 1)
        found[name] = recipe = Recipe(text)
        for head, names in re.findall(r"^- \*\*(.+?):\*\* ((?:.+\n?)(?:  .+\n?)*)", after,
                                      re.MULTILINE):
            if head in PROMISES or head == "Never":
                recipe.names[head] = re.findall(r"`(/[^`]+)`", names)
    return found
