// The ends of what tools/bench/wan measures: pings and streams of several topics each. The clock is
// one for both ends, so the age of a message on arrival is measured and not guessed.
//
//   wan_bench echo topics=          /wan/ping_<i> -> /wan/pong_<i>
//   wan_bench ping topics=          commands: ping size= samples= hz= timeout= use=
//        samples: of each topic; hz 0: closed loop; use: of so many topics
//        {"lost":N,"ms":[[...] of each topic],"at":[[...]]}    at: when each was sent, s
//   wan_bench talk name= topics=    commands: talk size= hz= seconds= use=
//        publishes <name>_<i>, one after another, numbered from 1
//        {"sent":N of each,"began":s}
//   wan_bench listen name= topics=  commands: count, of what came since the last one
//        {"topics":[{"count":,"repeated":,"disordered":,"last":,"age_ms":[...],"at":[...]}]}
// Options of all: depth= (default 100), reliable=0, latched=1.
#include <set>

#include "ros_node.hpp"

namespace bench {
namespace {

double seconds(std::int64_t ns) {
  return static_cast<double>(ns) / 1e9;
}

template <class T>
std::vector<std::unique_ptr<T>> entities(Node& node, const std::string& name, std::size_t count) {
  std::vector<std::unique_ptr<T>> all;
  for (std::size_t i = 0; i < count; ++i) {
    all.push_back(std::make_unique<T>(node, name + "_" + std::to_string(i)));
  }
  return all;
}

std::vector<Subscription*> pointers(const std::vector<std::unique_ptr<Subscription>>& all) {
  std::vector<Subscription*> raw;
  for (const auto& one : all) raw.push_back(one.get());
  return raw;
}

// Commands may use the first topics only.
std::size_t used(const Options& command, std::size_t topics) {
  return std::clamp<std::size_t>(command.count("use", topics), 1, topics);
}

std::string joined(const std::vector<std::string>& texts) {
  std::string all = "[";
  for (const auto& text : texts) {
    if (all.size() > 1) all += ',';
    all += text;
  }
  return all + "]";
}

void run_echo(Node& node, Commands& commands, std::size_t topics) {
  const auto in = entities<Subscription>(node, "/wan/ping", topics);
  const auto out = entities<Publisher>(node, "/wan/pong", topics);
  WaitSet waiter(node, pointers(in));
  Message message(kBodyBytesMin);
  answer("{\"ready\":true}");
  while (!commands.ended()) {
    if (!waiter.wait_until(now_ns() + kSecond / 2)) {
      (void)commands.next(0);
      continue;
    }
    for (std::size_t i = 0; i < topics; ++i) {
      while (in[i]->take(message)) out[i]->send(message);
    }
  }
}

// One topic that is pinged.
struct Pinged {
  std::map<std::uint32_t, std::int64_t> open;  // sequence -> sent at
  std::vector<double> ms, at;
  std::int64_t next = 0;
  std::size_t sent = 0;
};

class Ping {
 public:
  Ping(Node& node, std::size_t topics)
      : out_(entities<Publisher>(node, "/wan/ping", topics)),
        in_(entities<Subscription>(node, "/wan/pong", topics)),
        waiter_(node, pointers(in_)) {}

  // Small messages until each topic has given one back; false: one does not.
  bool warm_up() {
    Message message(kBodyBytesMin);
    message.put(kWarmUp);
    std::vector<bool> heard(in_.size(), false);
    for (const auto end = now_ns() + 40 * kSecond; now_ns() < end;) {
      for (std::size_t i = 0; i < out_.size(); ++i) {
        if (!heard[i] && out_[i]->peers() > 0) out_[i]->send(message);
      }
      for (const auto until = now_ns() + kSecond / 5; now_ns() < until;) {
        if (!waiter_.wait_until(until)) continue;
        for (std::size_t i = 0; i < in_.size(); ++i) {
          while (in_[i]->take(received_)) heard[i] = true;
        }
      }
      if (std::all_of(heard.begin(), heard.end(), [](bool one) { return one; })) return true;
    }
    return false;
  }

