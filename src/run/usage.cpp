#include "run/usage.hpp"

#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iterator>
#include <utility>

#include "core/base/json.hpp"
#include "run/status_file.hpp"

namespace connect_bridge {
namespace {

constexpr unsigned kWritePeriod = 60;  // seconds
constexpr std::streamsize kFileBytesMax = 65536;
constexpr std::size_t kDaySize = 10;  // "2026-11-22"

std::string former_of(const std::string& file) {
  return file + ".1";
}

bool is_day(const std::string& text) {
  if (text.size() != kDaySize || text[4] != '-' || text[7] != '-') return false;
  return text.find_first_not_of("0123456789-") == std::string::npos;
}

}  // namespace

bool Usage::read_text(const std::string& text) {
  const OrderedJson json = OrderedJson::parse(text, nullptr, false);
  const auto days = json.is_object() ? json.find("days") : json.end();
  if (days == json.end() || !days->is_object() || days->size() > kDaysMax) return false;
  std::map<std::string, Traffic> read;
  for (const auto& [day, counts] : days->items()) {
    if (!is_day(day) || !counts.is_array() || counts.size() != 2 ||
        !counts[0].is_number_unsigned() || !counts[1].is_number_unsigned())
      return false;
    read[day] = {counts[0].get<std::uint64_t>(), counts[1].get<std::uint64_t>()};
  }
  days_ = std::move(read);
  return true;
}

std::string Usage::write_text() const {
  OrderedJson days = OrderedJson::object();
  for (const auto& [day, traffic] : days_) days[day] = {traffic.sent, traffic.received};
  return OrderedJson{{"unit", "bytes of IP packets: sent, received"}, {"days", days}}.dump(1);
}

void Usage::count(const Traffic& total, const std::string& day) {
  if (total.sent == counted_.sent && total.received == counted_.received) return;
  days_[day] += {total.sent - counted_.sent, total.received - counted_.received};
  counted_ = total;
  while (days_.size() > kDaysMax) days_.erase(days_.begin());
}

Traffic Usage::of_day(const std::string& day) const {
  const auto found = days_.find(day);
  return found == days_.end() ? Traffic{} : found->second;
}

Traffic Usage::of_month(const std::string& month) const {
  Traffic sum;
  for (const auto& [day, traffic] : days_)
    if (day.starts_with(month)) sum += traffic;
  return sum;
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  std::array<char, 32> text{};
  ::localtime_r(&now, &parts);
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%d", &parts)};
}

bool UsageFile::read(std::istream& in) {
  std::string text(kFileBytesMax, '\0');
  in.read(text.data(), kFileBytesMax);
  text.resize(static_cast<std::size_t>(in.gcount()));
  return usage_.read_text(text);
}

std::string UsageFile::open(const std::string& file) {
  file_ = file;
  if (file.empty()) return {};
  std::ifstream in(file);
  const bool missing = !in && errno == ENOENT;
  if (!in && !missing) {
    file_.clear();  // a file that cannot be read is not replaced
    return "usage_file: " + file + " cannot be read: " + std::strerror(errno) +
           "; the counts of this run are not stored";
  }
  if (!missing && read(in)) return {};
  std::ifstream former(former_of(file));
  const bool goes_on = former && read(former);
  if (missing && !goes_on) return {};  // the first start
  std::string problem = "usage_file: " + file + (missing ? " is missing" : " is not valid");
  problem += goes_on ? "; counting goes on from the one before, " + former_of(file)
                     : "; counting begins again at zero";
  if (missing) return problem;
  const std::string aside = file + ".broken";
  std::rename(file.c_str(), aside.c_str());
  return problem + ", and the file is renamed to " + aside;
}

std::string UsageFile::every_second(const Traffic& total, const std::string& day) {
  usage_.count(total, day);
  if (file_.empty() || ++seconds_ < kWritePeriod) return {};
  seconds_ = 0;
  keep_former();
  std::string problem = write();
  return problem == std::exchange(problem_, problem) ? "" : problem;
}

// Only a file that is a minute old, which the kernel has written to the disk by now: at the end the
// present one may be newer than that, and the one before stays what it is. Nothing is kept where
// there is no file.
void UsageFile::keep_former() const {
  const std::string former = former_of(file_);
  const std::string step = former + ".part";
  std::remove(step.c_str());
  if (::link(file_.c_str(), step.c_str()) != 0) {  // as on FAT; then there is none for a moment
    std::rename(file_.c_str(), former.c_str());
    return;
  }
  std::rename(step.c_str(), former.c_str());
  std::remove(step.c_str());  // it stays where both were the same file
}

void UsageFile::close() {
  if (!file_.empty()) static_cast<void>(write());
}

std::string UsageFile::write() {
  return write_atomically(file_, usage_.write_text());
}

}  // namespace connect_bridge
