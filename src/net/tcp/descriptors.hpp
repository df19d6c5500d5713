// Limits of file descriptors: those of this process, and those that connections leave to files.
#pragma once

#include <cstddef>
#include <string>

namespace connect_bridge {

// No accepted connection takes the last descriptors. So files that decide (tokens, parameters,
// certificates) can be read, and a withdrawal takes effect, however many connections somebody
// makes.
inline constexpr std::size_t kDescriptorsForFiles = 32;

// Raises this process's limit of descriptors as far as the host allows. Returns the limit.
std::size_t raise_descriptors();

// Whether an accepted socket leaves kDescriptorsForFiles free. The kernel gives the lowest free
// number.
[[nodiscard]] bool leaves_descriptors(int socket);

// The problem and its cure, if so many clients and other connections do not fit a limit of
// descriptors; empty: they do. Other connections: unauthenticated ones, and readers of the status.
[[nodiscard]] std::string descriptors_problem(std::size_t clients, std::size_t others,
                                              std::size_t limit);

}  // namespace connect_bridge
