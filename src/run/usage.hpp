// How many bytes this program has cost on the network, by day and month: for SIM cards that are
// paid by the megabyte.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "net/traffic.hpp"

namespace connect_bridge {

// Days are those of the machine's time zone. Not thread-safe.
class Usage {
 public:
  static constexpr std::size_t kDaysMax = 62;  // that are kept: this month and the one before

  // What was counted before, from a file of write_text(); replaces what is here. False: it is none,
  // and nothing has changed.
  [[nodiscard]] bool read_text(const std::string& text);
  [[nodiscard]] std::string write_text() const;

  // `total`: what the program has cost since it was started. `day`: "2026-11-22".
  void count(const Traffic& total, const std::string& day);
  [[nodiscard]] Traffic of_day(const std::string& day) const;
  // `month`: "2026-11".
  [[nodiscard]] Traffic of_month(const std::string& month) const;

 private:
  std::map<std::string, Traffic> days_;
  Traffic counted_;
};

// The day of now, "2026-11-22".
[[nodiscard]] std::string today();

// Keeps a Usage in a file, which is written once a minute and at the end.
class UsageFile {
 public:
  // Reads the file, if there is one. What is wrong with it, or nothing; a file that is not
  // understood is put aside, as NAME.broken.
  [[nodiscard]] std::string open(const std::string& file);
  // Once a second. Returns a problem when it begins.
  [[nodiscard]] std::string every_second(const Traffic& total, const std::string& day);
  // At the end.
  void close();
  [[nodiscard]] const Usage& usage() const { return usage_; }

 private:
  [[nodiscard]] std::string write();

  std::string file_;  // empty: it is kept in memory
  std::string problem_;
  Usage usage_;
  unsigned seconds_ = 0;
};

}  // namespace connect_bridge
