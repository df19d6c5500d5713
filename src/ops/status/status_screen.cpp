#include "ops/status/status_screen.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <string_view>
#include <vector>

#include "core/wire/text.hpp"
#include "ops/status/json_members.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kCellBytes = 200;
constexpr std::string_view kGoal = "/_action/get_result";
using Cells = std::vector<std::string>;

std::string shown_bytes(double n) {
  for (const char* unit : {"B", "kB", "MB"}) {
    if (n < 1000) return fmt::format("{:.{}f} {}", n, n < 10 && *unit != 'B' ? 1 : 0, unit);
    n /= 1000;
  }
  return fmt::format("{:.1f} GB", n);
}

std::string shown_ms(double ms) {
  if (ms < 10) return fmt::format("{:.1f} ms", ms);
  return ms < 10'000 ? fmt::format("{:.0f} ms", ms) : fmt::format("{:.0f} s", ms / 1000);
}

std::string shown_span(std::uint64_t s) {
  if (s < 120) return fmt::format("{} s", s);
  if (s < 7200) return fmt::format("{} min", s / 60);
  return s < 172'800 ? fmt::format("{} h", s / 3600) : fmt::format("{} days", s / 86'400);
}

std::string joined_counts(const Json& counts) {
  std::string text;
  for (const auto& [why, count] : counts.items())
    if (count.is_number() && count != 0)
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", to_text(why, kCellBytes),
                          count.get<std::uint64_t>());
  return text;
}

std::string topic_state(const Json& topic) {
  const auto declined = text_in(topic, "declined");
  if (!declined.empty()) return "does not cross: " + declined;
  if (!is_set(topic, "demanded"))
    return text_in(topic, "direction") == "export" ? "nobody listens there" : "nobody listens here";
  if (count_in(topic, "origins") == 0) return "no publisher";
  return "flows";
}

struct Row {
  double weight = 0;
  Cells cells;
};

class StatusTable {
 public:
  explicit StatusTable(Cells heads) { rows_.push_back({0, std::move(heads)}); }

  void add(double weight, Cells cells) { rows_.push_back({weight, std::move(cells)}); }
  [[nodiscard]] std::size_t size() const { return rows_.size() - 1; }

  // With at most `rows` of its rows, the heaviest first.
  [[nodiscard]] std::string text(std::size_t rows) {
    std::stable_sort(rows_.begin() + 1, rows_.end(),
                     [](const Row& a, const Row& b) { return a.weight > b.weight; });
    const std::size_t shown = std::min(rows, size());
    std::vector<std::size_t> widths(rows_[0].cells.size());
    for (std::size_t r = 0; r <= shown; ++r)
      for (std::size_t i = 0; i < widths.size(); ++i)
        widths[i] = std::max(widths[i], rows_[r].cells[i].size());
    std::string text;
    for (std::size_t r = 0; r <= shown; ++r) {
      std::string line;
      for (std::size_t i = 0; i < widths.size(); ++i)
        line += fmt::format("{:<{}}  ", rows_[r].cells[i], widths[i]);
      line.erase(line.find_last_not_of(' ') + 1);
      text += line + "\n";
    }
    if (shown < size()) text += fmt::format("... and {} more (--json has all)\n", size() - shown);
    return text;
  }

 private:
  std::vector<Row> rows_;  // the first: the heads
};

// Counts of the earlier status, by link, direction and name.
std::string topic_key(const Json& link, const Json& topic) {
  return fmt::format("{} {} {} {}", count_in(link, "link"), text_in(topic, "direction"),
                     text_in(topic, "topic"), text_in(topic, "type"));
}

StatusTable topic_table(const Json& now, const Json& before) {
  std::map<std::string, std::pair<double, double>> had;
  for (const Json& link : part_of(before, "links"))
    for (const Json& topic : part_of(link, "topics"))
      had[topic_key(link, topic)] = {number_in(topic, "messages"), number_in(topic, "bytes")};
  const auto then = moment_in(before, "time"), at = moment_in(now, "time");
  const double seconds = then && at ? *at - *then : 0;
  StatusTable table(
      {"TOPIC", "DIRECTION", "LINK", "MESSAGES/S", "BYTES/S", "AGE", "QUEUED", "DROPPED", "STATE"});
  for (const Json& link : part_of(now, "links"))
    for (const Json& topic : part_of(link, "topics")) {
      const auto old = had.find(topic_key(link, topic));
      const bool known = old != had.end() && seconds > 0;
      const auto rate = [&](const char* name, double was) {
        return known ? std::max(0.0, number_in(topic, name) - was) / seconds : 0;
      };
      const double messages = rate("messages", known ? old->second.first : 0);
      const double bytes = rate("bytes", known ? old->second.second : 0);
      table.add(bytes,
                {text_in(topic, "topic"), text_in(topic, "direction"),
                 std::to_string(count_in(link, "link")),
                 known ? fmt::format("{:.{}f}", messages, messages < 10 ? 1 : 0) : "",
                 known ? shown_bytes(bytes) : "",
                 topic.contains("latency_ms") ? shown_ms(number_in(topic, "latency_ms")) : "",
                 std::to_string(count_in(topic, "queued")),
                 joined_counts(part_of(topic, "dropped")), topic_state(topic)});
    }
  return table;
}

