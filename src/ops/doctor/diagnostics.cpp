#include "ops/doctor/diagnostics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <utility>

#include "core/base/cdr.hpp"
#include "ops/doctor/diagnosis.hpp"
#include "ops/doctor/worth_telling.hpp"
#include "ops/status/status_fields.hpp"

namespace connect_bridge {
namespace {

using Level = Diagnostic::Level;

constexpr Stamp kDay = 24 * 3600 * kStampSecond;
constexpr Stamp kLoginDays = 7;

// The text of the last failure has addresses in it: the cause alone is shown.
std::string shown_cause(const Failure& failure) {
  const Finding* const finding = failure ? finding_of(diagnose(failure).id) : nullptr;
  return finding == nullptr ? "" : ": " + std::string(finding->cause);
}

std::string shown_value(const OrderedJson& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

// Lists are none of them; what is within another member is named with a dot.
void add_values(Diagnostic& to, const OrderedJson& facts, const std::string& before = {}) {
  for (const auto& [name, value] : facts.items()) {
    if (value.is_object()) {
      add_values(to, value, before + name + ".");
    } else if (!value.is_array()) {
      to.values.emplace_back(before + name, shown_value(value));
    }
  }
}

void add_end(Diagnostic& to, const char* what, Stamp end, Stamp days_worth_telling, Stamp now) {
  const Stamp days = (end - now) / kDay;
  to.values.emplace_back(fmt::format("{}_valid_days", what), std::to_string(days));
  if (end <= now) {
    to.add(Level::kError, fmt::format("the {} has ended", what));
  } else if (days < days_worth_telling) {
    to.add(Level::kWarn, fmt::format("the {} ends in {} days", what, days));
  }
}

// The node without the namespace's first slash, as updaters write it.
std::string named_at(const StatusPicture& picture, const std::string& what) {
  const std::string& node = picture.run.node;
  return node.substr(node.starts_with('/') ? 1 : 0) + ": " + what;
}

Diagnostic of_side(const StatusPicture& picture, Stamp now) {
  const RunStatus& run = picture.run;
  const Status& side = picture.side;
  Diagnostic made{Level::kOk, named_at(picture, "bridge"), {}, {}};
  OrderedJson facts = facts_of(picture, Names::kHidden);
  facts.erase("last_failure");
  if (facts.contains("strangers")) facts["strangers"].erase("last_refused");
  if (facts.contains("relay")) facts["relay"].erase("last_failure");
  add_values(made, facts);
  if (run.loop_lag_ms > kLagMsWorthTelling)
    made.add(Level::kWarn, fmt::format("this process was held up for {:.0f} ms", run.loop_lag_ms));
  const auto used = static_cast<double>(side.shared_bytes);
  if (used > kMemoryShareWorthTelling * static_cast<double>(side.shared_bytes_max))
    made.add(Level::kWarn, "the memory that peers may use is nearly full (memory_max)");
  if (run.audit && !run.audit->problem.empty())
    made.add(Level::kError, "the audit log cannot be written: " + run.audit->problem);
  if (run.refused_parameters)
    made.add(Level::kWarn, "a changed parameter file was refused; the log has the reason");
  for (const PlaceAtRelay& place : run.relays)
    if (place.connected_since == 0) made.add(Level::kError, "no connection to the relay");
  if (run.certificate_end != 0)
    add_end(made, "certificate", run.certificate_end, kCertificateDaysWorthTelling, now);
  const auto& links = side.links;
  const bool linked =
      std::any_of(links.begin(), links.end(), [](const LinkStatus& link) { return link.open; });
  if (run.role == Role::kClient && !linked)
    made.add(Level::kError, "no link to the server" + shown_cause(side.last_failure));
  if (made.message.empty()) made.message = "runs";
  return made;
}

// Who steers, without names: whoever sees the topic may be anybody.
void add_wheel(Diagnostic& to, const LinkStatus& link) {
  const auto wheel = link.wheel();
  if (!wheel) return;
  const auto driven = std::find_if(link.topics.begin(), link.topics.end(),
                                   [&](const TopicStatus& t) { return t.wheel == wheel; });
  const char* const yours = driven->exported ? "you drive" : "somebody drives";
  to.add(Level::kOk, *wheel == WheelState::kFree     ? "nobody drives"
                     : *wheel == WheelState::kYours  ? yours
                     : *wheel == WheelState::kHalted ? "halted: let go first"
                                                     : "another peer drives");
  if (driven->latency_ms)
    to.values.emplace_back("last_command_ms", fmt::format("{:.1f}", *driven->latency_ms));
}

// Without the names of topics: that of an identity may be among their parts.
void add_lossy(Diagnostic& to, const LinkStatus& link) {
  std::set<std::string> forms;
  std::size_t topics = 0;
  for (const TopicStatus& topic : link.topics) {
    std::string form = words_of(topic.sent_as);
    if (form.empty()) continue;
    ++topics;
    forms.insert(std::move(form));
  }
  if (topics == 0) return;
  const std::string words = fmt::format("{}", fmt::join(forms, "; "));
  to.add(Level::kOk, fmt::format("{} topic{} not exact", topics, topics == 1 ? "" : "s"));
  to.values.emplace_back("topics_not_exact", std::to_string(topics));
  to.values.emplace_back("not_exact", words);
}

Diagnostic of_link(const StatusPicture& picture, const LinkStatus& link, Stamp now) {
  const std::string place = std::to_string(picture.places.of(link));
  Diagnostic made{Level::kOk, named_at(picture, "link " + place), {}, {}};
  OrderedJson facts = facts_of(link, Names::kHidden);
  facts.erase("peer");
  facts.erase("identity");
  add_values(made, facts);
  if (link.login_end != 0) add_end(made, "login", link.login_end, kLoginDays, now);
  if (!link.open) {
    made.add(Level::kWarn, std::string(name_of(state_of(link))) + ", may return");
  } else if (const double queue_ms = milliseconds_of(link.path_queue);
             queue_ms > kQueueMsWorthTelling) {
    made.add(Level::kWarn, fmt::format("packets wait {:.1f} s on the path", queue_ms / 1e3));
  }
  const auto overloaded = std::count_if(
      link.topics.begin(), link.topics.end(),
      [](const TopicStatus& topic) { return state_of(topic) == StateWord::kOverloaded; });
  if (overloaded > 0)
    made.add(Level::kWarn,
             fmt::format("{} topic{} {}: the link carries less than is published", overloaded,
                         overloaded == 1 ? "" : "s", name_of(StateWord::kOverloaded)));
  if (link.open) add_wheel(made, link);
  if (link.open) add_lossy(made, link);
  if (made.message.empty()) made.message = name_of(state_of(link));
  return made;
}

}  // namespace

void Diagnostic::add(Level worse, const std::string& text) {
  level = std::max(level, worse);
  message += (message.empty() ? "" : "; ") + text;
}

std::vector<Diagnostic> diagnostics_of(const StatusPicture& picture, Stamp now) {
  std::vector<Diagnostic> all{of_side(picture, now)};
  for (const LinkStatus& link : picture.side.links) all.push_back(of_link(picture, link, now));
  return all;
}

Payload diagnostic_array(const std::vector<Diagnostic>& all, const std::string& hardware_id,
                         Stamp now) {
  CdrWriter to;
  to.u32(static_cast<std::uint32_t>(now / kStampSecond));
  to.u32(static_cast<std::uint32_t>(now % kStampSecond));
  to.string("");  // frame_id
  to.u32(static_cast<std::uint32_t>(all.size()));
  for (const Diagnostic& one : all) {
    to.u8(static_cast<std::uint8_t>(one.level)).string(one.name).string(one.message);
    to.string(hardware_id).u32(static_cast<std::uint32_t>(one.values.size()));
    for (const auto& [key, value] : one.values) to.string(key).string(value);
  }
  return to.take();
}

}  // namespace connect_bridge
