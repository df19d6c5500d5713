"""A camera on a link that carries few of its exact pictures: video, and all else as it was."""

import ctypes
import math
import random
import statistics
import threading

import pytest
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from graph import until

pytestmark = pytest.mark.slow

CAP = 40_000  # bytes per second
WIDTH, HEIGHT, STEP = 161, 121, 3 * 161  # odd, as a region of interest may be
PER_SECOND = 15


def drawn(number):
    """Smooth surfaces that move, and a sensor's noise: hard for exact compression."""
    noise = random.Random(number)
    across = [60 * math.sin((x + 3 * number) / 11) for x in range(WIDTH)]
    down = [math.cos(y / 9) for y in range(HEIGHT)]
    data = bytearray()
    for y in range(HEIGHT):
        grain = noise.randbytes(STEP)
        row = (120 + across[x // 3] * down[y] + 20 * (x % 3) + (grain[x] & 7)
               for x in range(STEP))
        data += bytes(map(int, row))
    return bytes(data)


PICTURES = [drawn(number) for number in range(10)]


def image(number):
    made = Image(height=HEIGHT, width=WIDTH, encoding="rgb8", step=STEP)
    made.header.stamp.sec, made.header.stamp.nanosec = 1_700_000_000 + number, number * 1001
    made.header.frame_id = "camera_optical_frame"
    made.data.frombytes(PICTURES[number % len(PICTURES)])
    return made


class Jpegs:
    """JPEGs by the library that the bridge uses, too."""

    def __init__(self):
        self._library = ctypes.CDLL("libturbojpeg.so.0")
        for call in ("tjInitCompress", "tjInitDecompress"):
            getattr(self._library, call).restype = ctypes.c_void_p
        self._library.tjFree.argtypes = [ctypes.c_void_p]
        self._writer = ctypes.c_void_p(self._library.tjInitCompress())
        self._reader = ctypes.c_void_p(self._library.tjInitDecompress())

    def write(self, rgb):
        half, quality = 2, 95
        made, size = ctypes.c_void_p(), ctypes.c_ulong()
        failed = self._library.tjCompress2(
            self._writer, rgb, WIDTH, STEP, HEIGHT, 0, ctypes.byref(made), ctypes.byref(size),
            half, quality, 0)
        assert not failed
        jpeg = ctypes.string_at(made, size.value)
        self._library.tjFree(made)
        return jpeg

    def read(self, jpeg):
        width, height, sampling = ctypes.c_int(), ctypes.c_int(), ctypes.c_int()
        size = ctypes.c_ulong(len(jpeg))
        failed = self._library.tjDecompressHeader2(
            self._reader, jpeg, size, ctypes.byref(width), ctypes.byref(height),
            ctypes.byref(sampling))
        assert not failed and (width.value, height.value) == (WIDTH, HEIGHT)
        rgb = ctypes.create_string_buffer(HEIGHT * STEP)
        assert not self._library.tjDecompress2(
            self._reader, jpeg, size, rgb, WIDTH, STEP, HEIGHT, 0, 0)
        return rgb.raw


JPEGS = Jpegs()


def compressed(number):
    made = CompressedImage(format="rgb8; jpeg compressed bgr8")
    made.header = image(number).header
    made.data.frombytes(JPEGS.write(PICTURES[number % len(PICTURES)]))
    return made


GROUP = 5  # packets of a video from one key frame to the next


def packet(number):
    """Of H.264: a slice of a key frame, or of another one."""
    made = CompressedImage(format="h264")
    made.header = image(number).header
    noise = random.Random(number).randbytes(3000).replace(b"\0", b"\1")
    made.data.frombytes((b"\0\0\1\x41" if number % GROUP else b"\0\0\1\x65") + noise)
    return made


def info(number):
    made = CameraInfo(height=HEIGHT, width=WIDTH, distortion_model="plumb_bob")
    made.header = image(number).header
    return made


def luma(data):
    return [(77 * r + 150 * g + 29 * b) >> 8 for r, g, b in zip(data[::3], data[1::3], data[2::3])]


def ssim(one, other):
    """Mean of the structural similarity in blocks of 8 x 8."""
    one, other = luma(one), luma(other)
    found = []
    for top in range(0, HEIGHT - 8, 8):
        for left in range(0, WIDTH - 8, 8):
            at = [(top + y) * WIDTH + left + x for y in range(8) for x in range(8)]
            a, b = [one[i] for i in at], [other[i] for i in at]
            ma, mb = statistics.fmean(a), statistics.fmean(b)
            both = statistics.fmean((p - ma) * (q - mb) for p, q in zip(a, b))
            varied = statistics.pvariance(a, ma) + statistics.pvariance(b, mb)
            found.append((2 * ma * mb + 6.5) * (2 * both + 58.5) / (ma**2 + mb**2 + 6.5)
                         / (varied + 58.5))
    return statistics.fmean(found)


class Camera:
    """A node that publishes until it is closed."""

    def __init__(self, graph, topic="/camera/image_raw", made=image):
        node = graph.node("camera")
        self._made = made
        kind = Image if made is image else CompressedImage
        self._pictures = graph.publisher(kind, topic, node=node)
        self._infos = graph.publisher(CameraInfo, "/camera/camera_info", node=node)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._film, daemon=True)
        self._thread.start()

    def _film(self):
        number = 0
        while not self._ended.wait(1 / PER_SECOND):
            number += 1
            self._pictures.publish(self._made(number))
            self._infos.publish(info(number))

    def close(self):
        self._ended.set()
        self._thread.join()


