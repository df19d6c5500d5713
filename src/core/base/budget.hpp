// A bounded sum that many things have a share of.
#pragma once

#include <cstdint>
#include <limits>
#include <utility>

namespace connect_bridge {

// How much of something is in use. Shares are given back by the destructor of their Hold, so that
// no path can forget to. Budgets make a tree: what is held of one is held of those above it, too.
// A budget outlives its holds and those below it. Single-threaded.
class Budget {
 public:
  static constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();

  // A share of a budget; movable, empty by default.
  class Hold {
   public:
    Hold() = default;
    Hold(Hold&& other) noexcept
        : budget_(std::exchange(other.budget_, nullptr)),
          amount_(std::exchange(other.amount_, 0)) {}
    Hold& operator=(Hold&& other) noexcept {
      if (this == &other) return *this;
      release();
      budget_ = std::exchange(other.budget_, nullptr);
      amount_ = std::exchange(other.amount_, 0);
      return *this;
    }
    ~Hold() { release(); }

    // Nothing is held any more: then the budget may go first.
    void release() { resize(0); }
    // A share may shrink or grow; whether it fits was asked before.
    void resize(std::uint64_t amount) {
      if (budget_ && amount != amount_) budget_->add(amount - amount_);
      amount_ = budget_ ? amount : 0;
    }
    [[nodiscard]] std::uint64_t amount() const { return amount_; }
    // Nothing is left of what it is a share of.
    [[nodiscard]] bool is_full() const { return budget_ && budget_->room() == 0; }

   private:
    friend class Budget;
    Hold(Budget* budget, std::uint64_t amount) : budget_(budget), amount_(amount) {
      budget_->add(amount);
    }

    Budget* budget_ = nullptr;
    std::uint64_t amount_ = 0;
  };

  Budget() = default;  // without a limit
  explicit Budget(std::uint64_t most) : most_(most) {}
  explicit Budget(Budget* above) : above_(above) {}  // null: without a limit
  Budget(const Budget&) = delete;
  Budget& operator=(const Budget&) = delete;

  // Takes a share, whether it fits or not: the caller has asked used().
  [[nodiscard]] Hold hold(std::uint64_t amount) { return Hold(this, amount); }
  [[nodiscard]] std::uint64_t used() const { return used_; }
  // How much more may be taken. Nobody may have more than what is left to the others after that:
  // one alone gets a half, of n that are greedy each gets 1/(n+1), and there is always room for one
  // who has little (dynamic thresholds, Choudhury and Hahne 1998).
  [[nodiscard]] std::uint64_t room() const {
    const std::uint64_t most = above_ ? above_->room() : most_;
    if (most == kNoLimit) return most;
    return most - (used_ < most ? used_ : most);
  }

 private:
  void add(std::uint64_t difference) {  // modulo 2^64: it may be less
    for (Budget* each = this; each; each = each->above_) each->used_ += difference;
  }

  Budget* above_ = nullptr;
  std::uint64_t most_ = kNoLimit;
  std::uint64_t used_ = 0;
};

}  // namespace connect_bridge
