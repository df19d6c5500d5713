#include "ros/parameters/parameter_file.hpp"

#include <fmt/format.h>
#include <rcl/allocator.h>
#include <rcl/arguments.h>
#include <rcl_yaml_param_parser/parser.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string_view>
#include <system_error>

#include "core/wire/text.hpp"
#include "ros/parameters/ros_arguments.hpp"
#include "ros/parameters/yaml_problems.hpp"
#include "ros/rcl/rcl_result.hpp"

namespace connect_bridge::ros {
namespace {

template <class Value, class Array>
std::vector<Value> values_of(const Array& array) {
  return std::vector<Value>(array.values, array.values + array.size);
}

ParameterValue value_of(const rcl_variant_t& value) {
  if (value.bool_value) return *value.bool_value;
  if (value.integer_value) return *value.integer_value;
  if (value.double_value) return *value.double_value;
  if (value.string_value) return std::string{value.string_value};
  if (value.byte_array_value) return values_of<std::uint8_t>(*value.byte_array_value);
  if (value.bool_array_value) return values_of<bool>(*value.bool_array_value);
  if (value.integer_array_value) return values_of<std::int64_t>(*value.integer_array_value);
  if (value.double_array_value) return values_of<double>(*value.double_array_value);
  std::vector<std::string> strings;
  if (const auto* array = value.string_array_value) {
    strings.assign(array->data, array->data + array->size);
  }
  return strings;
}

constexpr std::size_t kKeyShown = 100;  // bytes

Cause cause_of_open(int error) {
  if (error == ENOENT || error == ENOTDIR) return Cause::kFileMissing;
  return error == EACCES ? Cause::kFileNotPermitted : Cause::kFileUnreadable;
}

// rcl reads only what has a path: the content of a pipe, which was read to be looked into, gets
// one.
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view content) : handle_(::memfd_create("params", MFD_CLOEXEC)) {
    if (handle_ < 0) return;
    while (!content.empty()) {
      const ssize_t written = ::write(handle_, content.data(), content.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) return;
      content.remove_prefix(static_cast<std::size_t>(written));
    }
    is_whole_ = true;
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() {
    if (handle_ >= 0) ::close(handle_);
  }

  // False: memory or a limit did not suffice. The part that was written could be valid YAML.
  [[nodiscard]] bool is_whole() const { return is_whole_; }
  [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(handle_); }

 private:
  const int handle_;
  bool is_whole_ = false;
};

// The sections of parameters that rcl has parsed; frees these.
std::vector<ParameterSection> take_sections(rcl_params_t* params) {
  std::vector<ParameterSection> sections;
  if (params == nullptr) return sections;
  for (std::size_t n = 0; n < params->num_nodes; ++n) {
    ParameterSection section;
    section.node = params->node_names[n];
    const rcl_node_params_t& node = params->params[n];
    for (std::size_t p = 0; p < node.num_params; ++p) {
      section.parameters.insert_or_assign(node.parameter_names[p],
                                          value_of(node.parameter_values[p]));
    }
    sections.push_back(std::move(section));
  }
  rcl_yaml_node_struct_fini(params);
  return sections;
}

// Empty: rcl has read the file at this path, and the sections are those in it.
std::string parse_by_rcl(const std::string& path, std::vector<ParameterSection>& sections) {
  rcl_params_t* params = rcl_yaml_node_struct_init(rcl_get_default_allocator());
  if (params != nullptr && rcl_parse_yaml_file(path.c_str(), params)) {
    sections = take_sections(params);
    return {};
  }
  std::string words = words_of_rcl();  // also clears them
  if (params != nullptr) rcl_yaml_node_struct_fini(params);
  return words.empty() ? "cannot be read" : words;
}

std::string parse_by_rcl(const MemoryFile& file, std::vector<ParameterSection>& sections) {
  return file.is_whole() ? parse_by_rcl(file.path(), sections) : "cannot be read";
}

// rcl puts before its reason the whole rule, which may hold a secret.
std::string reason_in(const std::string& words) {
  constexpr std::string_view kMark = "'. Error: ";
  const std::size_t found = words.rfind(kMark);
  if (found == std::string::npos) return "cannot be read";
  std::string reason = words.substr(found + kMark.size());
  // Of its lexer, which knows the parts of a name by number.
  if (reason.find("lexeme") != std::string::npos)
    return "expected KEY:=VALUE, or NODE:KEY:=VALUE with a node's name without its namespace";
  if (reason.find("should be of same type") != std::string::npos)
    return "a list of several kinds of values: write all alike, text in quotes";
  return reason;
}

}  // namespace

bool can_be_read_twice(const std::string& file) {
  std::error_code failed;
  return std::filesystem::is_regular_file(file, failed) || !std::filesystem::exists(file, failed);
}

std::string ParameterFile::problem() const {
  return fmt::format("{}", fmt::join(problems, "; "));
}

ParameterFile read_parameter_file(const std::string& file) {
  ParameterFile result;
  std::ifstream in(file);
  if (!in) {
    const int error = errno;
    result.problems = {file + ": cannot be opened: " + std::strerror(error)};
    result.cause = cause_of_open(error);
    return result;
  }
  const bool is_pipe = !can_be_read_twice(file);
  std::stringstream copy;
  if (is_pipe) copy << in.rdbuf();
  if (copy.bad() || std::filesystem::is_directory(file)) {
    result.problems = {file + ": cannot be read"};
    result.cause = Cause::kFileUnreadable;
    return result;
  }
  const std::string text = copy.str();
  copy.clear();
  YamlProblems found = yaml_problems(file, is_pipe ? static_cast<std::istream&>(copy) : in);
  result.cause = Cause::kYamlWrong;
  result.problems = std::move(found.certain);
  if (!result.problems.empty()) return result;
  const std::string words = is_pipe ? parse_by_rcl(MemoryFile(text), result.sections)
                                    : parse_by_rcl(file, result.sections);
  if (words.empty()) {
    result.cause = Cause::kNone;
    return result;
  }
  result.problems = std::move(found.if_refused);
  if (result.problems.empty()) result.problems.push_back(file + ": " + words);
  return result;
}

ParameterFile read_parameter_rule(const std::string& rule) {
  ParameterFile result;
  const std::size_t end = rule.find(":=");
  const std::string_view shown =
      end == std::string::npos ? without_value(rule) : std::string_view(rule).substr(0, end);
  const std::string key = to_text(shown, kKeyShown);
  if (end == std::string::npos || end == 0) {
    result.problems = {"-p " + key + ": expected KEY:=VALUE"};
    return result;
  }
  if (rule.find_first_not_of(" \t", end + 2) == std::string::npos) {
    result.problems = {"-p " + key + ": expected a value behind :=, an empty text is '\"\"'"};
    return result;
  }
  const char* const words[] = {"--ros-args", "-p", rule.c_str()};
  rcl_arguments_t arguments = rcl_get_zero_initialized_arguments();
  const rcl_ret_t parsed = rcl_parse_arguments(static_cast<int>(std::size(words)), words,
                                               rcl_get_default_allocator(), &arguments);
  if (parsed != RCL_RET_OK) {
    result.problems = {"-p " + key + ": " + reason_in(words_of_rcl())};
    return result;
  }
  rcl_params_t* params = nullptr;
  if (!ignore_error(rcl_arguments_get_param_overrides(&arguments, &params)))
    result.problems = {"-p " + key + ": cannot be read"};
  result.sections = take_sections(params);
  ignore_error(rcl_arguments_fini(&arguments));
  return result;
}

}  // namespace connect_bridge::ros
