"""Over a thin, slow, lossy link that breaks, emulated between two network namespaces: what arrives.
How soon is what `make bench-wan` measures."""

import pathlib
import sys

import pytest

from harness.programs import build_dir
from harness.worker import Missing

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "tools" / "bench"))
import wan_breaks  # noqa: E402
import wan_cases  # noqa: E402
from wan_bed import Bed  # noqa: E402


pytestmark = pytest.mark.alone


@pytest.fixture(scope="module")
def opened():
    if not (build_dir() / "bench" / "wan_bench").exists():
        pytest.skip("NOT TESTED: wan_bench is not built (under a sanitizer it is not)")
    try:
        made = Bed("auto")
    except Missing as error:
        pytest.skip(f"NOT TESTED: no emulated network on this machine: {error}")
    try:
        made.wan.set(**wan_cases.NET)
        made.open("priorities")
        yield made
    finally:
        made.close()


@pytest.fixture
def bed(opened):
    opened.wan.set(**wan_cases.NET)
    return opened


def figures(row):
    return {one["what"]: one["value"] for one in row.judged}


def test_over_a_cut_a_reliable_topic_loses_nothing(bed):
    reliable, camera = (figures(row) for row in wan_breaks.cut(bed, {"seconds_of_cut": 4}))
    assert reliable["missing"] == reliable["repeated or out of order"] == 0
    assert reliable["its first new one, s"] is not None
    assert camera["first frame, s"] is not None


@pytest.mark.parametrize("net", ["NET", "LOSSY"])
def test_beside_an_overload_no_urgent_message_is_lost(bed, net):
    bed.wan.set(**getattr(wan_cases, net))
    overload = {"up": wan_cases.OVERLOAD, "down": {**wan_cases.OVERLOAD, "hz": 20}}
    result = wan_cases.pinged(bed, 4, overload, topics=3)
    assert result.lost == 0
    for direction in overload:
        assert min(result.goodput(direction), default=0) > 0, direction
    # In the path's queue, which an overload fills, they would wait 200 ms.
    assert result.ms(50) < 150