def capped(make_pair, never=None, cap=CAP):
    names = ["/camera/**"]
    rules = {"server": {"export_topics": names}, "client": {"import_topics": names}}
    if never:
        rules[never]["lossy"] = "never"
    made = {side: {"rules": ["all"], "rule": {"all": rule}} for side, rule in rules.items()}
    made["server"]["link.bytes_per_second"] = cap
    return make_pair(**made)


def sent_as(pair, topic="/camera/image_raw"):
    return [(side.topic(topic) or {}).get("sent_as") for side in (pair.server, pair.client)]


def number_of(message):
    return message.header.stamp.sec - 1_700_000_000


def without_data(message):
    message.data = []
    return message


def seen_as_video(pair, kind, topic, made):
    """30 pictures of a camera that crosses as video, each with its CameraInfo."""
    images = pair.operator.collector(kind, topic)
    infos = pair.operator.collector(CameraInfo, "/camera/camera_info")
    camera = Camera(pair.robot, topic, made)
    try:
        until(lambda: sent_as(pair, topic) == ["vp8", "vp8"],
              lambda: f"video: {sent_as(pair, topic)}")
        for side in (pair.server, pair.client):
            shown = side.topic(topic)
            assert shown["not_exact"].startswith("video, ") and shown["sent_as_because"]
        images.clear()
        infos.clear()
        images.wait(30)
    finally:
        camera.close()
    until(lambda: infos.messages and infos.messages[-1].header == images.messages[-1].header,
          "the last CameraInfo")
    came = list(images.messages)
    stamps = [number_of(message) for message in came]
    assert stamps == sorted(set(stamps))
    assert [number_of(message) for message in infos.messages][-len(stamps) + 1 :] == stamps[1:]
    return came


def test_a_camera_on_a_thin_link_is_video(make_pair):
    came = seen_as_video(capped(make_pair), Image, "/camera/image_raw", image)
    assert len(came[-1].data) == HEIGHT * STEP
    assert ssim(bytes(came[-1].data), PICTURES[number_of(came[-1]) % len(PICTURES)]) > 0.8
    for message in came:
        assert without_data(message) == without_data(image(number_of(message)))


def test_jpegs_on_a_thin_link_are_video_and_jpegs_again(make_pair):
    pair = capped(make_pair, cap=CAP // 2)  # an exact one has 6 kB
    came = seen_as_video(pair, CompressedImage, "/camera/image_raw/compressed", compressed)
    shown = JPEGS.read(bytes(came[-1].data))
    assert ssim(shown, PICTURES[number_of(came[-1]) % len(PICTURES)]) > 0.8
    for message in came:
        assert without_data(message) == without_data(compressed(number_of(message)))


@pytest.mark.parametrize("end", ["server", "client"])
def test_whoever_says_never_has_it_bit_for_bit(make_pair, end):
    pair = capped(make_pair, end)
    images = pair.operator.collector(Image, "/camera/image_raw")
    camera = Camera(pair.robot)
    try:
        images.wait(6)
    finally:
        camera.close()
    assert "vp8" not in sent_as(pair)
    for message in list(images.messages):
        assert message == image(number_of(message))


def test_packets_of_a_video_arrive_from_key_frames_on(make_pair):
    pair = capped(make_pair, cap=CAP // 2)  # of 45 kB/s
    packets = pair.operator.collector(CompressedImage, "/camera/video")
    camera = Camera(pair.robot, "/camera/video", packet)

    def gaps():
        numbers = [number_of(message) for message in list(packets.messages)]
        return [two for two in zip(numbers, numbers[1:]) if two[1] != two[0] + 1]

    try:
        until(lambda: len(gaps()) >= 3, lambda: f"drops: {pair.server.topic('/camera/video')}", 40)
    finally:
        camera.close()
    assert all(begin % GROUP == 0 for _, begin in gaps()), gaps()
    dropped = pair.server.topic("/camera/video")["dropped"]
    assert set(dropped) <= {"group", "newer_available"} and dropped, dropped
