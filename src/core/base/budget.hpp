// A bounded sum that many things have a share of.
#pragma once

#include <cstdint>
#include <utility>

namespace connect_bridge {

// How much of something is in use. Shares are given back by the destructor of their Hold, so that
// no path can forget to. The budget outlives its holds. Single-threaded.
class Budget {
 public:
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

    void release() { resize(0); }
    // A share may shrink or grow; whether it fits was asked before.
    void resize(std::uint64_t amount) {
      if (budget_) budget_->used_ += amount - amount_;
      amount_ = budget_ ? amount : 0;
    }
    [[nodiscard]] std::uint64_t amount() const { return amount_; }

   private:
    friend class Budget;
    Hold(Budget* budget, std::uint64_t amount) : budget_(budget), amount_(amount) {
      budget_->used_ += amount;
    }

    Budget* budget_ = nullptr;
    std::uint64_t amount_ = 0;
  };

  Budget() = default;
  Budget(const Budget&) = delete;
  Budget& operator=(const Budget&) = delete;

  // Takes a share, whether it fits or not: the caller has asked used().
  [[nodiscard]] Hold hold(std::uint64_t amount) { return Hold(this, amount); }
  [[nodiscard]] std::uint64_t used() const { return used_; }

 private:
  std::uint64_t used_ = 0;
};

}  // namespace connect_bridge