  std::string measure(const Options& options) {
    Message message(options.count("size", kBodyBytesMin));
    samples_ = options.count("samples", 200);
    period_ = options.number("hz", 0) > 0 ? to_ns(1 / options.number("hz", 0)) : 0;
    gap_ = to_ns(options.number("gap", 0.002));
    const auto timeout = to_ns(options.number("timeout", 5));
    topics_.assign(used(options, out_.size()), {});
    lost_ = 0;
    const auto begin = now_ns();
    for (std::size_t i = 0; i < topics_.size(); ++i) {
      topics_[i].next = begin + period_ * static_cast<std::int64_t>(i) /
                                    static_cast<std::int64_t>(topics_.size());
    }
    while (!done()) {
      auto wake = now_ns() + kSecond / 10;
      for (std::size_t i = 0; i < topics_.size(); ++i) {
        wake = std::min(wake, send_due(i, message, now_ns() - timeout));
      }
      take_until(wake);
    }
    std::vector<std::string> ms, at;
    for (const auto& topic : topics_) {
      ms.push_back(json_array(topic.ms));
      at.push_back(json_array(topic.at));
    }
    return "{\"lost\":" + std::to_string(lost_) + ",\"ms\":" + joined(ms) +
           ",\"at\":" + joined(at) + "}";
  }

 private:
  [[nodiscard]] bool done() const {
    return std::all_of(topics_.begin(), topics_.end(), [this](const Pinged& topic) {
      return topic.sent >= samples_ && topic.open.empty();
    });
  }
  // Sends what is due on this topic, gives up what was sent before; when it has to be called next.
  std::int64_t send_due(std::size_t i, Message& message, std::int64_t before) {
    auto& topic = topics_[i];
    while (!topic.open.empty() && topic.open.begin()->second < before) {
      ++lost_;
      topic.open.erase(topic.open.begin());
    }
    for (;;) {
      if (topic.sent >= samples_ || (period_ == 0 && !topic.open.empty())) {
        return now_ns() + kSecond / 10;
      }
      if (topic.next > now_ns()) return topic.next;
      message.put(++sequence_);
      topic.open[sequence_] = now_ns();
      out_[i]->send(message);
      ++topic.sent;
      topic.next += period_;
    }
  }
  void take_until(std::int64_t wake) {
    if (!waiter_.wait_until(wake)) return;
    for (std::size_t i = 0; i < topics_.size(); ++i) {
      auto& topic = topics_[i];
      while (in_[i]->take(received_)) {
        const auto now = now_ns();
        const auto it = topic.open.find(received_.word(0));
        if (it == topic.open.end()) continue;  // late: counted as lost already
        topic.ms.push_back(static_cast<double>(now - it->second) / 1e6);
        topic.at.push_back(seconds(it->second));
        topic.open.erase(it);
        if (period_ == 0) topic.next = now_ns() + gap_;
      }
    }
  }

