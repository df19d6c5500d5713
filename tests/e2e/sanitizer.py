"""What a test cannot say of programs that are built with a sanitizer."""

import os

import pytest

SANITIZED = bool(os.environ.get("CONNECT_SANITIZE"))


def not_under_a_sanitizer(what):
    """Ends the test before the last thing that it says. Under a sanitizer programs keep the memory
    that they free, and are several times slower."""
    if SANITIZED:
        pytest.skip(f"NOT TESTED under a sanitizer: {what} (all else of this test passed)")
