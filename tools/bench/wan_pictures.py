"""The cases of tools/bench/wan with a camera of 640x480 at 30 a second, and its rivals."""

import time

from harness.programs import ROOT
from harness.wan import OPERATOR, ROBOT, words
from harness.worker import Missing
from measure import percentile
from wan_breaks import meet, talked
from wan_cases import NET, Row, pinged

THIN = {"down": 58_000_000, "delay": 0.03, "queue": 0.2}
SETTLED = 3  # s: from then on pictures count
PER_SECOND = 30
STEADY = [(1, 0.80), (2, 0.87), (4, 0.92)]  # Mbit/s, least SSIM
FALLING = (18_000_000, 1_500_000, 500_000)
# s: a round trip, encoding and a large first picture, and discovery in both graphs.
FIRST = 2 * THIN["delay"] + 0.3 + 0.5
RIVALS = ROOT / ".ros2" / "rivals"


class Camera:
    """A camera at the robot, and who watches it over the bridge."""

    def __init__(self, bed, *options):
        self.film = bed.worker(ROBOT, "pictures", "camera", *options)
        self.watch = bed.worker(OPERATOR, "pictures", "watch", *options)
        for end in (self.film, self.watch):
            end.ready()
        for _ in range(30):
            self.film.ask("film seconds=0.3")
            time.sleep(1)
            if self.watch.ask("count")["count"]:
                return
        raise Missing("no picture arrives")

    def begin(self, seconds):
        self.film.say(words("film", {"seconds": seconds}))

    def end(self, seconds):
        self.film.answer(seconds + 60)


class Call:
    """The same by WebRTC, which no bridge carries."""

    def __init__(self, bed):
        python, program = RIVALS / "bin" / "python", ROOT / "tools" / "bench" / "webrtc.py"
        if not python.exists():
            raise Missing("no aiortc: tools/setup/rivals.sh")
        tool = bed.program("pictures")
        self.film, self.watch = (
            bed.started(place, f"webrtc-{verb}", [python, "-B", program, tool])
            for place, verb in ((ROBOT, "send"), (OPERATOR, "receive"))
        )
        for end in (self.film, self.watch):
            end.ready()
        self.film.say("offer")
        self.watch.say("answer " + self.film.line())
        self.film.ask("answer " + self.watch.line())

    def begin(self, seconds):
        self.film.say(f"film {seconds}")

    def end(self, seconds):
        self.film.answer(seconds + 60)


class Seen:
    """What was watched for these seconds, the pings beside it, and the robot's bridge's cost."""

    def __init__(self, bed, camera, seconds, during=None):
        camera.begin(SETTLED + seconds)
        time.sleep(SETTLED)
        camera.watch.ask("clear")
        server = bed.bridge.server
        used, begin = server.cpu_seconds(), time.monotonic()
        self.pings = pinged(bed, seconds, during=during)
        self.cpu = (server.cpu_seconds() - used) / (time.monotonic() - begin)
        camera.end(SETTLED + seconds)
        time.sleep(1)
        self.topics = server.status()["links"][0]["topics"]
        self.heard = camera.watch.ask("count", 180)
        end = begin + seconds
        self.at = [at for at in self.heard["at"] if at <= end]
        self.age = self.heard["age_ms"][: len(self.at)]
        self.ssim = self.heard["ssim"][: len(self.at)]
        self.per_second = len(self.at) / seconds
        times = [begin, *self.at, end]
        self.gap = max(after - before for before, after in zip(times, times[1:]))

    def ms(self, percent):
        return percentile(self.age, percent)

    def row(self, case):
        row = Row(case, self.pings)
        return row.tell(
            pictures_a_second=self.per_second,
            age_p50=self.ms(50),
            age_p95=self.ms(95),
            age_p99=self.ms(99),
            longest_gap_s=self.gap,
            ssim=sum(self.ssim) / len(self.ssim) if self.ssim else None,
            ssim_p10=percentile(self.ssim, 10),
            paired=self.heard["paired"] / max(self.heard["count"], 1),
            cpu_of_the_robots_bridge=self.cpu,
        )


def pictures(bed, effort):
    seconds = effort["seconds_of_pictures"]
    camera = Camera(bed)
    rows = [*steady(bed, camera, seconds), falling(bed, camera, seconds)]
    rows += [*beside_commands(bed, camera, seconds), *followed(bed, camera, effort)]
    rows += compressed(bed, seconds)
    return [*rows, *costs(bed, camera, seconds), *exact(bed, seconds), *first(bed)]


