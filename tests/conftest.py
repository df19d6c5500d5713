"""All Python tests: how a file is divided into tests of ctest (cmake/tests.cmake)."""

import signal

# A shell that starts the tests in the background makes them ignore SIGINT, and with them all
# processes that they start.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser):
    parser.addoption("--part", default="1/1", help="I/N: every N-th test, from the I-th on")


def pytest_collection_modifyitems(config, items):
    part, parts = map(int, config.getoption("--part").split("/"))
    config.hook.pytest_deselected(items=[t for i, t in enumerate(items) if i % parts != part - 1])
    items[:] = items[part - 1 :: parts]
