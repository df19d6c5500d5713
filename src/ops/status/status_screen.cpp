#include "ops/status/status_screen.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "core/wire/text.hpp"
#include "core/wire/words.hpp"
#include "ops/status/json_members.hpp"
#include "ops/status/program_of_link.hpp"
#include "ops/status/screen_table.hpp"
#include "ops/status/status_fields.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kCellBytes = 200;
constexpr const char* kNotExact = "~ ";  // before the state of a topic
constexpr const char* kFlowsInPart = "flows_in_part";

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
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count.get<std::uint64_t>(),
                          plain_words(to_text(why, kCellBytes)));
  return text;
}

std::string plural(std::uint64_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

// The seconds between two moments of the status; 0: one is not known.
double seconds_between(const Json& since, const char* name, const Json& now) {
  const auto from = moment_in(since, name), to = moment_in(now, "time");
  return from && to ? *to - *from : 0;
}

Tone tone_of(std::string_view state) {
  const auto is = [&](StateWord word) { return state == name_of(word); };
  const auto wheel_is = [&](WheelState word) { return state == word_of(kWheelStateWords, word); };
  if (is(StateWord::kOverloaded) || is(StateWord::kKept) || wheel_is(WheelState::kTaken) ||
      state == kFlowsInPart)
    return Tone::kWarn;
  if (is(StateWord::kLost) || is(StateWord::kDeclined) || wheel_is(WheelState::kHalted))
    return Tone::kBad;
  const bool good = is(StateWord::kFlows) || is(StateWord::kReady) || is(StateWord::kOpen) ||
                    wheel_is(WheelState::kYours);
  return good ? Tone::kGood : Tone::kPlain;
}

// ---- the columns of the table of fields (status_fields.hpp)

struct FieldColumn {
  std::string name;
  Unit unit = Unit::kNone;
  Column column;
};

// The state comes last, the drops before it.
template <class Of>
std::vector<FieldColumn> columns_of(std::span<const StatusField<Of>> fields) {
  std::vector<FieldColumn> columns;
  for (const StatusField<Of>& field : fields)
    if (!field.column.title.empty() && field.column.in != Column::In::kDetail)
      columns.push_back({std::string(field.name), field.unit, field.column});
  const auto place = [](const FieldColumn& one) {
    return one.column.as == Column::As::kWord ? 2 : one.column.as == Column::As::kReasons ? 1 : 0;
  };
  std::stable_sort(columns.begin(), columns.end(),
                   [&](const auto& a, const auto& b) { return place(a) < place(b); });
  return columns;
}

std::vector<ScreenTable::Head> heads_of(std::string name, bool links,
                                        const std::vector<FieldColumn>& columns) {
  std::vector<ScreenTable::Head> heads{{std::move(name)}};
  if (links) heads.push_back({"LINK"});
  for (const FieldColumn& one : columns) {
    std::string title{one.column.title};
    for (char& c : title) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    heads.push_back({std::move(title), one.column.in == Column::In::kWide});
  }
  return heads;
}

std::string shown_rate(double rate) {
  return fmt::format("{:.{}f}", rate, rate < 10 ? 1 : 0);
}

// Growths per second, by the name of the counter; empty: there is no earlier status.
using Growth = std::map<std::string, double, std::less<>>;

ScreenTable::Cell cell_of(const FieldColumn& of, const Json& item, const Growth& growth) {
  const char* const name = of.name.c_str();
  switch (of.column.as) {
    case Column::As::kReasons: {
      const Json& counts = part_of(item, name);
      std::uint64_t sum = 0;
      for (const Json& count : counts)
        if (count.is_number()) sum += count.get<std::uint64_t>();
      return {joined_counts(counts), Tone::kPlain, sum > 0 ? std::to_string(sum) : ""};
    }
    case Column::As::kWord: {
      const std::string state = text_in(item, name), declined = text_in(item, "declined");
      std::string shown{wheel_words(state, text_in(item, "direction") == "import")};
      if (shown.empty()) shown = plain_words(state);
      if (item.contains("not_exact")) shown = kNotExact + shown;
      return {declined.empty() ? shown : shown + ": " + declined, tone_of(state)};
    }
    case Column::As::kGrowth: {
      const auto found = growth.find(of.name);
      if (found == growth.end()) return {};
      const double rate = found->second;
      if (of.unit == Unit::kBytes) return {shown_bytes(rate) + "/s"};
      const auto whole = growth.find(of.column.part_of);
      // A tick of the status may come between a message and its count.
      const bool is_part = whole != growth.end() && whole->second > 1.05 * rate + 0.2;
      return {shown_rate(rate) + (is_part ? " of " + shown_rate(whole->second) : "")};
    }
    case Column::As::kCount: {
      const std::uint64_t count = count_in(item, name);
      return {count == 0 ? "" : std::to_string(count)};
    }
    case Column::As::kText: break;
  }
  if (of.unit == Unit::kMilliseconds)
    return {item.contains(name) ? shown_ms(number_in(item, name)) : ""};
  return {text_in(item, name)};
}

// ---- topics

// The base name and the part of an action, such as "feedback"; empty: the name is of no action.
std::pair<std::string, std::string> action_of(const std::string& name) {
  constexpr std::string_view kAction = "/_action/";
  const std::size_t at = name.rfind(kAction);
  if (at == std::string::npos) return {};
  return {name.substr(0, at), name.substr(at + kAction.size())};
}

std::string topic_key(const Json& link, const Json& topic) {
  return fmt::format("{} {} {} {}", count_in(link, "link"), text_in(topic, "direction"),
                     text_in(topic, "topic"), text_in(topic, "type"));
}

// More than a third of the messages of a topic that flows is dropped now. Those beyond the rule's
// rate are dropped as somebody wants it.
bool flows_in_part(const Json& topic, const Json& old, const Growth& growth) {
  const auto published = growth.find("published"), messages = growth.find("messages");
  if (text_in(topic, "state") != name_of(StateWord::kFlows) || published == growth.end() ||
      messages == growth.end())
    return false;
  const double of_rate =
      number_in(part_of(topic, "dropped"), "rate") - number_in(part_of(old, "dropped"), "rate");
  // Of a short time: a message or two may be between two counts.
  return of_rate <= 0 && published->second > 1.5 * messages->second + 2;
}

ScreenTable topic_table(const Json& now, const Json& before) {
  const std::vector<FieldColumn> columns = columns_of(topic_fields());
  std::map<std::string, const Json*> had;
  for (const Json& link : part_of(before, "links"))
    for (const Json& topic : part_of(link, "topics")) had[topic_key(link, topic)] = &topic;
  const double seconds = seconds_between(before, "time", now);
  const Json& links = part_of(now, "links");
  ScreenTable table(heads_of("TOPIC", links.size() > 1, columns));
  for (const Json& link : links)
    for (const Json& topic : part_of(link, "topics")) {
      const std::string name = text_in(topic, "topic");
      if (!action_of(name).first.empty()) continue;
      Growth growth;
      const auto old = had.find(topic_key(link, topic));
      const auto grow = [&](const std::string& of) {
        if (old != had.end() && seconds > 0 && topic.contains(of))
          growth[of] =
              std::max(0.0, number_in(topic, of.c_str()) - number_in(*old->second, of.c_str())) /
              seconds;
      };
      for (const FieldColumn& one : columns)
        if (one.column.as == Column::As::kGrowth) {
          grow(one.name);
          if (!one.column.part_of.empty()) grow(std::string(one.column.part_of));
        }
      Json shown = topic;
      const std::string wheel = text_in(topic, "wheel");
      const bool waits = wheel == word_of(kWheelStateWords, WheelState::kTaken) ||
                         wheel == word_of(kWheelStateWords, WheelState::kHalted);
      if (waits && text_in(topic, "state") == name_of(StateWord::kFlows)) {
        shown["state"] = wheel;  // its commands move nothing
      } else if (flows_in_part(topic, old == had.end() ? Json() : *old->second, growth)) {
        shown["state"] = kFlowsInPart;
      }
      std::vector<ScreenTable::Cell> cells{{name}};
      if (links.size() > 1) cells.push_back({std::to_string(count_in(link, "link"))});
      for (const FieldColumn& one : columns) cells.push_back(cell_of(one, shown, growth));
      const auto bytes = growth.find("wire_bytes");
      table.add(bytes == growth.end() ? 0 : bytes->second, std::move(cells));
    }
  return table;
}

// ---- services and actions

constexpr std::string_view kParameterServices[] = {
    "describe_parameters", "get_parameters", "get_parameter_types",
    "list_parameters",     "set_parameters", "set_parameters_atomically"};

// The services and topics of an action are one row, and so are the parameter services of a node.
struct Called {
  Json shown = Json::object();
  Json failed = Json::object();
};

std::string row_name(const std::string& name) {
  if (const auto action = action_of(name).first; !action.empty()) return action + " (action)";
  const std::size_t slash = name.rfind('/');
  if (slash == std::string::npos || slash == 0) return name;
  const std::string last = name.substr(slash + 1);
  const bool own = std::find(std::begin(kParameterServices), std::end(kParameterServices), last) !=
                   std::end(kParameterServices);
  return own ? name.substr(0, slash) + " (parameters)" : name;
}

// The state that a person has to know first comes before those of a row's other parts.
bool comes_before(std::string_view one, std::string_view other) {
  constexpr StateWord kOrder[] = {StateWord::kOverloaded, StateWord::kDeclined, StateWord::kReady,
                                  StateWord::kKept, StateWord::kNoClient};
  const auto place = [&](std::string_view state) {
    return std::find_if(std::begin(kOrder), std::end(kOrder),
                        [&](StateWord word) { return name_of(word) == state; });
  };
  return place(one) < place(other);
}

void add_part(Called& row, const Json& part, const std::string& name, bool is_topic) {
  const std::string what = action_of(name).second, state = text_in(part, "state");
  if (!row.shown.contains("direction")) row.shown["direction"] = text_in(part, "direction");
  if (!row.shown.contains("state") || comes_before(state, text_in(row.shown, "state")))
    row.shown["state"] = state;
  if (const auto declined = text_in(part, "declined"); !declined.empty())
    row.shown["declined"] = declined;
  const auto add = [](Json& to, const std::string& key, std::uint64_t count) {
    if (count > 0) to[key] = count_in(to, key.c_str()) + count;
  };
  for (const char* how : {"refused", "timed_out", "forgotten", "lost"})
    add(row.failed, how, count_in(part, how));
  if (is_topic)
    for (const auto& [why, count] : part_of(part, "dropped").items())
      if (count.is_number()) add(row.failed, what + " dropped", count.get<std::uint64_t>());
  // A goal has not ended while its result is awaited.
  if (is_topic || (!what.empty() && what != "get_result")) return;
  for (const FieldColumn& one : columns_of(service_fields()))
    if (one.column.as == Column::As::kCount)
      add(row.shown, one.name, count_in(part, one.name.c_str()));
}

ScreenTable call_table(const Json& now) {
  std::vector<FieldColumn> columns = columns_of(service_fields());
  columns.insert(columns.end() - 1,
                 {"failed", Unit::kNone, {"failed", Column::As::kReasons, Column::In::kNarrow}});
  const Json& links = part_of(now, "links");
  ScreenTable table(heads_of("SERVICE OR ACTION", links.size() > 1, columns));
  for (const Json& link : links) {
    std::map<std::tuple<std::string, std::string, std::string>, Called> rows;
    const auto add = [&](const Json& part, const char* member) {
      const std::string name = text_in(part, member);
      const bool is_topic = std::string_view(member) == "topic";
      const std::string row = row_name(name);
      if (is_topic && action_of(name).first.empty()) return;
      const std::string type = row == name ? text_in(part, "type") : "";
      add_part(rows[{row, text_in(part, "direction"), type}], part, name, is_topic);
    };
    for (const Json& service : part_of(link, "services")) add(service, "service");
    for (const Json& topic : part_of(link, "topics")) add(topic, "topic");
    for (auto& [key, row] : rows) {
      row.shown["failed"] = row.failed;
      std::vector<ScreenTable::Cell> cells{{std::get<0>(key)}};
      if (links.size() > 1) cells.push_back({std::to_string(count_in(link, "link"))});
      for (const FieldColumn& one : columns) cells.push_back(cell_of(one, row.shown, {}));
      table.add(number_in(row.shown, "pending") + number_in(row.shown, "calls") / 1e9,
                std::move(cells));
    }
  }
  return table;
}

// ---- the rest

ScreenTable missing_table(const Json& now) {
  const std::vector<FieldColumn> columns = columns_of(missing_fields());
  const Json& links = part_of(now, "links");
  ScreenTable table(heads_of("NOT FORWARDED", links.size() > 1, columns));
  for (const Json& link : links) {
    std::set<std::tuple<std::string, std::string, std::string>> shown;
    for (const Json& missing : part_of(link, "missing")) {
      const std::string name = row_name(text_in(missing, "name"));
      const bool is_new =
          shown.insert({name, text_in(missing, "direction"), text_in(missing, "text")}).second;
      if (!is_new && name.ends_with(')')) continue;  // the services of one node
      std::vector<ScreenTable::Cell> cells{{name}};
      if (links.size() > 1) cells.push_back({std::to_string(count_in(link, "link"))});
      for (const FieldColumn& one : columns) cells.push_back(cell_of(one, missing, {}));
      table.add(0, std::move(cells));
    }
  }
  return table;
}

// "19:34:00" of a moment of the status, with the day where it is another one.
std::string shown_moment(const Json& of, const char* name, const Json& now) {
  const std::string at = text_in(of, name), today = text_in(now, "time");
  if (at.size() < 19) return at;
  const std::string time = at.substr(11, 8) + " UTC";
  return at.substr(0, 10) == today.substr(0, 10) ? time : at.substr(0, 10) + " " + time;
}

// A long name has a line of its own.
std::string headline(const std::string& name, const std::string& state, Tone tone,
                     const ScreenSize& size) {
  const std::string shown = coloured(state, tone, size.colour) + "\n";
  const bool fits = size.columns == 0 || name.size() + 2 + state.size() <= size.columns;
  return fits ? name + "  " + shown : wrapped(name, 0, size.columns) + shown;
}

std::string link_lines(const Json& link, const Json& old, const Json& now, double seconds,
                       const ScreenSize& size) {
  const bool open = is_set(link, "open");
  const std::string state = text_in(link, "state");
  const Json& breaks = part_of(link, "breaks");
  std::string since;
  if (open) since = " for " + shown_span(count_in(link, "open_seconds"));
  if (!open && !breaks.empty()) since = " since " + shown_moment(breaks.back(), "lost", now);
  const std::string identity = text_in(link, "identity"), wheel = text_in(link, "wheel");
  std::string text = headline(fmt::format("link {}  {}{} {}", count_in(link, "link"),
                                          identity.empty() ? "" : identity + " ",
                                          text_in(link, "node"), text_in(link, "peer")),
                              state + since, tone_of(state), size);
  const Json& topics = part_of(link, "topics");
  const auto driven = std::find_if(topics.begin(), topics.end(), [&](const Json& topic) {
    return !wheel.empty() && text_in(topic, "wheel") == wheel;
  });
  if (driven != topics.end()) {
    const bool at_robot = text_in(*driven, "direction") == "import";
    text += fmt::format(
        "  {}\n", coloured(std::string(wheel_words(wheel, at_robot)), tone_of(wheel), size.colour));
  }
  if (!breaks.empty()) {
    const Json& last = breaks.back();
    const std::string reason = text_in(last, "reason");
    const std::string back =
        last.contains("back")
            ? ", for " +
                  shown_span(static_cast<std::uint64_t>(std::max(0.0, number_in(last, "seconds"))))
            : "";
    const char* const of_more = breaks.size() == LinkBreak::kShownMax ? "last " : "";
    text += wrapped(fmt::format("{}{}, the last at {}{}: {}", of_more,
                                plural(breaks.size(), "break"), shown_moment(last, "lost", now),
                                back, reason.empty() ? plain_words(text_in(last, "code")) : reason),
                    2, size.columns);
  }
  if (!open) return text;
  std::vector<std::string> facts;
  const auto growth = [&](const char* name) {
    return std::max(0.0, number_in(link, name) - number_in(old, name)) / seconds;
  };
  if (seconds > 0 && is_set(old, "open") && count_in(old, "connects") == count_in(link, "connects"))
    facts.push_back(fmt::format("sends {}/s, receives {}/s", shown_bytes(growth("sent_bytes")),
                                shown_bytes(growth("received_bytes"))));
  if (const double rate = number_in(link, "rate_bytes_per_second"); rate > 0)
    facts.push_back("estimated bandwidth " + shown_bytes(rate) + "/s");
  if (const Json& clock = part_of(link, "clock"); !clock.empty())
    facts.push_back("round trip " + shown_ms(number_in(clock, "round_trip_ms")));
  facts.push_back("queueing delay " + shown_ms(number_in(link, "path_queue_ms")));
  facts.push_back(shown_bytes(number_in(link, "queued_bytes")) + " queued");
  const Json& lately = part_of(link, "lately");
  const Json& sent = count_in(lately, "segments") > 0 ? lately : link;
  if (const double segments = number_in(sent, "segments"); segments > 0)
    facts.push_back(fmt::format("retransmitted {:.1f} % of the packets",
                                100 * number_in(sent, "retransmitted") / segments));
  facts.push_back("connected " + plural(count_in(link, "connects"), "time"));
  return text + wrapped(fmt::format("{}", fmt::join(facts, ", ")), 2, size.columns);
}

// Lost links of one program are one line, and what is kept for them has no rows: a program that was
// killed again and again leaves one each time. Takes them out of `status`, and returns their lines.
std::string fold_lost_links(Json& status, const ScreenSize& size) {
  std::map<ProgramOfLink, std::vector<Json>> lost;
  for (const Json& link : part_of(status, "links"))
    if (!is_set(link, "open")) lost[program_of(link)].push_back(link);
  std::erase_if(lost, [](const auto& one) { return one.second.size() < 2; });
  if (lost.empty()) return {};
  std::string lines;
  for (const auto& [program, links] : lost) {
    const Json& breaks = part_of(links.back(), "breaks");
    lines += headline(fmt::format("{} links  {} {}", links.size(), program.name(), program.host),
                      "lost" + (breaks.empty() ? ""
                                               : ", the last since " +
                                                     shown_moment(breaks.back(), "lost", status)),
                      Tone::kBad, size);
  }
  Json kept = Json::array();
  for (const Json& link : part_of(status, "links"))
    if (is_set(link, "open") || !lost.contains(program_of(link))) kept.push_back(link);
  status["links"] = std::move(kept);
  return lines;
}

template <class Add>
void add_file_problems(const Json& now, const Add& add) {
  if (const auto problem = text_in(part_of(now, "audit"), "problem"); !problem.empty())
    add("the audit log cannot be written: " + problem, Tone::kBad);
  if (const Json& refused = part_of(now, "refused_parameters"); !refused.empty())
    add(fmt::format("the parameter file was refused at {}, the parameters before it stay: {}",
                    shown_moment(refused, "time", now), text_in(refused, "problem")),
        Tone::kBad);
  for (const Json& refused : part_of(now, "refused_files"))
    add("a changed file is refused, what was read before stays in use: " +
            text_in(refused, "reason"),
        Tone::kBad);
  if (const auto problem = text_in(now, "status_file_problem"); !problem.empty())
    add("the status file cannot be written: " + problem, Tone::kBad);
}

// Problems that a person has to do something about, and topics that are not exact.
std::string problem_lines(const Json& now, const ScreenSize& size) {
  std::string lines;
  const auto add = [&](const std::string& text, Tone tone) {
    std::string line = wrapped(text, 0, size.columns);
    line.pop_back();
    lines += coloured(line, tone, size.colour) + "\n";
  };
  if (const auto failure = text_in(now, "last_failure"); !failure.empty())
    add("last failure: " + failure, Tone::kBad);
  add_file_problems(now, add);
  for (const Json& link : part_of(now, "links")) {
    const std::uint64_t number = count_in(link, "link");
    if (is_set(link, "same_graph"))
      add(fmt::format("link {}: both sides are in one ROS graph, give one of them another "
                      "ROS_DOMAIN_ID",
                      number),
          Tone::kBad);
    if (is_set(link, "two_of_a_kind"))
      add(fmt::format("link {}: by the key `robot` both sides are {}", number,
                      is_set(now, "is_robot") ? "the robot" : "operators"),
          Tone::kWarn);
  }
  for (const Json& link : part_of(now, "links"))
    for (const Json& finding : part_of(link, "peer_findings")) {
      std::string words = text_in(finding, "id");
      std::replace(words.begin(), words.end(), '_', ' ');
      const std::string name = text_in(finding, "name");
      add(fmt::format("link {}: the other end reports {}{} (ctl doctor)", count_in(link, "link"),
                      name.empty() ? "" : name + " ", words),
          Tone::kWarn);
    }
  for (const Json& key : part_of(now, "needs_restart"))
    if (key.is_string())
      add("changed in the parameter file, and needs a restart: " +
              to_text(key.get<std::string>(), kCellBytes),
          Tone::kWarn);
  for (const Json& relay : part_of(now, "relays"))
    if (!is_set(relay, "connected"))
      add(fmt::format("no connection to the relay {}: {}", text_in(relay, "relay"),
                      text_in(relay, "last_failure")),
          Tone::kBad);
  std::vector<std::string> overloaded, lossy;
  for (const Json& link : part_of(now, "links"))
    for (const Json& topic : part_of(link, "topics")) {
      const std::string name = row_name(text_in(topic, "topic"));
      if (text_in(topic, "state") == name_of(StateWord::kOverloaded)) overloaded.push_back(name);
      if (const auto form = text_in(topic, "not_exact"); !form.empty())
        lossy.push_back(name + " (" + form + ")");
    }
  const auto add_named = [&](std::string_view before, std::vector<std::string> names, Tone tone) {
    constexpr std::size_t kNamed = 5;
    if (names.empty()) return;
    const std::size_t more = names.size() - std::min(names.size(), kNamed);
    names.resize(names.size() - more);
    add(fmt::format("{} {}{}", before, fmt::join(names, ", "),
                    more > 0 ? fmt::format(" and {} more", more) : ""),
        tone);
  };
  add_named("overload: the link carries less than is published on", std::move(overloaded),
            Tone::kWarn);
  add_named(std::string(kNotExact) + "not exact:", std::move(lossy), Tone::kPlain);
  return lines;
}

// ", certificate valid for 3 days"; empty: it never ends, or there is none.
std::string certificate_fact(const Json& now) {
  if (!moment_in(now, "certificate_valid_until")) return {};
  const double left = -seconds_between(now, "certificate_valid_until", now);
  return left > 0 ? ", certificate valid for " + shown_span(static_cast<std::uint64_t>(left))
                  : ", the certificate has expired";
}

// ", connected to the relay wss://r@relay for 3 h", of each.
std::string relay_facts(const Json& now) {
  std::string facts;
  for (const Json& relay : part_of(now, "relays"))
    if (is_set(relay, "connected"))
      facts += fmt::format(", connected to the relay {} for {}", text_in(relay, "relay"),
                           shown_span(static_cast<std::uint64_t>(
                               std::max(0.0, seconds_between(relay, "connected_since", now)))));
  return facts;
}

// The screen of a relay (src/relay/relay_status.hpp).
std::string relay_screen(const Json& now, const ScreenSize& size) {
  ScreenTable robots({{"ROBOT"},
                      {"FROM", true},
                      {"CONNECTED"},
                      {"VISITORS NOW"},
                      {"VISITORS IN ALL", true},
                      {"SENT"},
                      {"RECEIVED"}});
  for (const Json& robot : part_of(now, "robots"))
    robots.add(number_in(robot, "sent_bytes") + number_in(robot, "received_bytes"),
               {{text_in(robot, "robot")},
                {text_in(robot, "peer")},
                {is_set(robot, "open") ? shown_span(count_in(robot, "open_seconds")) : "gone"},
                {std::to_string(count_in(robot, "pairs"))},
                {std::to_string(count_in(robot, "visitors"))},
                {shown_bytes(number_in(robot, "sent_bytes"))},
                {shown_bytes(number_in(robot, "received_bytes"))}});
  const auto up = static_cast<std::uint64_t>(std::max(0.0, seconds_between(now, "started", now)));
  std::string text = fmt::format("relay  {}\n", plural(robots.size(), "robot"));
  text += wrapped(fmt::format("version {}, up {}", text_in(now, "version"), shown_span(up)) +
                      certificate_fact(now),
                  0, size.columns);
  text +=
      wrapped("connection attempts: " + joined_counts(part_of(now, "strangers")), 0, size.columns);
  if (const auto refused = joined_counts(part_of(now, "refused")); !refused.empty())
    text += wrapped("refused: " + refused, 0, size.columns);
  if (robots.size() > 0) text += "\n" + robots.text(size.rows, size);
  return text;
}

}  // namespace

