// Measures anything that carries ROS 2 topics: round trips, throughput and plain streams.
// tools/bench/run drives it.
//
//   ros_bench echo                 /bench/ping -> /bench/pong
//   ros_bench ping                 commands: ping size= samples= hz= (0: closed loop) gap= timeout=
//   ros_bench sink                 counts /bench/flood, acknowledges on /bench/flood_ack
//   ros_bench source               commands: flood size= seconds= window=
//   ros_bench talk                 commands: talk size= hz= seconds=   publishes /bench/stream
//   ros_bench both                 echo and talk by one node, as a bridge's side publishes both
//   ros_bench listen               commands: count   a bare subscriber of /bench/stream
//   ros_bench topics count=300     publishers that say nothing
//   ros_bench idle                 a bare node
//   ros_bench serve                answers /bench/service
//   ros_bench call                 commands: call size= samples= seconds= window= gap=
//   ros_bench relay take= give=    half of a bare bridge (relay.hpp); port=: the other half
// Options of all: depth= (default 100). The protocol on stdin and stdout is in timing.hpp.
#include <unistd.h>

#include <atomic>
#include <thread>

#include "relay.hpp"
#include "ros_calls.hpp"
#include "ros_node.hpp"

namespace bench {
namespace {

// ---- round trips
// ---------------------------------------------------------------------------------

void run_echo(Node& node, Commands& commands) {
  Subscription in(node, "/bench/ping");
  Publisher out(node, "/bench/pong");
  WaitSet waiter(node, {&in});
  Message message(kBodyBytesMin);
  answer("{\"ready\":true}");
  while (!commands.ended()) {
    if (waiter.wait_until(now_ns() + kSecond / 2)) {
      while (in.take(message)) out.send(message);
    } else {
      (void)commands.next(0);
    }
  }
}

class Ping {
 public:
  explicit Ping(Node& node)
      : out_(node, "/bench/ping"), in_(node, "/bench/pong"), waiter_(node, {&in_}) {}

  // Small messages until one comes back; false: there is no echo.
  bool warm_up() {
    Message message(kBodyBytesMin);
    for (const auto end = now_ns() + 40 * kSecond; now_ns() < end;) {
      message.put(kWarmUp);
      if (out_.peers() > 0) out_.send(message);
      const auto until = now_ns() + kSecond / 5;
      while (now_ns() < until) {
        if (waiter_.wait_until(until) && in_.take(received_)) {
          drain(kSecond / 10);
          return true;
        }
      }
    }
    return false;
  }

  std::string measure(const Options& options) {
    Message message(options.count("size", kBodyBytesMin));
    const auto samples = options.count("samples", 200);
    const auto hz = options.number("hz", 0);
    const auto timeout = to_ns(options.number("timeout", 3));
    const auto period = hz > 0 ? to_ns(1 / hz) : 0;
    const auto gap = to_ns(options.number("gap", 0.002));
    open_.clear();
    times_.clear();
    lost_ = wrong_ = 0;
    std::int64_t next = now_ns();
    for (std::size_t sent = 0; sent < samples || !open_.empty();) {
      const auto now = now_ns();
      give_up(now - timeout);
      const bool may_send = sent < samples && (period > 0 || open_.empty());
      if (may_send && now >= next) {
        message.put(++sequence_);
        open_[sequence_] = now_ns();
        out_.send(message);
        ++sent;
        if (period > 0) next += period;
        continue;
      }
      auto wake = now + kSecond / 10;
      if (may_send) wake = std::min(wake, next);
      if (take_until(wake, message.body_bytes()) && period == 0) next = now_ns() + gap;
    }
    return "{\"lost\":" + std::to_string(lost_) + ",\"wrong\":" + std::to_string(wrong_) +
           ",\"ms\":" + json_array(times_) + "}";
  }

 private:
  void drain(std::int64_t quiet_ns) {
    while (waiter_.wait_until(now_ns() + quiet_ns)) {
      while (in_.take(received_)) {
      }
    }
  }
  void give_up(std::int64_t before) {
    while (!open_.empty() && open_.begin()->second < before) {
      ++lost_;
      open_.erase(open_.begin());
    }
  }
  bool take_until(std::int64_t wake, std::size_t body_bytes) {
    bool took = false;
    if (!waiter_.wait_until(wake)) return took;
    while (in_.take(received_)) {
      const auto now = now_ns();
      const auto it = open_.find(received_.word(0));
      if (it == open_.end()) continue;  // late: counted as lost already
      if (received_.body_bytes() != body_bytes) ++wrong_;
      times_.push_back(static_cast<double>(now - it->second) / 1e6);
      open_.erase(it);
      took = true;
    }
    return took;
  }

