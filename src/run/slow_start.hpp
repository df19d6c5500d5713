// Reports a middleware that does not start.
#pragma once

#include <chrono>
#include <functional>
#include <thread>

namespace connect_bridge {

// Fast DDS waits forever for shared memory that a killed process did not finish, and the user would
// not know the cause. The thread calls `say` once, unless it is stopped within `patience`.
[[nodiscard]] std::jthread says_if_slow(std::chrono::milliseconds patience,
                                        std::function<void()> say);

inline constexpr std::chrono::seconds kSlowStartPatience{10};
// Advice for the user, written to file descriptor 2.
extern const char kSlowStartText[];

}  // namespace connect_bridge
