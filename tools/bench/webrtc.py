#!/usr/bin/env python3
"""WebRTC beside the bridge: the pictures of build/bench/pictures as a video by aiortc (VP8, its own
congestion control), for tools/bench/wan.

  webrtc.py PROGRAM send|receive    commands, each answered by a line of JSON:
        send: offer -> {"sdp":...}; answer <JSON of the receiver>; film SECONDS -> {"sent":N}
        receive: answer <JSON of the sender> -> {"sdp":...}; clear, count: as `pictures watch`
"""

import asyncio
import fractions
import json
import struct
import subprocess
import sys
import threading
import time

import av
from aiortc import RTCConfiguration, RTCPeerConnection, RTCSessionDescription, VideoStreamTrack
from aiortc.mediastreams import MediaStreamError

WIDTH, HEIGHT = 640, 480
BYTES = 3 * WIDTH * HEIGHT


class Camera(VideoStreamTrack):
    """The newest picture, each once."""

    def __init__(self, loop):
        super().__init__()
        self._loop, self._newest, self._came, self.sent = loop, None, asyncio.Event(), 0

    def film(self, program, seconds):
        """In a thread of its own."""
        source = subprocess.Popen([program, "frames", f"seconds={seconds}"], stdout=subprocess.PIPE)
        while len(data := source.stdout.read(BYTES)) == BYTES:
            self._loop.call_soon_threadsafe(self._take, data, time.time())
        source.wait()

    def _take(self, data, now):
        self._newest = (data, now)
        self._came.set()

    async def recv(self):
        await self._came.wait()
        self._came.clear()
        data, now = self._newest
        frame = av.VideoFrame(WIDTH, HEIGHT, "rgb24")
        frame.planes[0].update(data)
        frame = frame.reformat(format="yuv420p")
        frame.pts, frame.time_base = int(now * 90_000), fractions.Fraction(1, 90_000)
        self.sent += 1
        return frame


async def watch(track, arrivals):
    """Keeps pictures as aiortc hands them out; they are judged later."""
    try:
        while True:
            frame = await track.recv()
            arrivals.append((time.time_ns(), frame))
    except MediaStreamError:
        pass


def judged(program, arrivals):
    judge = subprocess.Popen([program, "judge"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def feed():
        for came, frame in arrivals:
            plane = frame.reformat(format="rgb24").planes[0]
            row, data = 3 * frame.width, bytes(plane)
            rows = (data[y * plane.line_size :][:row] for y in range(frame.height))
            judge.stdin.write(struct.pack("<q", came) + b"".join(rows))
        judge.stdin.close()

    threading.Thread(target=feed).start()
    return judge.stdout.read().decode().strip()


def sdp(connection):
    local = connection.localDescription
    return json.dumps({"sdp": local.sdp, "type": local.type})


async def main(program):
    loop = asyncio.get_running_loop()
    peer = RTCPeerConnection(RTCConfiguration(iceServers=[]))
    camera, arrivals, tasks = Camera(loop), [], []
    peer.on("track", lambda track: tasks.append(loop.create_task(watch(track, arrivals))))
    print('{"ready":true}', flush=True)
    while line := await loop.run_in_executor(None, sys.stdin.readline):
        verb, _, rest = line.strip().partition(" ")
        if verb == "offer":
            peer.addTrack(camera)
            await peer.setLocalDescription(await peer.createOffer())
            print(sdp(peer), flush=True)
        elif verb == "answer":
            await peer.setRemoteDescription(RTCSessionDescription(**json.loads(rest)))
            if peer.signalingState == "have-remote-offer":
                await peer.setLocalDescription(await peer.createAnswer())
            print(sdp(peer), flush=True)
        elif verb == "film":
            before = camera.sent
            await loop.run_in_executor(None, camera.film, program, float(rest))
            print(json.dumps({"sent": camera.sent - before}), flush=True)
        elif verb == "clear":
            arrivals.clear()
            print("{}", flush=True)
        elif verb == "count":
            came = arrivals[:]
            arrivals.clear()
            print(await loop.run_in_executor(None, judged, program, came), flush=True)
    await peer.close()


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1]))