  Publisher out_;
  Subscription in_;
  WaitSet waiter_;
  Message received_{kBodyBytesMin};
  std::map<std::uint32_t, std::int64_t> open_;  // sequence -> sent at
  std::vector<double> times_;
  std::uint32_t sequence_ = 0;
  std::size_t lost_ = 0, wrong_ = 0;
};

void run_ping(Node& node, Commands& commands) {
  Ping ping(node);
  answer(ping.warm_up() ? "{\"ready\":true}" : "{\"error\":\"no echo\"}");
  while (!commands.ended()) {
    if (const auto command = commands.next(1000)) answer(ping.measure(*command));
  }
}

// ---- throughput
// ------------------------------------------------------------------------------------

// Flood: sequence, run, and after how many messages to acknowledge. Acknowledgement: highest, run,
// count.
void run_sink(Node& node, Commands& commands) {
  Subscription in(node, "/bench/flood");
  Publisher out(node, "/bench/flood_ack");
  WaitSet waiter(node, {&in});
  Message message(kBodyBytesMin), ack(kBodyBytesMin);
  std::uint32_t run = 0, count = 0, highest = 0, told = 0;
  const auto tell = [&] {
    ack.put(highest, run, count);
    out.send(ack);
    told = count;
  };
  answer("{\"ready\":true}");
  while (!commands.ended()) {
    if (!waiter.wait_until(now_ns() + (told != count ? kSecond / 50 : kSecond / 2))) {
      if (told != count) tell();
      (void)commands.next(0);
      continue;
    }
    while (in.take(message)) {
      if (message.word(1) != run) {
        run = message.word(1);
        count = highest = told = 0;
      }
      ++count;
      highest = std::max(highest, message.word(0));
      if (count - told >= message.word(2)) tell();
    }
  }
}

class Source {
 public:
  explicit Source(Node& node)
      : out_(node, "/bench/flood"), in_(node, "/bench/flood_ack"), waiter_(node, {&in_}) {}

  bool warm_up() {
    Message message(kBodyBytesMin);
    begin_run();
    for (const auto end = now_ns() + 40 * kSecond; now_ns() < end;) {
      message.put(0, run_, 1);
      if (out_.peers() > 0) out_.send(message);
      take_acks(now_ns() + kSecond / 5);
      if (received_ > 0) return true;
    }
    return false;
  }

  // `window` messages may be on their way unacknowledged, so that nothing may overflow between here
  // and the sink.
  std::string measure(const Options& options) {
    Message message(options.count("size", kBodyBytesMin));
    const auto window = static_cast<std::uint32_t>(options.count("window", 64));
    const auto every = std::max<std::uint32_t>(window / 4, 1);
    begin_run();
    std::uint32_t sent = 0;
    std::size_t stalls = 0;
    const auto start = now_ns();
    const auto end = start + to_ns(options.number("seconds", 2));
    last_ack_ = start;
    while (now_ns() < end) {
      for (std::uint32_t i = 0; i < every && sent - highest_ < window; ++i) {
        message.put(++sent, run_, every);
        out_.send(message);
      }
      take_acks(sent - highest_ < window ? 0 : now_ns() + kSecond / 10);
      if (sent - highest_ >= window &&
          now_ns() - last_ack_ > kSecond) {  // lost: go on, it is counted
        ++stalls;
        highest_ = sent;
        last_ack_ = now_ns();
      }
    }
    while (received_ < sent && now_ns() - last_ack_ < kSecond) take_acks(now_ns() + kSecond / 10);
    const double seconds = static_cast<double>(last_ack_ - start) / 1e9;
    char text[256];
    std::snprintf(text, sizeof text,
                  "{\"sent\":%u,\"received\":%u,\"lost\":%u,\"stalls\":%zu,\"seconds\":%.4f,\"per_"
                  "second\":%.2f}",
                  sent, received_, sent - received_, stalls, seconds, received_ / seconds);
    return text;
  }

 private:
  void begin_run() {
    run_ = static_cast<std::uint32_t>(now_ns() / 1000);
    highest_ = received_ = 0;
  }
  void take_acks(std::int64_t until) {
    if (!waiter_.wait_until(until)) return;
    while (in_.take(ack_)) {
      if (ack_.word(1) != run_) continue;
      highest_ = std::max(highest_, ack_.word(0));
      received_ = ack_.word(2);
      last_ack_ = now_ns();
    }
  }

