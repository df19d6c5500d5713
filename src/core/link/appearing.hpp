// Endpoints that peers make appear in the local graph, one after another.
#pragma once

#include <algorithm>
#include <list>
#include <optional>
#include <utility>

#include "core/base/pace.hpp"
#include "core/base/time.hpp"
#include "core/base/timers.hpp"
#include "core/link/loop_turns.hpp"
#include "core/ports/payer.hpp"

namespace connect_bridge {

// Publishers, services and subscriptions that are to appear wait in lines, one for each identity
// and pace. Each endpoint takes the middleware some 0.3 ms while everything else waits, so one
// comes at a time. The identity that has used least of the loop's time is next. A waiting endpoint
// costs nothing. Single-threaded; outlives its lines.
class Appearing {
 public:
  class Line;

  // An endpoint that is to appear. It leaves its line when it is destroyed.
  class Waiting {
   public:
    Waiting(const Waiting&) = delete;
    Waiting& operator=(const Waiting&) = delete;
    // The turn has come: the endpoint asks again (Line::ask), or no longer wants to appear.
    virtual void appear(const Now& now) = 0;

   protected:
    Waiting() = default;
    virtual ~Waiting() { leave(); }

   private:
    friend Line;
    friend Appearing;
    void leave() {
      if (line_) line_->remove(*this);
    }

    Line* line_ = nullptr;  // null: it does not wait
    std::list<Waiting*>::iterator place_;
  };

  enum class Answer {
    kNow,   // the endpoint appears, and is counted
    kSoon,  // it waits, as only a few appear in one step
    kLate,  // it waits, reported once: the identity makes more appear than its pace allows
  };

  class Line {
   public:
    // Every process of the graph pays for an endpoint that comes and goes. So many may come as two
    // times the largest graph has, then fewer without end.
    static constexpr int kSustainedAtOnce = 65'536;
    static constexpr Duration kSustainedPeriod = std::chrono::milliseconds(50);

    // Without `all` nobody gives turns: an endpoint that may not appear at once waits for ever.
    Line(Appearing* all, Payer payer, int at_once, Duration period)
        : all_(all), payer_(std::move(payer)), pace_(at_once, period) {}
    Line(const Line&) = delete;
    Line& operator=(const Line&) = delete;
    ~Line() {
      while (!waiting_.empty()) waiting_.front()->leave();
    }

    [[nodiscard]] Answer ask(Waiting& who, TimePoint now) {
      if (all_ && all_->turn_ == std::pair<const Line*, const Waiting*>(this, &who)) {
        all_->turn_ = {};
        return count(now);
      }
      if (who.line_ == this) return Answer::kSoon;
      who.leave();
      const bool free = waiting_.empty() && free_at() <= now;
      if (free && (!all_ || all_->pace_.take(now))) return count(now);
      const bool late =
          free_at() + pace_.period() * static_cast<std::int64_t>(waiting_.size()) > now;
      add(who, now);
      return late ? Answer::kLate : Answer::kSoon;
    }

   private:
    friend Appearing;
    friend Waiting;

    Answer count(TimePoint now) {
      static_cast<void>(pace_.take(now));
      static_cast<void>(sustained_.take(now));
      return Answer::kNow;
    }
    [[nodiscard]] TimePoint free_at() const {
      return std::max(pace_.free_at(), sustained_.free_at());
    }
    void add(Waiting& who, TimePoint now) {
      if (waiting_.empty()) {
        since_ = now;
        if (all_) all_->lines_.push_back(this);
      }
      who.line_ = this;
      who.place_ = waiting_.insert(waiting_.end(), &who);
    }
    void remove(Waiting& who) {
      waiting_.erase(who.place_);
      who.line_ = nullptr;
      if (all_ && waiting_.empty()) all_->lines_.remove(this);
    }

    Appearing* const all_;
    const Payer payer_;
    Pace pace_;
    Pace sustained_{kSustainedAtOnce, kSustainedPeriod};
    std::list<Waiting*> waiting_;
    TimePoint since_{};  // time of the last turn, or since when something waits
  };

  // `at_once` endpoints appear at once, as long as none waits, then one in each period. Between two
  // of them the loop does other work.
  explicit Appearing(int at_once = 8, Duration period = std::chrono::microseconds(500))
      : pace_(at_once, period) {}
  Appearing(const Appearing&) = delete;
  Appearing& operator=(const Appearing&) = delete;

  // Gives a turn if it is time. Packets of identities that have used less loop time come first.
  void on_time(const LoopTurns& packets, const Now& now) {
    if (next_at_ > now.steady || pace_.free_at() > now.steady) return;
    Line* next = nullptr;
    for (Line* const line : lines_)
      if (line->free_at() <= now.steady && (!next || line->payer_->rank() < next->payer_->rank()))
        next = line;
    if (!next) return;
    if (packets.come_before(*next->payer_, next->since_, now.steady)) {  // mutant: appear_later
      next_at_ = now.steady + pace_.period();
      return;
    }
    next->since_ = now.steady;
    static_cast<void>(pace_.take(now.steady));
    Waiting& first = *next->waiting_.front();
    first.leave();
    turn_ = {next, &first};
    first.appear(now);
    turn_ = {};
  }
  // The time of the next turn.
  [[nodiscard]] std::optional<TimePoint> deadline() const {
    std::optional<TimePoint> first;
    for (const Line* const line : lines_) first = earliest(first, line->free_at());
    if (first) first = std::max({*first, pace_.free_at(), next_at_});
    return first;
  }

 private:
  Pace pace_;
  TimePoint next_at_{};     // other work comes first until then
  std::list<Line*> lines_;  // lines in which an endpoint waits
  std::pair<const Line*, const Waiting*> turn_{};
};

}  // namespace connect_bridge
