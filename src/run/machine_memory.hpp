// The memory that this process may use.
#pragma once

#include <cstdint>
#include <string>

namespace connect_bridge {

// The least of `machine_bytes` and of the limits of the process's control groups, of version 2 or
// 1. `root`: the file system, "" or a folder in a test.
[[nodiscard]] std::uint64_t memory_limit(std::uint64_t machine_bytes, const std::string& root = {});

// memory_limit() of this machine's memory; 0: not known.
[[nodiscard]] std::uint64_t machine_memory();

}  // namespace connect_bridge
