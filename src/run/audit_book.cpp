#include "run/audit_book.hpp"

#include "core/ports/url.hpp"
#include "run/audit_json.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kStrangersNodeMax = 64;     // bytes
constexpr std::size_t kStrangersReasonMax = 128;  // most of these texts are ours

// Whether the event is of this side itself; there are few of these.
bool is_own(AuditEvent event) {
  return event == AuditEvent::kStarted || event == AuditEvent::kStopped ||
         event == AuditEvent::kRulesChanged || event == AuditEvent::kRulesRefused;
}

// Without the port: it has no meaning, and a client may use any number of ports.
std::string key_of(const AuditBook::Entry& entry) {
  Audit same = entry.audit;
  if (!same.link) same.address = host_of(same.address);
  return to_line(same, {});
}

// Texts of peers without a login are shortened.
AuditBook::Entry shortened(AuditBook::Entry entry) {
  if (entry.audit.link) return entry;
  if (entry.audit.node.size() > kStrangersNodeMax) entry.audit.node.resize(kStrangersNodeMax);
  if (entry.audit.reason.size() > kStrangersReasonMax)
    entry.audit.reason.resize(kStrangersReasonMax);
  return entry;
}

}  // namespace

std::string AuditBook::add(const Entry& whole) {
  if (is_own(whole.audit.event)) return to_line(whole.audit, whole.time);
  const Entry entry = shortened(whole);
  const std::string key = key_of(entry);
  if (const auto known = repeats_.find(key); known != repeats_.end()) {
    ++known->second.times;
    return {};
  }
  if (!admits(entry, entry.at)) return {};
  std::string text;
  if (lost_untold_ > 0) text = line_of_lost(std::exchange(lost_untold_, 0), entry.time);
  if (repeats_.size() < kRepeatsMax) repeats_.emplace(key, Repeat{entry, 0});
  return text + to_line(entry.audit, entry.time);
}

std::string AuditBook::take_due(TimePoint now, bool all) {
  std::string text;
  for (auto it = repeats_.begin(); it != repeats_.end();) {
    const Repeat& repeat = it->second;
    if (!all && now < repeat.first.at + kRepeatTime) {
      ++it;
      continue;
    }
    if (repeat.times > 0 && admits(repeat.first, now))
      text += to_line(repeat.first.audit, repeat.first.time, repeat.times + 1);
    it = repeats_.erase(it);
  }
  if (paces_.size() >= kIdentitiesMax)
    std::erase_if(paces_, [&](const auto& entry) { return entry.second.idle(now); });
  return text;
}

bool AuditBook::admits(const Entry& entry, TimePoint now) {
  const bool in_time = pace_of(entry).take(now);
  lost_ += in_time ? 0 : 1;
  lost_untold_ += in_time ? 0 : 1;
  return in_time;
}

Pace& AuditBook::pace_of(const Entry& entry) {
  if (!entry.audit.link) return strangers_;
  const std::string& identity = entry.audit.identity;
  if (const auto known = paces_.find(identity); known != paces_.end()) return known->second;
  if (paces_.size() >= kIdentitiesMax) return others_;
  return paces_.try_emplace(identity, kIdentityAtOnce, std::chrono::milliseconds(100))
      .first->second;
}

}  // namespace connect_bridge
