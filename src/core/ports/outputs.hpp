// Collects the actions of the parts of a side, who pays for them, and what follows; gives out ids.
#pragma once

#include <algorithm>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/follow_ups.hpp"
#include "core/base/tell_once.hpp"
#include "core/ports/actions.hpp"
#include "core/ports/payer.hpp"

namespace connect_bridge {

class Outputs {
 public:
  // While it exists, what is done and pushed is done for one identity.
  class Paying {
   public:
    Paying(Outputs& outputs, Payer payer)
        : outputs_(outputs), before_(std::exchange(outputs.payer_, std::move(payer))) {
      outputs_.note_payer();
    }
    ~Paying() { outputs_.payer_ = std::move(before_); }
    Paying(const Paying&) = delete;
    Paying& operator=(const Paying&) = delete;

   private:
    Outputs& outputs_;
    Payer before_;
  };
  [[nodiscard]] const Payer& payer() const { return payer_; }
  // A step begins, for which nobody pays until somebody does.
  void begin_step() { paying_.clear(); }
  // What was done since begin_step(), or the action that was given last, has cost so much. Those
  // for whom it was pay alike.
  void spent(Duration cost, TimePoint now) {
    for (const Payer& payer : paying_) payer->add(cost / static_cast<int>(paying_.size()), now);
  }

  void push(Action action) { actions_.emplace_back(std::move(action), payer_); }
  void log(LogLevel level, std::string text) { push(Log{level, std::move(text)}); }
  // To be done by the side once the input is handled.
  void follow_up(FollowUp what) { follow_ups_.add(what); }
  // The first one that is to be done now, if it is not behind `last`.
  std::optional<FollowUp> take_follow_up(FollowUp last) { return follow_ups_.take(last); }

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
    auto [action, payer] = std::move(actions_.front());
    actions_.pop_front();
    paying_.clear();
    if (payer) paying_.push_back(std::move(payer));
    return std::move(action);
  }

  SubscriptionId new_subscription() { return {++last_subscription_}; }
  MirrorId new_mirror() { return {++last_mirror_}; }
  ServiceMirrorId new_service_mirror() { return {++last_service_mirror_}; }
  ServiceClientId new_service_client() { return {++last_service_client_}; }
  InvocationId new_invocation() { return {++last_invocation_}; }
  JobId new_job() { return {++last_job_}; }

 private:
  void note_payer() {
    if (payer_ && std::find(paying_.begin(), paying_.end(), payer_) == paying_.end())
      paying_.push_back(payer_);
  }

  std::deque<std::pair<Action, Payer>> actions_;
  Payer payer_;                // of what is done now
  std::vector<Payer> paying_;  // each once
  FollowUps follow_ups_;
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
