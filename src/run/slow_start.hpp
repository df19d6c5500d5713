// Says it if the middleware does not start.
#pragma once

#include <chrono>
#include <functional>
#include <thread>

namespace connect_bridge {

// Fast DDS waits without end for shared memory that a process did not finish before it was killed;
// the user would not know what holds up the start. The thread calls `say` once, unless it is ended
// within `patience`.
[[nodiscard]] std::jthread says_if_slow(std::chrono::milliseconds patience,
                                        std::function<void()> say);

inline constexpr std::chrono::seconds kSlowStartPatience{10};
// What a user can do, for the file descriptor 2.
extern const char kSlowStartText[];

}  // namespace connect_bridge
