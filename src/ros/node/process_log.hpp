// rcl's log: a process has one, whatever number of nodes it has.
#pragma once

#include <rcl/arguments.h>

#include <mutex>
#include <string>
#include <vector>

namespace connect_bridge::ros {

// To be held while anything of rcl or rcutils writes to the log or changes it: rcl's logging is not
// thread-safe.
[[nodiscard]] std::recursive_mutex& log_mutex();

// Once for each node, before it is made; the first one sets up the log. `words` are the arguments
// of main() that `arguments` was parsed from. If the log's file cannot be made, the log is set up
// without one. Returns why, empty if that is not so. Throws RosError if there can be no log at all.
[[nodiscard]] std::string begin_log(const rcl_arguments_t& arguments,
                                    const std::vector<std::string>& words);

// Once for each begin_log() that returned; the last one ends the log.
void end_log();

}  // namespace connect_bridge::ros
