// Time, numbers and the line protocol of the benchmark tools.
//
// A tool that measures reads one command per line from stdin, "<verb> key=value ...", and answers
// with one JSON object per line on stdout. It prints {"ready":true} when it can take commands, and
// ends when stdin closes: so the runner can keep all tools alive, interleave their measurements,
// and leave no process behind however it ends.
#pragma once

#include <poll.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace bench {

inline std::int64_t now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
}

inline constexpr std::int64_t kSecond = 1'000'000'000;  // ns

inline std::int64_t to_ns(double seconds) {
  return static_cast<std::int64_t>(seconds * 1e9);
}

inline void sleep_until(std::int64_t when_ns) {
  const timespec t{when_ns / 1'000'000'000LL, when_ns % 1'000'000'000LL};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr);
}

inline void answer(const std::string& json) {
  std::puts(json.c_str());
  std::fflush(stdout);
}

// Round trips in ms as a JSON array: the runner pools them over its rounds before it takes
// percentiles.
inline std::string json_array(const std::vector<double>& values) {
  std::string text = "[";
  char number[32];
  for (const double v : values) {
    std::snprintf(number, sizeof number, "%s%.4f", text.size() > 1 ? "," : "", v);
    text += number;
  }
  return text + "]";
}

// Incompressible bytes, so that a compressing bridge gains nothing unfairly.
inline void fill(std::uint8_t* data, std::size_t size) {
  std::uint64_t x = 88172645463325252ULL;
  for (std::size_t i = 0; i < size; ++i) {
    x ^= x << 13;
    x ^= x >> 7;
    x ^= x << 17;
    data[i] = static_cast<std::uint8_t>(x);
  }
}

// "<verb> key=value ...", from a line of stdin or from the command line.
class Options {
 public:
  void add(const std::string& word) {
    const auto equals = word.find('=');
    if (equals == std::string::npos) {
      verb = word;
    } else {
      values_[word.substr(0, equals)] = word.substr(equals + 1);
    }
  }
  [[nodiscard]] double number(const std::string& key, double otherwise) const {
    const auto it = values_.find(key);
    return it == values_.end() ? otherwise : std::strtod(it->second.c_str(), nullptr);
  }
  [[nodiscard]] std::size_t count(const std::string& key, std::size_t otherwise) const {
    return static_cast<std::size_t>(number(key, static_cast<double>(otherwise)));
  }
  [[nodiscard]] std::string text(const std::string& key, const std::string& otherwise) const {
    const auto it = values_.find(key);
    return it == values_.end() ? otherwise : it->second;
  }

  std::string verb;

 private:
  std::map<std::string, std::string> values_;
};

// Commands from stdin without blocking the rest of the tool.
class Commands {
 public:
  // The next command, waiting for it at most this long; nullopt: none yet, or ended() is true.
  std::optional<Options> next(int wait_ms) {
    for (;;) {
      const auto newline = text_.find('\n');
      if (newline != std::string::npos) {
        Options options;
        std::istringstream line(text_.substr(0, newline));
        for (std::string word; line >> word;) options.add(word);
        text_.erase(0, newline + 1);
        return options;
      }
      pollfd fd{STDIN_FILENO, POLLIN, 0};
      if (ended_ || ::poll(&fd, 1, wait_ms) <= 0) return std::nullopt;
      char buffer[512];
      const auto n = ::read(STDIN_FILENO, buffer, sizeof buffer);
      if (n <= 0) {
        ended_ = true;
      } else {
        text_.append(buffer, static_cast<std::size_t>(n));
      }
    }
  }
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  std::string text_;
  bool ended_ = false;
};

}  // namespace bench
