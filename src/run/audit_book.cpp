#include "run/audit_book.hpp"

#include "run/audit_json.hpp"

namespace connect_bridge {
namespace {

// Of this side itself: they are few.
bool is_own(AuditEvent event) {
  return event == AuditEvent::kStarted || event == AuditEvent::kStopped ||
         event == AuditEvent::kRulesChanged || event == AuditEvent::kRulesRefused;
}

std::string key_of(const AuditBook::Entry& entry) {
  Audit same = entry.audit;
  // A port tells nothing, and a stranger has as many as it likes.
  if (!same.link) same.address = same.address.substr(0, same.address.rfind(':'));
  return to_line(same, {});
}

}  // namespace

std::string AuditBook::add(const Entry& entry) {
  if (is_own(entry.audit.event)) return to_line(entry.audit, entry.time);
  const std::string key = key_of(entry);
  if (const auto known = repeats_.find(key); known != repeats_.end()) {
    ++known->second.times;
    return {};
  }
  if (!admits(entry)) {
    ++lost_;
    ++lost_untold_;
    return {};
  }
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
    if (repeat.times > 0) text += to_line(repeat.first.audit, repeat.first.time, repeat.times + 1);
    it = repeats_.erase(it);
  }
  if (paces_.size() >= kIdentitiesMax)
    std::erase_if(paces_, [&](const auto& entry) { return entry.second.idle(now); });
  return text;
}

bool AuditBook::admits(const Entry& entry) {
  return pace_of(entry).take(entry.at);
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