def steady(bed, camera, seconds):
    rows = []
    for megabits, least in STEADY:
        bed.wan.set(**THIN, up=megabits * 1e6)
        seen = Seen(bed, camera, seconds)
        row = seen.row(f"a camera on {megabits} Mbit/s")
        row.judge("pictures a second", seen.per_second, ">=", 25)
        row.judge("age p50, ms", seen.ms(50), "<=", 90).judge("p99", seen.ms(99), "<=", 140)
        row.judge("SSIM", row.told["ssim"], ">=", least)
        rows.append(row.judge("with CameraInfo", row.told["paired"], ">=", 1))
    return rows


def compressed(bed, seconds):
    """JPEGs become video, and JPEGs again."""
    jpegs, rows = Camera(bed, "name=/jpeg", "form=jpeg"), []
    bed.wan.set(**THIN, up=1_000_000)
    Seen(bed, jpegs, 3)  # exact ones that the faster link let out take seconds here
    for megabits in (1, 2):
        bed.wan.set(**THIN, up=megabits * 1e6)
        seen = Seen(bed, jpegs, seconds)
        row = seen.row(f"a camera of JPEGs (q 80) on {megabits} Mbit/s")
        row.judge("pictures a second", seen.per_second, ">=", 25)
        row.judge("age p50, ms", seen.ms(50), "<=", 90).judge("p99", seen.ms(99), "<=", 140)
        rows.append(row.judge("with CameraInfo", row.told["paired"], ">=", 1))
    return rows


def falling(bed, camera, seconds):
    third, stepped = seconds / 2, []

    def change():
        for rate in FALLING:
            bed.wan.set(**THIN, up=rate)
            stepped.append(time.monotonic())
            time.sleep(third)

    bed.wan.set(**THIN, up=FALLING[0])
    seen = Seen(bed, camera, 3 * third, during=change)
    row = seen.row("a camera on 18 -> 1.5 -> 0.5 Mbit/s")
    for begin, rate in list(zip(stepped, FALLING))[1:]:
        ages = [age for at, age in zip(seen.at, seen.age) if begin + 1 <= at < begin + third]
        what = f"age from 1 s after {rate / 1e6} Mbit/s, most, ms"
        row.judge(what, max(ages, default=None), "<=", 250)
    return row


def beside_commands(bed, camera, seconds):
    """The bounds are what commands need beside 500 kB at 10 Hz."""
    bed.wan.set(**NET)
    rows = [Row("commands alone", pinged(bed, seconds))]
    for rate in (NET["up"], 2_000_000):
        bed.wan.set(**{**NET, "up": rate})
        row = Seen(bed, camera, seconds).row(f"commands beside a camera, {rate / 1e6:g} Mbit/s")
        if rate == NET["up"]:
            row.judge("p50, ms", row.result.ms(50), "<=", 22.3)
            row.judge("p99", row.result.ms(99), "<=", 26.3)
        rows.append(row)
    return rows


def ways(effort):
    """Case -> a drive."""
    drives = {f"drive {seed}": {"seed": seed} for seed in effort["drives"][:2]}
    if effort["recorded"]:
        drives["recorded drive"] = dict(zip(("up", "down"), effort["recorded"]))
    return {case: {**way, "delay": 0.03, "queue_bytes": 600_000} for case, way in drives.items()}


def followed(bed, camera, effort):
    """Beside the ideal on the same drive: pictures of one packet each."""
    seconds, rows = effort["seconds_of_drive"], []
    talk, listen = talked(bed, "name=/wan/ideal", "depth=5")
    meet(talk, listen)
    for case, way in ways(effort).items():
        bed.wan.drive(**way)
        told = {"size": 1200, "hz": PER_SECOND, "seconds": SETTLED + seconds}
        talk.say(words("talk", told))
        time.sleep(SETTLED)
        listen.ask("count")
        time.sleep(seconds)
        ideal = listen.ask("count")["topics"][0]
        talk.answer(seconds + 60)
        bed.wan.drive(**way)
        seen = Seen(bed, camera, seconds)
        row = seen.row(f"a camera on {case}")
        for percent, more in ((50, 50), (95, 80)):
            best = percentile(ideal["age_ms"], percent) or 0
            what = f"age p{percent} beyond one packet's, ms"
            row.judge(what, seen.ms(percent) - best, "<=", more)
        share = len(seen.at) / max(ideal["count"], 1)
        rows.append(row.judge("pictures / one packet's", share, ">=", 0.8))
    return rows


