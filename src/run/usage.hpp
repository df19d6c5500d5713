// How many bytes this program has used on the network, by day and month: for SIM cards that are
// paid by the megabyte.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <map>
#include <string>

#include "net/traffic.hpp"

namespace connect_bridge {

// Days are those of the machine's time zone. Not thread-safe.
class Usage {
 public:
  static constexpr std::size_t kDaysMax = 62;  // kept: this month and the previous one

  // Replaces the counts by those of a file from write_text(). False: the text is not valid, and
  // nothing has changed.
  [[nodiscard]] bool read_text(const std::string& text);
  [[nodiscard]] std::string write_text() const;

  // `total`: the program's traffic since its start. `day`: "2026-11-22".
  void count(const Traffic& total, const std::string& day);
  [[nodiscard]] Traffic of_day(const std::string& day) const;
  // `month`: "2026-11".
  [[nodiscard]] Traffic of_month(const std::string& month) const;

 private:
  std::map<std::string, Traffic> days_;
  Traffic counted_;
};

// The present day, "2026-11-22".
[[nodiscard]] std::string today();

// Stores a Usage in a file, NAME, which is written once a minute and at the end. The one before
// stays as NAME.1: to wait for the disk would hold up the loop, and without that a loss of power
// can leave a new file empty.
class UsageFile {
 public:
  // Reads the file, or NAME.1 if it is missing or not valid. Returns what is wrong with it, or
  // nothing; a file that is not valid is renamed to NAME.broken.
  [[nodiscard]] std::string open(const std::string& file);
  // Once a second. Returns a problem when it begins.
  [[nodiscard]] std::string every_second(const Traffic& total, const std::string& day);
  // At the end.
  void close();
  [[nodiscard]] const Usage& usage() const { return usage_; }

 private:
  // Whether its counts are used now.
  [[nodiscard]] bool read(std::istream& in);
  void keep_former() const;
  [[nodiscard]] std::string write();

  std::string file_;  // empty: it is kept in memory
  std::string problem_;
  Usage usage_;
  unsigned seconds_ = 0;
};

}  // namespace connect_bridge
