#include "ops/audit/audit_json.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <string_view>

#include "core/base/json.hpp"
#include "core/wire/words.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kStringBytesMax = 512;
constexpr std::size_t kGroupsMax = 32;

std::string cut(const std::string& text) {
  return text.size() <= kStringBytesMax ? text : text.substr(0, kStringBytesMax) + "...";
}

void add(OrderedJson& json, const char* key, const std::string& text) {
  if (!text.empty()) json[key] = cut(text);
}

std::string as_line(const OrderedJson& json) {
  return json.dump(-1, ' ', true, OrderedJson::error_handler_t::replace) + "\n";
}

OrderedJson begin(std::chrono::system_clock::time_point time, std::string_view event) {
  return {{"time", rfc3339(time)}, {"event", std::string(event)}};
}

void add_channel(OrderedJson& json, const AuditChannel& channel) {
  json["direction"] = channel.direction == Direction::kExport ? "export" : "import";
  json["kind"] = std::string(word_of(kKindWords, channel.kind));
  add(json, "name", channel.name);
  add(json, "type", channel.type);
  add(json, "rule", channel.rule);
}

}  // namespace

std::string rfc3339(std::chrono::system_clock::time_point time) {
  const auto whole = std::chrono::floor<std::chrono::milliseconds>(time).time_since_epoch().count();
  const auto seconds = static_cast<std::time_t>(whole / 1000);
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(seconds), whole % 1000);
}

std::string to_line(const Audit& audit, std::chrono::system_clock::time_point time) {
  OrderedJson json = begin(time, word_of(kAuditWords, audit.event));
  if (audit.link) json["link"] = audit.link.value;
  add(json, "identity", audit.identity);
  add(json, "address", audit.address);
  add(json, "node", audit.node);
  for (std::size_t i = 0; i < std::min(audit.groups.size(), kGroupsMax); ++i)
    json["groups"].push_back(cut(audit.groups[i]));
  if (audit.channel) add_channel(json, *audit.channel);
  add(json, "code", audit.code);
  add(json, "reason", audit.reason);
  return as_line(json);
}

std::string to_line(const AuditBook::LeftOut& left_out,
                    std::chrono::system_clock::time_point time) {
  OrderedJson json = begin(time, "left_out");
  add(json, "identity", left_out.identity);
  json["of"] = word_of(left_out.rank);
  json["lines"] = left_out.lines;
  for (const auto& [network, lines] : left_out.networks) json["networks"][cut(network)] = lines;
  return as_line(json);
}

}  // namespace connect_bridge
