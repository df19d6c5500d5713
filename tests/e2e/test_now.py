"""What arrives is now: states on a link that carries less than is published, and the last message
under a rate."""

import random
import time

from geometry_msgs.msg import Twist, Vector3
from sensor_msgs.msg import CameraInfo, CompressedImage

from conftest import OPEN
from graph import qos, until
from sanitizer import not_under_a_sanitizer

NOISE = random.Random(1)  # compression finds nothing
SECONDS = 8
BYTES, HZ, CAP = 20_000, 10, 100_000  # twice as much as the link carries


def picture(number):
    image = CompressedImage(format="jpeg", data=NOISE.randbytes(BYTES))
    image.header.frame_id = str(number)
    return image


def test_pictures_on_a_thin_link_are_no_older_than_two_of_them_take(make_pair):
    """A reliable publisher, default rules (github.com/RobotWebTools/roslibpy issue 41)."""
    pair = make_pair(server={**OPEN, "link.bytes_per_second": CAP})
    camera, pictures = pair.opened(CompressedImage, "/t/camera", picture(0), qos(10))
    pictures.clear()
    said = {}
    begin = time.monotonic()
    for number in range(1, SECONDS * HZ):
        said[str(number)] = time.monotonic()
        camera.publish(picture(number))
        time.sleep(max(0, begin + number / HZ - time.monotonic()))
    ages = [
        at - said[message.header.frame_id]
        for message, at in zip(pictures.messages, pictures.times)
        if at > begin + 3
    ]
    print(f"{len(ages)} pictures, age {min(ages):.2f} to {max(ages):.2f} s")
    takes = BYTES / CAP
    assert max(ages) < 1.5 * 2 * takes + 0.1
    assert len(ages) > 0.9 * (SECONDS - 3) / takes
    topic = pair.server.topic("/t/camera", "export")
    assert topic["keep"] == "newest" and topic["dropped"]["newer_available"] > 0


def test_a_rate_never_loses_the_stop(make_pair):
    """A stick that is let go: github.com/ros-teleop/teleop_twist_joy issue 27. The robot's rule."""
    steer = {"import_topics": ["/cmd_vel"], "max_rate": 10.0}
    pair = make_pair(server={"rules": ["steer"], "rule": {"steer": steer}})
    stick, heard = pair.opened(Twist, "/cmd_vel", Twist(), qos(10), backward=True)
    heard.clear()
    for round in range(1, 6):
        begin = time.monotonic()
        for step in range(25):
            stick.publish(Twist(linear=Vector3(x=float(round))))
            time.sleep(max(0, begin + (step + 1) / 50 - time.monotonic()))
        stick.publish(Twist())
        until(lambda: heard.messages and heard.messages[-1] == Twist(), "the robot stops", 2, 0.01)
    driving = sum(message != Twist() for message in heard.messages)
    assert 5 * 4 <= driving <= 5 * 7, "ten a second, for half a second"


def test_an_image_that_arrives_has_its_info(make_pair):
    """On a thin link (github.com/ROBOTIS-GIT/turtlebot3_autorace issue 49)."""
    pair = make_pair(server={**OPEN, "link.bytes_per_second": 600_000})
    first = CompressedImage(format="jpeg", data=NOISE.randbytes(60_000))
    camera, images = pair.opened(CompressedImage, "/t/image/compressed", first, qos(10))
    about, infos = pair.opened(CameraInfo, "/t/camera_info", CameraInfo(), qos(10))
    images.clear()
    infos.clear()
    begin = time.monotonic()
    for number in range(1, SECONDS * 30):
        image = CompressedImage(format="jpeg", data=NOISE.randbytes(60_000))
        info = CameraInfo()
        image.header.stamp.sec = info.header.stamp.sec = number
        about.publish(info)
        camera.publish(image)
        time.sleep(max(0, begin + number / 30 - time.monotonic()))
    time.sleep(1)
    stamps = {message.header.stamp.sec: at for message, at in zip(images.messages, images.times)}
    known = {message.header.stamp.sec: at for message, at in zip(infos.messages, infos.times)}
    late = [abs(at - known[stamp]) for stamp, at in stamps.items() if stamp in known]
    print(f"{len(stamps)} images, {len(known)} infos, {len(late)} pairs, apart {max(late):.3f} s")
    assert len(stamps) > 50
    assert len(late) >= 0.95 * len(stamps)
    not_under_a_sanitizer("how soon an info and its image leave")
    assert len(known) < 1.2 * len(stamps)
    assert sorted(late)[int(0.95 * len(late))] < 0.05