  Publisher out_;
  Subscription in_;
  WaitSet waiter_;
  Message ack_{kBodyBytesMin};
  std::uint32_t run_ = 0, highest_ = 0, received_ = 0;
  std::int64_t last_ack_ = 0;
};

void run_source(Node& node, Commands& commands) {
  Source source(node);
  answer(source.warm_up() ? "{\"ready\":true}" : "{\"error\":\"no acknowledgement\"}");
  while (!commands.ended()) {
    if (const auto command = commands.next(1000)) answer(source.measure(*command));
  }
}

// ---- plain streams
// -----------------------------------------------------------------------------------

// A bare rcl publisher: sleeps and publishes.
void run_talk(Node& node, Commands& commands) {
  Publisher out(node, "/bench/stream");
  answer("{\"ready\":true}");
  while (!commands.ended()) {
    const auto command = commands.next(1000);
    if (!command) continue;
    Message message(command->count("size", 10'000));
    const auto period = to_ns(1 / command->number("hz", 100));
    const auto end = now_ns() + to_ns(command->number("seconds", 5));
    std::uint32_t sent = 0;
    for (auto next = now_ns(); next < end; next += period) {
      sleep_until(next);
      message.put(++sent);
      out.send(message);
    }
    answer("{\"sent\":" + std::to_string(sent) + ",\"failed\":" + std::to_string(out.failed()) +
           ",\"peers\":" + std::to_string(out.peers()) + "}");
  }
}

// What a bridge's side does for a ping next to a stream, without a bridge: both publishers belong
// to one participant and share its shared memory.
void run_both(Node& node, Commands& commands) {
  std::atomic<bool> over = false;
  std::thread echo([&] {
    Subscription in(node, "/bench/ping");
    Publisher out(node, "/bench/pong");
    WaitSet waiter(node, {&in});
    Message message(kBodyBytesMin);
    while (!over) {
      if (!waiter.wait_until(now_ns() + kSecond / 5)) continue;
      while (in.take(message)) out.send(message);
    }
  });
  run_talk(node, commands);
  over = true;
  echo.join();
}

// A bare rcl subscriber: waits and takes.
void run_listen(Node& node, Commands& commands) {
  Subscription in(node, "/bench/stream");
  WaitSet waiter(node, {&in});
  Message message(kBodyBytesMin);
  std::size_t count = 0;
  answer("{\"ready\":true}");
  while (!commands.ended()) {
    if (waiter.wait_until(now_ns() + kSecond / 4)) {
      while (in.take(message)) ++count;
    } else if (commands.next(0)) {
      answer("{\"count\":" + std::to_string(count) + "}");
      count = 0;
    }
  }
}

void run_idle(Node& node, Commands& commands, std::size_t topics) {
  std::vector<std::unique_ptr<Publisher>> publishers;
  for (std::size_t i = 0; i < topics; ++i) {
    publishers.push_back(std::make_unique<Publisher>(node, "/bench/idle_" + std::to_string(i)));
  }
  answer("{\"ready\":true}");
  while (!commands.ended()) (void)commands.next(60'000);
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Options options;
  for (int i = 1; i < argc; ++i) options.add(argv[i]);
  const auto& mode = options.verb;
  bench::Commands commands;
  // Deep enough that messages after a stall are late and not lost.
  bench::Node node(mode.empty() ? "bench" : "bench_" + mode, options.count("depth", 100));
  if (mode == "echo") {
    bench::run_echo(node, commands);
  } else if (mode == "ping") {
    bench::run_ping(node, commands);
  } else if (mode == "sink") {
    bench::run_sink(node, commands);
  } else if (mode == "source") {
    bench::run_source(node, commands);
  } else if (mode == "talk") {
    bench::run_talk(node, commands);
  } else if (mode == "both") {
    bench::run_both(node, commands);
  } else if (mode == "listen") {
    bench::run_listen(node, commands);
  } else if (mode == "serve") {
    bench::run_serve(node, commands);
  } else if (mode == "call") {
    bench::run_call(node, commands);
  } else if (mode == "relay") {
    bench::run_relay(node, commands, options);
  } else if (mode == "topics" || mode == "idle") {
    bench::run_idle(node, commands, mode == "idle" ? 0 : options.count("count", 300));
  } else {
    std::fprintf(
        stderr,
        "usage: ros_bench echo|ping|sink|source|talk|both|listen|topics|idle|serve|call|relay "
        "[key=value ...]\n");
    return 2;
  }
  return 0;
}
