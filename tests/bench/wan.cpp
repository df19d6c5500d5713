// A wide-area network between two network namespaces of its own, in user space: no kernel needs
// netem for it.
//
//   wan      {"ready":true,"robot":PID,"operator":PID}, or {"error":"..."} where it is forbidden
// A program is at a place by `nsenter --target PID --net --mount`. The robot is 10.77.0.1, the
// operator 10.77.0.2.
//
// Commands (timing.hpp), each answered by {"done":true}:
//   set up= down= delay= jitter= loss= queue=
//        up, down: bit/s from the robot and to it, 0: no limit; delay, jitter: s; loss: 0 to 1;
//        queue: s at the rate of its direction
//   drive seed= delay= queue_bytes=, or drive up= down= delay= queue_bytes=
//        the rates of a cellular drive that begins now (wan_drive.hpp); up, down: files of a
//        recorded one
//   cut, heal
//        nothing crosses; again
//   count
//        {"up":{...},"down":{...}} since the last count: bytes carried, bytes that the rate
//        allowed, frames lost and overflowed
//
// Multicast does not cross: the places must not find each other but by a bridge.
#include <poll.h>
#include <sys/timerfd.h>

#include <array>
#include <utility>

#include "timing.hpp"
#include "wan_direction.hpp"
#include "wan_place.hpp"

namespace bench {
namespace {

constexpr int kFramesAtOnce = 64;

bool is_multicast(const std::uint8_t* frame, std::size_t size) {
  return size > 34 && frame[12] == 8 && frame[13] == 0 && (frame[30] & 0xf0) == 0xe0;
}

class Wan {
 public:
  Wan() : robot_("10.77.0.1"), operator_("10.77.0.2") {
    for (auto& way : ways_) way.direction.count_from(now_ns());
  }

  void tell_ready() const {
    answer("{\"ready\":true,\"robot\":" + std::to_string(robot_.pid()) +
           ",\"operator\":" + std::to_string(operator_.pid()) + "}");
  }

  // Ends when stdin does.
  void run() {
    const int timer = timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
    must(timer >= 0, "timer");
    while (!commands_.ended()) {
      arm(timer);
      std::array<pollfd, 4> fds{{{robot_.device(), POLLIN, 0},
                                 {operator_.device(), POLLIN, 0},
                                 {timer, POLLIN, 0},
                                 {STDIN_FILENO, POLLIN, 0}}};
      if (poll(fds.data(), fds.size(), -1) < 0 && errno != EINTR) break;
      std::uint64_t expirations = 0;
      (void)!read(timer, &expirations, sizeof expirations);
      if (fds[3].revents != 0) {
        if (const auto command = commands_.next(0)) obey(*command);
      }
      for (auto& way : ways_) carry(way);
    }
  }

 private:
  struct Way {
    const Place& from;
    const Place& to;
    Direction direction;
  };

  void arm(int timer) {
    const auto when = std::min(ways_[0].direction.due(), ways_[1].direction.due());
    itimerspec at{};
    if (when != std::numeric_limits<std::int64_t>::max()) {
      at.it_value.tv_sec = when / 1'000'000'000;
      at.it_value.tv_nsec = std::max<long>(when % 1'000'000'000, 1);
    }
    timerfd_settime(timer, TFD_TIMER_ABSTIME, &at, nullptr);
  }

  void carry(Way& way) {
    for (int i = 0; i < kFramesAtOnce; ++i) {
      const auto n = read(way.from.device(), buffer_.data(), buffer_.size());
      if (n <= 0) break;
      const auto size = static_cast<std::size_t>(n);
      if (!is_multicast(buffer_.data(), size)) way.direction.take(buffer_.data(), size, now_ns());
    }
    while (const auto frame = way.direction.give(now_ns())) {
      (void)!write(way.to.device(), frame->data(), frame->size());
    }
  }

  void obey(const Options& command) {
    if (command.verb == "count") return tell_count();
    if (command.verb == "set") {
      shape(0, command, command.number("up", 0));
      shape(1, command, command.number("down", 0));
    } else if (command.verb == "drive") {
      drive(command);
    } else if (command.verb == "cut" || command.verb == "heal") {
      for (auto& way : ways_) way.direction.cut(command.verb == "cut");
    } else {
      return answer(R"({"error":"unknown command"})");
    }
    answer(R"({"done":true})");
  }

  void drive(const Options& command) {
    for (std::size_t i = 0; i < ways_.size(); ++i) {
      const std::string file = command.text(i == 0 ? "up" : "down", "");
      Shape shape;
      shape.delay_ns = to_ns(command.number("delay", 0));
      shape.queue_bytes = static_cast<std::int64_t>(command.count("queue_bytes", 600'000));
      ways_[i].direction.set(shape);
      ways_[i].direction.follow(
          file.empty() ? Drive(2 * command.count("seed", 1) + i) : Drive::recorded(file), now_ns());
    }
  }

  void shape(std::size_t way, const Options& command, double rate) {
    Shape shape;
    shape.bits_per_second = rate;
    shape.delay_ns = to_ns(command.number("delay", 0));
    shape.jitter_ns = to_ns(command.number("jitter", 0));
    shape.loss = command.number("loss", 0);
    if (rate > 0) {
      const auto bytes = static_cast<std::int64_t>(rate / 8 * command.number("queue", 0.2));
      shape.queue_bytes = std::max<std::int64_t>(bytes, 3000);
    }
    ways_[way].direction.set(shape);
  }

  void tell_count() {
    std::string text;
    for (auto& way : ways_) {
      const auto count = way.direction.count(now_ns());
      char one[200];
      std::snprintf(
          one, sizeof one,
          R"(%s"%s":{"carried_bytes":%llu,"possible_bytes":%.0f,"lost":%llu,"overflowed":%llu})",
          text.empty() ? "{" : ",", text.empty() ? "up" : "down",
          static_cast<unsigned long long>(count.carried_bytes), count.possible_bytes,
          static_cast<unsigned long long>(count.lost),
          static_cast<unsigned long long>(count.overflowed));
      text += one;
    }
    answer(text + "}");
  }

  Place robot_, operator_;
  std::array<Way, 2> ways_{{{robot_, operator_, Direction(1)}, {operator_, robot_, Direction(2)}}};
  Commands commands_;
  std::array<std::uint8_t, 65536> buffer_{};
};

}  // namespace
}  // namespace bench

int main() try {
  prctl(PR_SET_TIMERSLACK, 1000);
  bench::Wan wan;
  // Packets must not wait for the measured programs. Without the privilege for this it is less
  // exact.
  sched_param first{};
  first.sched_priority = 5;
  (void)sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &first);
  wan.tell_ready();
  wan.run();
  return 0;
} catch (const std::exception& e) {
  bench::answer(std::string("{\"error\":\"") + e.what() + "\"}");
  return 1;
}
