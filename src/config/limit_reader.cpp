#include "config/limit_reader.hpp"

#include <algorithm>

#include "config/rule_reader.hpp"

namespace connect_bridge {
namespace {

void fill_link_limits(const CheckedValues& values, SideOptions& limits) {
  limits.dead_after = from_seconds(values.number("dead_after"));
  limits.resume_for = from_seconds(values.number("resume.seconds"));
  limits.resume_bytes_max = static_cast<std::uint64_t>(values.whole("resume.bytes"));
  limits.retry_min = from_seconds(values.number("retry_min"));
  limits.retry_max = from_seconds(values.number("retry_max"));
  if (!values.given("retry_max")) limits.retry_max = std::max(limits.retry_max, limits.retry_min);
  limits.dial_timeout = from_seconds(values.number("dial_timeout"));
  limits.login_timeout = from_seconds(values.number("login_timeout"));
  limits.default_depth = values.u32("default_depth");
  limits.latched_depth = values.u32("latched_depth");
  limits.history_bytes_max = static_cast<std::uint64_t>(values.whole("history_bytes_max"));
  limits.links_max = values.u32("connections_max");
  limits.identity_links_max = values.u32("connections_per_identity_max");
  limits.channels_max = values.u32("channels_max");
  limits.mirrors_max = values.u32("mirrors_max");
  auto& all_mirrors = limits.account.mirrors_max;  // of which one that is alone has half
  all_mirrors = std::max(all_mirrors, 2 * std::uint64_t{limits.mirrors_max});
  limits.topic_mirrors_max = values.u32("topic_mirrors_max");
  limits.mirror_depth_max = values.u32("mirror_depth_max");
  limits.mirror_bytes_max = static_cast<std::uint64_t>(values.whole("mirror_bytes_max"));
  limits.account.memory_bytes_max = static_cast<std::uint64_t>(values.whole("memory_max"));
  limits.account.mirror_period =
      Duration(std::chrono::seconds(1)) / values.whole("mirrors_per_second");
  limits.account.services_max = static_cast<std::uint64_t>(values.whole("limits.services_max"));
  limits.listeners_max = values.u32("limits.listeners_max");
  limits.account.control_bytes_per_second =
      static_cast<std::uint64_t>(values.whole("limits.control_bytes_per_second"));
  limits.account.channels_per_second = static_cast<int>(values.whole("limits.channels_per_second"));
  limits.calls_max = values.u32("calls_max");
  limits.outbox.queue_delay_target = from_seconds(values.number("queue_delay_target"));
  limits.outbox.bytes_per_second_max =
      static_cast<std::uint64_t>(values.whole("link.bytes_per_second"));
  limits.outbox.fragment_bytes = values.u32("fragment_bytes");
  limits.outbox.packet_bytes = std::min(limits.outbox.packet_bytes, limits.outbox.fragment_bytes);
  limits.outbox.data_bytes_max = static_cast<std::uint64_t>(values.whole("queue_bytes_max"));
  limits.reassembly.message_bytes_max = values.u32("max_message_size");
  // As many large messages may be unfinished at a time as with the core's defaults, and not fewer
  // if they are small: a peer sends parts of all topics in turn.
  const ReassemblyOptions normal;
  limits.reassembly.open_bytes_max =
      std::max(normal.open_bytes_max, limits.reassembly.message_bytes_max *
                                          (normal.open_bytes_max / normal.message_bytes_max));
}

// Wrong logins: what a minute allows is answered at once.
void fill_stranger_limits(const CheckedValues& values, SideOptions& limits) {
  const auto fill = [&](const char* key, int& at_once, Duration& period) {
    at_once = static_cast<int>(values.whole(key));
    period = Duration(std::chrono::minutes(1)) / at_once;
  };
  limits.strangers_max = values.u32("limits.strangers_max");
  fill("limits.wrong_logins_per_minute", limits.wrong_logins_at_once, limits.wrong_login_period);
  fill("limits.address_wrong_logins_per_minute", limits.address_wrong_logins_at_once,
       limits.address_wrong_login_period);
  limits.account.offence_period =
      Duration(std::chrono::minutes(1)) / values.whole("limits.offences_per_minute");
}

}  // namespace

void fill_limits(const CheckedValues& values, SideOptions& limits) {
  fill_link_limits(values, limits);
  fill_stranger_limits(values, limits);
}

}  // namespace connect_bridge
