// Collects the actions of a side's parts, their payers, and the follow-ups; gives out ids.
#pragma once

#include <algorithm>
#include <deque>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/base/logged_once.hpp"
#include "core/ports/actions.hpp"
#include "core/ports/follow_ups.hpp"
#include "core/ports/payer.hpp"

namespace connect_bridge {

class Outputs {
 public:
  // Work that is done and actions that are pushed while this object exists are done for one
  // identity.
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
  // A step begins. It has no payer until Paying sets one.
  void begin_step() { paying_.clear(); }
  // Charges the cost of the work since begin_step(), or of the action that was given last. All
  // payers of it pay alike.
  void spent(Duration cost, TimePoint now) {
    for (const Payer& payer : paying_) payer->add(cost / static_cast<int>(paying_.size()), now);
  }

  void push(Action action) { actions_.emplace_back(std::move(action), payer_); }
  void log(LogLevel level, std::string text) { push(Log{level, std::move(text)}); }
  // Work for the side once the input is handled.
  void follow_up(FollowUp what) { follow_ups_.add(what); }
  // The first follow-up to do now, if it does not come after `last`.
  std::optional<FollowUp> take_follow_up(FollowUp last) { return follow_ups_.take(last); }

  // Logs a line once: for an event that comes back as often as its cause, and for a line that
  // several parts log alike.
  void log_once(LogLevel level, const std::string& text) { log_once(logged_, level, text); }
  // The record of lines that were logged once and are not of one identity.
  [[nodiscard]] LoggedOnce& logged() { return logged_; }
  // Logs a line with words of a peer once. `logged`: the record of the peer's identity, so that the
  // peer silences no other's lines.
  void log_once(LoggedOnce& logged, LogLevel level, const std::string& text) {
    if (logged.first(text)) log(level, text);
  }

  // True: an audit log is kept. Otherwise its lines need not be made.
  [[nodiscard]] bool audits() const { return audits_; }
  void set_audits(bool on) { audits_ = on; }

  // Called from time to time.
  void on_time(const Now& now) { logged_.on_time(now); }

  std::optional<Action> next() {
    if (actions_.empty()) return std::nullopt;
    auto [action, payer] = std::move(actions_.front());
    actions_.pop_front();
    paying_.clear();
    if (payer) paying_.push_back(std::move(payer));
    return std::move(action);
  }

  // An id of an entity, an invocation or a job that was not used before.
  template <class Id>
  Id new_id() {
    return {++std::get<Id>(last_).value};
  }

 private:
  void note_payer() {
    if (payer_ && std::find(paying_.begin(), paying_.end(), payer_) == paying_.end())
      paying_.push_back(payer_);
  }

  std::deque<std::pair<Action, Payer>> actions_;
  Payer payer_;                // of the present work
  std::vector<Payer> paying_;  // each once
  FollowUps follow_ups_;
  LoggedOnce logged_;
  bool audits_ = false;
  std::tuple<SubscriptionId, MirrorId, ServiceMirrorId, ServiceClientId, InvocationId, JobId,
             PictureId>
      last_;
};

}  // namespace connect_bridge
