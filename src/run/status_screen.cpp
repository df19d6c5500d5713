#include "run/status_screen.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <string_view>
#include <vector>

#include "core/wire/text.hpp"
#include "run/json_members.hpp"

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

std::string shown_span(std::int64_t s) {
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
  const auto declined = member<std::string>(topic, "declined");
  if (!declined.empty()) return "does not cross: " + declined;
  if (!member<bool>(topic, "demanded"))
    return member<std::string>(topic, "direction") == "export" ? "nobody listens there"
                                                               : "nobody listens here";
  if (member<std::uint64_t>(topic, "origins") == 0) return "no publisher";
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
  return fmt::format("{} {} {} {}", member<std::uint64_t>(link, "link"),
                     member<std::string>(topic, "direction"), member<std::string>(topic, "topic"),
                     member<std::string>(topic, "type"));
}

StatusTable topic_table(const Json& now, const Json& before) {
  std::map<std::string, std::pair<double, double>> had;
  for (const Json& link : part_of(before, "links"))
    for (const Json& topic : part_of(link, "topics"))
      had[topic_key(link, topic)] = {member<double>(topic, "messages"),
                                     member<double>(topic, "bytes")};
  const auto then = moment_in(before, "time"), at = moment_in(now, "time");
  const double seconds = then && at ? *at - *then : 0;
  StatusTable table(
      {"TOPIC", "DIRECTION", "LINK", "MESSAGES/S", "BYTES/S", "AGE", "QUEUED", "DROPPED", "STATE"});
  for (const Json& link : part_of(now, "links"))
    for (const Json& topic : part_of(link, "topics")) {
      const auto old = had.find(topic_key(link, topic));
      const bool known = old != had.end() && seconds > 0;
      const auto rate = [&](const char* name, double was) {
        return known ? std::max(0.0, member<double>(topic, name) - was) / seconds : 0;
      };
      const double messages = rate("messages", known ? old->second.first : 0);
      const double bytes = rate("bytes", known ? old->second.second : 0);
      table.add(bytes,
                {member<std::string>(topic, "topic"), member<std::string>(topic, "direction"),
                 std::to_string(member<std::uint64_t>(link, "link")),
                 known ? fmt::format("{:.{}f}", messages, messages < 10 ? 1 : 0) : "",
                 known ? shown_bytes(bytes) : "",
                 topic.contains("latency_ms") ? shown_ms(member<double>(topic, "latency_ms")) : "",
                 std::to_string(member<std::uint64_t>(topic, "queued")),
                 joined_counts(part_of(topic, "dropped")), topic_state(topic)});
    }
  return table;
}

StatusTable call_table(const Json& now) {
  StatusTable table({"SERVICE OR ACTION", "DIRECTION", "LINK", "UNDER WAY", "CALLS", "ANSWERED",
                     "FAILED", "STATE"});
  for (const Json& link : part_of(now, "links"))
    for (const Json& service : part_of(link, "services")) {
      auto name = member<std::string>(service, "service");
      if (name.ends_with(kGoal)) name = name.substr(0, name.size() - kGoal.size()) + " (goals)";
      Json failed = Json::object();
      for (const char* how : {"refused", "timed_out", "forgotten", "lost"})
        failed[how] = member<std::uint64_t>(service, how);
      const auto declined = member<std::string>(service, "declined");
      const auto count = [&](const char* what) {
        return std::to_string(member<std::uint64_t>(service, what));
      };
      table.add(member<double>(service, "pending") + member<double>(service, "calls") / 1e9,
                {name, member<std::string>(service, "direction"),
                 std::to_string(member<std::uint64_t>(link, "link")), count("pending"),
                 count("calls"), count("answered"), joined_counts(failed),
                 !declined.empty()                   ? "does not cross: " + declined
                 : member<bool>(service, "attached") ? "can be called"
                                                     : "nobody calls"});
    }
  return table;
}

