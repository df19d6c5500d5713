// The log of rcl: a process has one, whatever the number of its nodes.
#pragma once

#include <rcl/arguments.h>

#include <mutex>
#include <string>
#include <vector>

namespace connect_bridge::ros {

// Hold this lock while rcl or rcutils writes to the log or changes it: rcl's logging is not
// thread-safe.
[[nodiscard]] std::recursive_mutex& log_mutex();

// Call it once for each node, before the node is made; the first call sets up the log. `words`: the
// arguments of main(), from which `arguments` was parsed. If the log's file cannot be made, the log
// has no file and the reason is returned; empty: no problem. Throws RosError if there can be no log
// at all.
[[nodiscard]] std::string begin_log(const rcl_arguments_t& arguments,
                                    const std::vector<std::string>& words);

// Call it once for each begin_log() that returned; the last call ends the log.
void end_log();

}  // namespace connect_bridge::ros