std::string status_screen(const Json& of, const Json& before, const ScreenSize& size) {
  if (text_in(of, "role") == "relay") return relay_screen(of, size);
  const Json& all = part_of(of, "links");
  const auto open = static_cast<std::uint64_t>(
      std::count_if(all.begin(), all.end(), [](const Json& link) { return is_set(link, "open"); }));
  const std::uint64_t lost = all.size() - open;
  Json now = of;
  const std::string folded = fold_lost_links(now, size);
  const Json& links = part_of(now, "links");
  const Tone tone = open == 0 ? Tone::kBad : lost > 0 ? Tone::kWarn : Tone::kGood;
  std::string text =
      headline(fmt::format("{} ({})", text_in(now, "node"), text_in(now, "role")),
               plural(open, "link") + " open" + (lost > 0 ? fmt::format(", {} lost", lost) : ""),
               tone, size);
  std::string facts = "version " + text_in(now, "version");
  if (const double up = seconds_between(now, "started", now); up > 0)
    facts += ", up " + shown_span(static_cast<std::uint64_t>(up));
  facts += certificate_fact(now) + relay_facts(now);
  facts += fmt::format(", event loop delay {}, memory for peers {} of {}",
                       shown_ms(number_in(now, "loop_lag_ms")),
                       shown_bytes(number_in(now, "memory_max_used_bytes")),
                       shown_bytes(number_in(now, "memory_max_bytes")));
  text += wrapped(facts, 0, size.columns) + problem_lines(now, size);
  if (const auto attempts = joined_counts(part_of(now, "strangers")); !attempts.empty())
    text += wrapped("connection attempts: " + attempts, 0, size.columns);
  const double seconds = seconds_between(before, "time", now);
  for (const Json& link : links) {
    Json old;
    for (const Json& other : part_of(before, "links"))
      if (count_in(other, "link") == count_in(link, "link")) old = other;
    text += link_lines(link, old, now, seconds, size);
  }
  text += folded;
  ScreenTable topics = topic_table(now, before), calls = call_table(now),
              missing = missing_table(now);
  std::size_t rows = size.rows;
  const std::size_t of_missing = std::min(missing.size(), std::max<std::size_t>(rows / 4, 1));
  rows -= std::min(rows, of_missing);
  const std::size_t of_calls =
      std::min(calls.size(), std::max(rows / 4, rows - std::min(rows, topics.size())));
  if (topics.size() > 0) text += "\n" + topics.text(rows - std::min(rows, of_calls), size);
  if (missing.size() > 0) text += "\n" + missing.text(of_missing, size);
  if (calls.size() > 0) text += "\n" + calls.text(of_calls, size);
  return text;
}

}  // namespace connect_bridge