StatusTable missing_table(const Json& now) {
  StatusTable table({"DOES NOT CROSS", "KIND", "DIRECTION", "LINK", "WHY"});
  for (const Json& link : part_of(now, "links"))
    for (const Json& missing : part_of(link, "missing"))
      table.add(0, {member<std::string>(missing, "name"), member<std::string>(missing, "kind"),
                    member<std::string>(missing, "direction"),
                    std::to_string(member<std::uint64_t>(link, "link")),
                    member<std::string>(missing, "text")});
  return table;
}

std::string link_lines(const Json& link) {
  const bool open = member<bool>(link, "open");
  std::string text = fmt::format(
      "link {}  {} {} {}  {}\n", member<std::uint64_t>(link, "link"),
      member<std::string>(link, "identity"), member<std::string>(link, "node"),
      member<std::string>(link, "peer"),
      open ? "open for " + shown_span(member<std::int64_t>(link, "open_seconds")) : "lost");
  const auto clock = link.find("clock");
  const double rate = member<double>(link, "rate_bytes_per_second");
  text += fmt::format(
      "  round trip {}, rate of the path {}, queue of the path {}, sent {}, received {}, queued "
      "{}, "
      "connected {} times\n",
      clock == link.end() ? "unknown" : shown_ms(member<double>(*clock, "round_trip_ms")),
      rate > 0 ? shown_bytes(rate) + "/s" : "unknown",
      shown_ms(member<double>(link, "path_queue_ms")),
      shown_bytes(member<double>(link, "sent_bytes")),
      shown_bytes(member<double>(link, "received_bytes")),
      shown_bytes(member<double>(link, "queued_bytes")), member<std::uint64_t>(link, "connects"));
  return text;
}

// Of a relay (src/relay/relay_status.hpp).
std::string relay_screen(const Json& now, std::size_t rows) {
  StatusTable robots({"ROBOT", "FROM", "HERE", "VISITORS", "ALL VISITORS", "SENT", "RECEIVED"});
  for (const Json& robot : part_of(now, "robots"))
    robots.add(
        member<double>(robot, "sent_bytes") + member<double>(robot, "received_bytes"),
        {member<std::string>(robot, "robot"), member<std::string>(robot, "peer"),
         member<bool>(robot, "open") ? shown_span(member<std::int64_t>(robot, "open_seconds"))
                                     : "gone",
         std::to_string(member<std::uint64_t>(robot, "pairs")),
         std::to_string(member<std::uint64_t>(robot, "visitors")),
         shown_bytes(member<double>(robot, "sent_bytes")),
         shown_bytes(member<double>(robot, "received_bytes"))});
  std::string text =
      fmt::format("relay  {} robots\nversion {}, since {}\n", robots.size(),
                  member<std::string>(now, "version"), member<std::string>(now, "started"));
  text += "who came: " + joined_counts(part_of(now, "strangers")) + "\n";
  if (const auto refused = joined_counts(part_of(now, "refused")); !refused.empty())
    text += "refused: " + refused + "\n";
  if (robots.size() > 0) text += "\n" + robots.text(rows);
  return text;
}

}  // namespace

std::string status_screen(const Json& now, const Json& before, std::size_t rows) {
  if (member<std::string>(now, "role") == "relay") return relay_screen(now, rows);
  const Json& links = part_of(now, "links");
  const auto open = std::count_if(links.begin(), links.end(),
                                  [](const Json& link) { return member<bool>(link, "open"); });
  std::string text =
      fmt::format("{} ({})  {}\nversion {}, since {}, loop lag {}, memory of peers {} of {}\n",
                  member<std::string>(now, "node"), member<std::string>(now, "role"),
                  open == 1 ? "1 link is open" : fmt::format("{} links are open", open),
                  member<std::string>(now, "version"), member<std::string>(now, "started"),
                  shown_ms(member<double>(now, "loop_lag_ms")),
                  shown_bytes(member<double>(now, "memory_max_used_bytes")),
                  shown_bytes(member<double>(now, "memory_max_bytes")));
  if (const auto failure = member<std::string>(now, "last_failure"); !failure.empty())
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
