"""All Python tests: how a file is divided into tests of ctest (cmake/tests.cmake), and what their
middleware needs."""

import pathlib
import signal
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "tools"))

from harness import middleware  # noqa: E402

# A shell that starts the tests in the background makes them ignore SIGINT, and with them all
# processes that they start.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_configure():
    middleware.prepare()  # before there is a context of rcl


def pytest_addoption(parser):
    parser.addoption("--part", default="1/1", help="I/N: every N-th test, from the I-th on")


def pytest_collection_modifyitems(config, items):
    part, parts = map(int, config.getoption("--part").split("/"))
    config.hook.pytest_deselected(items=[t for i, t in enumerate(items) if i % parts != part - 1])
    items[:] = items[part - 1 :: parts]