StatusTable call_table(const Json& now) {
  StatusTable table({"SERVICE OR ACTION", "DIRECTION", "LINK", "UNDER WAY", "CALLS", "ANSWERED",
                     "FAILED", "STATE"});
  for (const Json& link : part_of(now, "links"))
    for (const Json& service : part_of(link, "services")) {
      auto name = text_in(service, "service");
      if (name.ends_with(kGoal)) name = name.substr(0, name.size() - kGoal.size()) + " (goals)";
      Json failed = Json::object();
      for (const char* how : {"refused", "timed_out", "forgotten", "lost"})
        failed[how] = count_in(service, how);
      const auto declined = text_in(service, "declined");
      const auto count = [&](const char* what) { return std::to_string(count_in(service, what)); };
      table.add(number_in(service, "pending") + number_in(service, "calls") / 1e9,
                {name, text_in(service, "direction"), std::to_string(count_in(link, "link")),
                 count("pending"), count("calls"), count("answered"), joined_counts(failed),
                 !declined.empty()             ? "does not cross: " + declined
                 : is_set(service, "attached") ? "can be called"
                                               : "nobody calls"});
    }
  return table;
}

StatusTable missing_table(const Json& now) {
  StatusTable table({"DOES NOT CROSS", "KIND", "DIRECTION", "LINK", "WHY"});
  for (const Json& link : part_of(now, "links"))
    for (const Json& missing : part_of(link, "missing"))
      table.add(0,
                {text_in(missing, "name"), text_in(missing, "kind"), text_in(missing, "direction"),
                 std::to_string(count_in(link, "link")), text_in(missing, "text")});
  return table;
}

std::string link_lines(const Json& link) {
  const bool open = is_set(link, "open");
  std::string text =
      fmt::format("link {}  {} {} {}  {}\n", count_in(link, "link"), text_in(link, "identity"),
                  text_in(link, "node"), text_in(link, "peer"),
                  open ? "open for " + shown_span(count_in(link, "open_seconds")) : "lost");
  const auto clock = link.find("clock");
  const double rate = number_in(link, "rate_bytes_per_second");
  text += fmt::format(
      "  round trip {}, rate of the path {}, queue of the path {}, sent {}, received {}, queued "
      "{}, "
      "connected {} times\n",
      clock == link.end() ? "unknown" : shown_ms(number_in(*clock, "round_trip_ms")),
      rate > 0 ? shown_bytes(rate) + "/s" : "unknown", shown_ms(number_in(link, "path_queue_ms")),
      shown_bytes(number_in(link, "sent_bytes")), shown_bytes(number_in(link, "received_bytes")),
      shown_bytes(number_in(link, "queued_bytes")), count_in(link, "connects"));
  return text;
}

// Of a relay (src/relay/relay_status.hpp).
std::string relay_screen(const Json& now, std::size_t rows) {
  StatusTable robots({"ROBOT", "FROM", "HERE", "VISITORS", "ALL VISITORS", "SENT", "RECEIVED"});
  for (const Json& robot : part_of(now, "robots"))
    robots.add(
        number_in(robot, "sent_bytes") + number_in(robot, "received_bytes"),
        {text_in(robot, "robot"), text_in(robot, "peer"),
         is_set(robot, "open") ? shown_span(count_in(robot, "open_seconds")) : "gone",
         std::to_string(count_in(robot, "pairs")), std::to_string(count_in(robot, "visitors")),
         shown_bytes(number_in(robot, "sent_bytes")),
         shown_bytes(number_in(robot, "received_bytes"))});
  std::string text = fmt::format("relay  {} robots\nversion {}, since {}\n", robots.size(),
                                 text_in(now, "version"), text_in(now, "started"));
  text += "who came: " + joined_counts(part_of(now, "strangers")) + "\n";
  if (const auto refused = joined_counts(part_of(now, "refused")); !refused.empty())
    text += "refused: " + refused + "\n";
  if (robots.size() > 0) text += "\n" + robots.text(rows);
  return text;
}

}  // namespace

std::string status_screen(const Json& now, const Json& before, std::size_t rows) {
  if (text_in(now, "role") == "relay") return relay_screen(now, rows);
  const Json& links = part_of(now, "links");
  const auto open = std::count_if(links.begin(), links.end(),
                                  [](const Json& link) { return is_set(link, "open"); });
  std::string text = fmt::format(
      "{} ({})  {}\nversion {}, since {}, loop lag {}, memory of peers {} of {}\n",
      text_in(now, "node"), text_in(now, "role"),
      open == 1 ? "1 link is open" : fmt::format("{} links are open", open),
      text_in(now, "version"), text_in(now, "started"), shown_ms(number_in(now, "loop_lag_ms")),
      shown_bytes(number_in(now, "memory_max_used_bytes")),
      shown_bytes(number_in(now, "memory_max_bytes")));
  if (const auto failure = text_in(now, "last_failure"); !failure.empty())
    text += "last failure: " + failure + "\n";
  if (const auto refused = joined_counts(part_of(now, "strangers")); !refused.empty())
    text += "who came: " + refused + "\n";
  for (const Json& link : links) text += link_lines(link);
  StatusTable topics = topic_table(now, before), calls = call_table(now),
              missing = missing_table(now);
  const std::size_t of_missing = std::min(missing.size(), std::max<std::size_t>(rows / 4, 1));
  rows -= std::min(rows, of_missing);
  const std::size_t of_calls =
      std::min(calls.size(), std::max(rows / 4, rows - std::min(rows, topics.size())));
  if (topics.size() > 0) text += "\n" + topics.text(rows - std::min(rows, of_calls));
  if (missing.size() > 0) text += "\n" + missing.text(of_missing);
  if (calls.size() > 0) text += "\n" + calls.text(of_calls);
  return text;
}

}  // namespace connect_bridge
