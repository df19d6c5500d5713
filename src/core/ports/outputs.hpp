// Collects the actions of the parts of a side, and gives out new ids.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <utility>

#include "core/base/tell_once.hpp"
#include "core/ports/actions.hpp"

namespace connect_bridge {

class Outputs {
 public:
  void push(Action action) { actions_.push_back(std::move(action)); }
  void log(LogLevel level, std::string text) { push(Log{level, std::move(text)}); }
  // For what comes back as often as its cause does, and for what several parts say alike.
  void log_once(LogLevel level, const std::string& text) { log_once(told_, level, text); }
  // What was logged once that is not of one identity.
  [[nodiscard]] TellOnce& told() { return told_; }
  // For lines with words of a peer: those of its identity, so that it silences nobody else's.
  void log_once(TellOnce& told, LogLevel level, const std::string& text) {
    if (told.first(text)) log(level, text);
  }

  // Whether an audit log is kept; otherwise its lines need not be made.
  [[nodiscard]] bool audits() const { return audits_; }
  void set_audits(bool on) { audits_ = on; }

  // To be called from time to time.
  void on_time(const Now& now) { told_.on_time(now); }

  std::optional<Action> next() {
    if (actions_.empty()) return std::nullopt;
    Action action = std::move(actions_.front());
    actions_.pop_front();
    return action;
  }

  SubscriptionId new_subscription() { return {++last_subscription_}; }
  MirrorId new_mirror() { return {++last_mirror_}; }
  ServiceMirrorId new_service_mirror() { return {++last_service_mirror_}; }
  ServiceClientId new_service_client() { return {++last_service_client_}; }
  InvocationId new_invocation() { return {++last_invocation_}; }
  JobId new_job() { return {++last_job_}; }

 private:
  std::deque<Action> actions_;
  TellOnce told_;
  bool audits_ = false;
  std::uint64_t last_subscription_ = 0;
  std::uint64_t last_mirror_ = 0;
  std::uint64_t last_service_mirror_ = 0;
  std::uint64_t last_service_client_ = 0;
  std::uint64_t last_invocation_ = 0;
  std::uint64_t last_job_ = 0;
};

}  // namespace connect_bridge