def exact(bed, seconds):
    """A link that carries exact pictures has no others; after a thin moment it has them again."""
    bed.wan.set(**{**NET, "up": 50_000_000})
    bed.open("pictures")
    rows = []
    for rule, name in (("auto", "/camera"), ("never", "/never")):
        camera = Camera(bed, f"name={name}")
        seen = Seen(bed, camera, seconds)
        row = seen.row(f"a camera on 50 Mbit/s, lossy: {rule}")
        row.judge("exact", seen.heard["exact"] / max(seen.heard["count"], 1), ">=", 1)
        rows.append(row)
        if rule == "auto":
            rows.append(exact_again(bed, camera, seconds))
    return rows


def exact_again(bed, camera, seconds):
    bed.wan.set(**THIN, up=1_000_000)
    Seen(bed, camera, 3)
    bed.wan.set(**{**NET, "up": 50_000_000})
    Seen(bed, camera, 10)
    seen = Seen(bed, camera, seconds)
    row = seen.row("a camera on 1 -> 50 Mbit/s, from 16 s on")
    return row.judge("exact", seen.heard["exact"] / max(seen.heard["count"], 1), ">=", 1)


def first(bed):
    """Who subscribes to a camera that films sees it soon: on a new link, and again on the same."""
    rows = []
    for megabits in (1, 4):
        bed.wan.set(**THIN, up=megabits * 1e6)
        on_new, again = [], []
        for _ in range(3):
            bed.open("pictures")
            film = bed.worker(ROBOT, "pictures", "camera")
            film.ready()
            film.say("film seconds=60")
            time.sleep(SETTLED)
            on_new.append(first_picture(bed))
            again.append(first_picture(bed))
        row = Row(f"the first picture on {megabits} Mbit/s")
        for what, seen in (("a new link", on_new), ("the same link", again)):
            longest = max(seen, key=lambda one: one["s"])
            row.judge(f"on {what}, longest of 3, s", longest["s"], "<=", FIRST)
            row.tell(**{f"its_age_on_{what.replace(' ', '_')}_ms": longest["age_ms"]})
        rows.append(row)
    return rows


def first_picture(bed):
    """s: from the time at which a subscriber exists."""
    watch = bed.worker(OPERATOR, "pictures", "watch")
    watch.ready()
    ready = time.monotonic()
    time.sleep(SETTLED)
    heard = watch.ask("count", 180)
    watch.close()
    time.sleep(SETTLED)  # the demand ends
    if not heard["count"]:
        raise Missing("no picture arrives")
    return {"s": heard["at"][0] - ready, "age_ms": heard["age_ms"][0]}


def costs(bed, camera, seconds):
    rows = []
    large = Camera(bed, "name=/large", "width=1280", "height=720")
    for size, ends, most in (("640x480", camera, 0.15), ("1280x720", large, 0.35)):
        bed.wan.set(**THIN, up=4_000_000)
        seen = Seen(bed, ends, seconds)
        row = seen.row(f"a camera of {size} on 4 Mbit/s")
        rows.append(row.judge("CPU at 25 a second", 25 * seen.cpu / seen.per_second, "<=", most))
    return rows


def rivals(bed, effort):
    """Each on the same links, one after another."""
    seconds, rows = effort["seconds_of_pictures"], []
    cameras = {
        "bridge": lambda: Camera(bed),
        "CompressedImage q 80, exact, by the bridge": lambda: Camera(
            bed, "name=/exact_jpeg", "form=jpeg"
        ),
        "exact by the bridge": lambda: Camera(bed, "name=/never"),
        "WebRTC by aiortc": lambda: Call(bed),
    }
    bed.wan.set(**NET)
    for name, made in list(cameras.items()):
        try:
            cameras[name] = made()
        except Missing as error:
            print(f"left out: {name}: {error}", flush=True)
            del cameras[name]
    nets = {f"{rate} Mbit/s": ("set", {**THIN, "up": rate * 1e6}) for rate in (1, 2)}
    nets |= {case: ("drive", way) for case, way in ways(effort).items()}
    for net, (how, shape) in nets.items():
        others = []
        for name, camera in cameras.items():
            getattr(bed.wan, how)(**shape)
            seen = Seen(bed, camera, seconds)
            rows.append(seen.row(f"{net}: {name}"))
            if name != "bridge":
                others.append(seen)
            else:
                own, row = seen, rows[-1]
        for percent, most in ((50, 0.5), (95, 0.34)):
            best = min((one.ms(percent) for one in others if one.age), default=None)
            share = own.ms(percent) / best if best and own.age else None
            row.judge(f"age p{percent} / the best of the others", share, "<=", most)
    return rows
