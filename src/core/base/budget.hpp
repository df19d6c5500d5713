// A bounded amount of which many holders take a share.
#pragma once

#include <cstdint>
#include <limits>
#include <utility>

namespace connect_bridge {

// How much of something is in use. A share is given back by the destructor of its Hold, so no code
// path can forget it. Budgets form a tree: what is held of one is also held of those above it. A
// budget outlives its holds and those below it. Single-threaded.
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

    // Gives all back; after that the budget may be destroyed before this hold.
    void release() { resize(0); }
    // The share may shrink or grow; the caller has checked before that it fits.
    void resize(std::uint64_t amount) {
      if (!budget_ || amount == amount_) return;
      budget_->replace(amount_, amount);
      amount_ = amount;
    }
    [[nodiscard]] std::uint64_t amount() const { return amount_; }
    // Whether the budget has no room left.
    [[nodiscard]] bool is_full() const { return budget_ && budget_->room() == 0; }

   private:
    friend class Budget;
    Hold(Budget* budget, std::uint64_t amount) : budget_(budget), amount_(amount) {
      budget_->replace(0, amount);
    }

    Budget* budget_ = nullptr;
    std::uint64_t amount_ = 0;
  };

  Budget() = default;  // without a limit
  explicit Budget(std::uint64_t most) : most_(most) {}
  explicit Budget(Budget* above) : above_(above) {}  // null: without a limit
  Budget(const Budget&) = delete;
  Budget& operator=(const Budget&) = delete;

  // Takes a share, whether it fits or not: the caller has checked used().
  [[nodiscard]] Hold hold(std::uint64_t amount) { return Hold(this, amount); }
  [[nodiscard]] std::uint64_t used() const { return used_; }
  // How much more may be taken. No holder may have more than what is then left for the others: a
  // single one gets half, each of n greedy ones gets 1/(n+1), and there is always room for a holder
  // that has little (dynamic thresholds, Choudhury and Hahne 1998).
  [[nodiscard]] std::uint64_t room() const {
    const std::uint64_t most = above_ ? above_->room() : most_;
    if (most == kNoLimit) return most;
    return most - (used_ < most ? used_ : most);
  }

 private:
  // A share of `before`, which is in use here, becomes one of `after`.
  void replace(std::uint64_t before, std::uint64_t after) {
    for (Budget* each = this; each; each = each->above_) each->used_ = each->used_ - before + after;
  }

  Budget* above_ = nullptr;
  std::uint64_t most_ = kNoLimit;
  std::uint64_t used_ = 0;
};

}  // namespace connect_bridge
