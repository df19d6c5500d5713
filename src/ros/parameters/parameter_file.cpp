#include "ros/parameters/parameter_file.hpp"

#include <fmt/format.h>
#include <rcl/allocator.h>
#include <rcl_yaml_param_parser/parser.h>
#include <yaml-cpp/yaml.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <string_view>
#include <system_error>

#include "core/wire/text.hpp"
#include "ros/node/ros_arguments.hpp"
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

struct YamlProblems {
  std::vector<std::string> certain;
  std::vector<std::string> without_value;  // what is wrong if rcl refuses the file
};

// Looks for keys that are given twice, and for those without a value: rcl takes none, and names the
// line alone. Keys are compared by their whole names, as rcl joins them: `rule.drive: {...}` and
// `rule: {drive: {...}}` are the same.
class KeyCheck {
 public:
  explicit KeyCheck(std::string file) : file_(std::move(file)) {}

  // `name`: of the node itself; empty: the whole document.
  void look_into(const YAML::Node& node, const std::string& name) {
    if (!node.IsMap()) return;
    for (const auto& entry : node) look_at(entry.first, entry.second, name);
  }

  YamlProblems found;

 private:
  void look_at(const YAML::Node& key, const YAML::Node& value, const std::string& map) {
    const std::string text = key.IsScalar() ? key.Scalar() : "~";
    const std::string name = map.empty() ? text : map + "." + text;
    const int line = key.Mark().line + 1;
    const std::string at =
        file_ + ":" + std::to_string(line) + ": \"" + to_text(text, kKeyShown) + "\" ";
    const auto [first, is_new] = lines_.try_emplace(name, line);
    if (!is_new)
      found.certain.push_back(at + "is given twice, first in line " +
                              std::to_string(first->second));
    if (value.IsNull())
      found.without_value.push_back(at + "has no value; a list stands in brackets: [/one, /two]");
    // The keys in what is there again were told with it. What stands before its key is an alias,
    // which rcl does not take, and may contain itself.
    const bool is_alias = value.Mark().pos < key.Mark().pos;
    if (is_new && !is_alias) look_into(value, name);
  }

  const std::string file_;
  std::map<std::string, int> lines_;  // of each key, by its whole name: where it was first given
};

YamlProblems yaml_problems(const std::string& file) {
  std::ifstream text(file);
  if (!text) return {{file + ": cannot be opened: " + std::strerror(errno)}, {}};
  KeyCheck keys(file);
  try {
    for (const YAML::Node& document : YAML::LoadAll(text)) keys.look_into(document, "");
  } catch (const YAML::Exception& error) {
    keys.found.certain.push_back(file + ":" + std::to_string(error.mark.line + 1) + ":" +
                                 std::to_string(error.mark.column + 1) + ": " + error.msg);
  }
  return std::move(keys.found);
}

// A pipe can be read once only, and rcl has to. A file that is missing is one that can be told.
bool can_be_read_twice(const std::string& file) {
  std::error_code failed;
  return std::filesystem::is_regular_file(file, failed) || !std::filesystem::exists(file, failed);
}

}  // namespace

std::vector<ParameterSection> take_sections(rcl_params_s* params) {
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

std::string ParameterFile::problem() const {
  return fmt::format("{}", fmt::join(problems, "; "));
}

ParameterFile read_parameter_file(const std::string& file) {
  ParameterFile result;
  YamlProblems found;
  if (can_be_read_twice(file)) found = yaml_problems(file);
  result.problems = std::move(found.certain);
  if (!result.problems.empty()) return result;
  rcl_params_t* params = rcl_yaml_node_struct_init(rcl_get_default_allocator());
  if (params != nullptr && rcl_parse_yaml_file(file.c_str(), params)) {
    result.sections = take_sections(params);
    return result;
  }
  const std::string words = words_of_rcl();  // also clears them
  result.problems = std::move(found.without_value);
  if (result.problems.empty()) result.problems.push_back(file + ": " + words);
  if (params != nullptr) rcl_yaml_node_struct_fini(params);
  return result;
}

std::vector<std::string> problems_of_parameter_files(int argc, const char* const* argv) {
  std::vector<std::string> problems;
  for (const auto& file : values_behind({"--params-file"}, argc, argv)) {
    if (!can_be_read_twice(file)) continue;
    for (auto& problem : read_parameter_file(file).problems) problems.push_back(std::move(problem));
  }
  return problems;
}

}  // namespace connect_bridge::ros
