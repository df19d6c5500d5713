// How many file descriptors this process may have, and which of them connections leave to files.
#pragma once

#include <cstddef>
#include <string>

namespace connect_bridge {

// No accepted connection takes the last ones: files that decide (tokens, parameters, certificates)
// can be read, and a withdrawal takes effect, however many connections somebody makes.
inline constexpr std::size_t kDescriptorsForFiles = 32;

// Raises the limit of this process as far as the host allows. Returns the limit.
std::size_t raise_descriptors();

// Whether an accepted socket leaves kDescriptorsForFiles. The kernel gives the lowest free number.
[[nodiscard]] bool leaves_descriptors(int socket);

// Why so many clients and other connections (unauthenticated ones, readers of the status) do not
// fit a limit of descriptors, with the cure; empty: they do.
[[nodiscard]] std::string descriptors_problem(std::size_t clients, std::size_t others,
                                              std::size_t limit);

}  // namespace connect_bridge