  std::vector<std::unique_ptr<Publisher>> out_;
  std::vector<std::unique_ptr<Subscription>> in_;
  WaitSet waiter_;
  Message received_{kBodyBytesMin};
  std::vector<Pinged> topics_;
  std::uint32_t sequence_ = 0;
  std::size_t samples_ = 0, lost_ = 0;
  std::int64_t period_ = 0, gap_ = 0;
};

void run_ping(Node& node, Commands& commands, std::size_t topics) {
  Ping ping(node, topics);
  answer(ping.warm_up() ? "{\"ready\":true}" : "{\"error\":\"no echo\"}");
  while (!commands.ended()) {
    if (const auto command = commands.next(1000)) answer(ping.measure(*command));
  }
}

// A message carries its number and when it was published.
void stamp(Message& message, std::uint32_t number) {
  const auto now = static_cast<std::uint64_t>(now_ns());
  message.put(number, static_cast<std::uint32_t>(now >> 32), static_cast<std::uint32_t>(now));
}
std::int64_t stamp_of(const Message& message) {
  return static_cast<std::int64_t>(std::uint64_t{message.word(1)} << 32 | message.word(2));
}

void run_talk(Node& node, Commands& commands, const std::string& name, std::size_t topics) {
  const auto out = entities<Publisher>(node, name, topics);
  answer("{\"ready\":true}");
  while (!commands.ended()) {
    const auto command = commands.next(1000);
    if (!command) continue;
    Message message(command->count("size", 10'000));
    const auto use = used(*command, topics);
    const auto step = to_ns(1 / command->number("hz", 10)) / static_cast<std::int64_t>(use);
    const auto begin = now_ns();
    const auto end = begin + to_ns(command->number("seconds", 5));
    std::uint32_t sent = 0;
    for (auto next = begin; next < end; ++sent) {
      for (std::size_t i = 0; i < use; ++i, next += step) {
        sleep_until(next);
        stamp(message, sent + 1);
        out[i]->send(message);
      }
    }
    answer("{\"sent\":" + std::to_string(sent) + ",\"began\":" + std::to_string(seconds(begin)) +
           "}");
  }
}

// One topic that is listened to.
struct Heard {
  std::size_t repeated = 0, disordered = 0;
  std::uint32_t last = 0;
  std::set<std::uint32_t> numbers;
  std::vector<double> age_ms, at;

  void take(const Message& message) {
    const auto now = now_ns();
    const auto number = message.word(0);
    if (number < last) ++disordered;
    if (!numbers.insert(number).second) ++repeated;
    last = number;
    age_ms.push_back(static_cast<double>(now - stamp_of(message)) / 1e6);
    at.push_back(seconds(now));
  }
  [[nodiscard]] std::string text() const {
    return "{\"count\":" + std::to_string(at.size()) + ",\"repeated\":" + std::to_string(repeated) +
           ",\"disordered\":" + std::to_string(disordered) + ",\"last\":" + std::to_string(last) +
           ",\"age_ms\":" + json_array(age_ms) + ",\"at\":" + json_array(at) + "}";
  }
};

void run_listen(Node& node, Commands& commands, const std::string& name, std::size_t topics) {
  const auto in = entities<Subscription>(node, name, topics);
  WaitSet waiter(node, pointers(in));
  Message message(kBodyBytesMin);
  std::vector<Heard> heard(topics);
  answer("{\"ready\":true}");
  while (!commands.ended()) {
    if (waiter.wait_until(now_ns() + kSecond / 20)) {
      for (std::size_t i = 0; i < topics; ++i) {
        while (in[i]->take(message)) heard[i].take(message);
      }
    }
    if (!commands.next(0)) continue;
    std::vector<std::string> texts;
    for (const auto& one : heard) texts.push_back(one.text());
    answer("{\"topics\":" + joined(texts) + "}");
    heard.assign(topics, {});
  }
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Options options;
  for (int i = 1; i < argc; ++i) options.add(argv[i]);
  const auto& mode = options.verb;
  const auto name = options.text("name", "/wan/stream");
  const auto topics = std::max<std::size_t>(options.count("topics", 1), 1);
  bench::Commands commands;
  bench::Node node("wan_" + mode, options.count("depth", 100), options.number("reliable", 1) != 0,
                   options.number("latched", 0) != 0);
  if (mode == "echo") {
    bench::run_echo(node, commands, topics);
  } else if (mode == "ping") {
    bench::run_ping(node, commands, topics);
  } else if (mode == "talk") {
    bench::run_talk(node, commands, name, topics);
  } else if (mode == "listen") {
    bench::run_listen(node, commands, name, topics);
  } else {
    std::fprintf(stderr, "usage: wan_bench echo|ping|talk|listen [key=value ...]\n");
    return 2;
  }
  return 0;
}
