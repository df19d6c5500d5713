#include "ros/node/process_log.hpp"

#include <rcl/allocator.h>
#include <rcl/logging.h>

#include <exception>

#include "ros/node/node.hpp"
#include "ros/rcl/rcl_result.hpp"

namespace connect_bridge::ros {
namespace {

// The only mutable global of src/ros, because rcl's C callback has no user data.
struct ProcessLog {
  std::recursive_mutex mutex;
  int users = 0;
};
ProcessLog& process_log() {
  static ProcessLog instance;
  return instance;
}

void write_log(const rcutils_log_location_t* location, int severity, const char* name,
               rcutils_time_point_value_t stamp, const char* format, va_list* arguments) {
  const std::lock_guard lock(log_mutex());
  rcl_logging_multiple_output_handler(location, severity, name, stamp, format, arguments);
}

// Sets up the log. Returns the problem; empty: none. After a failure it can be called again: rcl
// begins a new list of outputs, and keeps its state for /rosout.
std::string set_up(const rcl_arguments_t& arguments) {
  const auto allocator = rcl_get_default_allocator();
  try {
    const rcl_ret_t result =
        rcl_logging_configure_with_output_handler(&arguments, &allocator, &write_log);
    return result == RCL_RET_OK ? "" : error_text("cannot set up the log", result);
  } catch (const std::exception& error) {
    // spdlog throws if it cannot open a file. The exception has passed through rcl, which is C and
    // owns nothing at that place.
    return std::string("cannot set up the log: ") + error.what();
  }
}

// Parsed arguments contain whether rcl writes a file, and no function changes that. So the
// arguments are parsed again; the last one of contradicting arguments counts.
void set_up_without_file(const std::vector<std::string>& words) {
  std::vector<const char*> all;
  for (const auto& word : words) all.push_back(word.c_str());
  all.insert(all.end(), {"--ros-args", "--disable-external-lib-logs"});
  rcl_arguments_t arguments = rcl_get_zero_initialized_arguments();
  require_ok(rcl_parse_arguments(static_cast<int>(all.size()), all.data(),
                                 rcl_get_default_allocator(), &arguments),
             "cannot set up the log");
  const std::string problem = set_up(arguments);
  ignore_error(rcl_arguments_fini(&arguments));
  if (!problem.empty()) throw RosError(problem);
}

}  // namespace

std::recursive_mutex& log_mutex() {
  return process_log().mutex;
}

std::string begin_log(const rcl_arguments_t& arguments, const std::vector<std::string>& words) {
  const std::lock_guard lock(log_mutex());
  std::string no_file;
  if (process_log().users == 0) no_file = set_up(arguments);
  if (!no_file.empty()) set_up_without_file(words);
  ++process_log().users;
  return no_file;
}

void end_log() {
  const std::lock_guard lock(log_mutex());
  if (--process_log().users == 0) ignore_error(rcl_logging_fini());
}

}  // namespace connect_bridge::ros
