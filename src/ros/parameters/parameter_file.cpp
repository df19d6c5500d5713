#include "ros/parameters/parameter_file.hpp"

#include <fmt/format.h>
#include <rcl/allocator.h>
#include <rcl_yaml_param_parser/parser.h>
#include <yaml-cpp/eventhandler.h>
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

// Follows the events of a parser and reports keys that are given twice, and those without a value.
// Keys are compared by their whole names, as rcl joins them: `rule.drive: {...}` and
// `rule: {drive: {...}}` are the same.
class KeyCheck : public YAML::EventHandler {
 public:
  explicit KeyCheck(std::string file) : file_(std::move(file)) {}

  [[nodiscard]] std::vector<std::string> take_twice_given() { return std::move(twice_given_); }
  // rcl takes no key without a value, and names the line alone.
  [[nodiscard]] std::vector<std::string> take_without_value() { return std::move(without_value_); }

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override {
    if (!levels_.empty() && levels_.back().is_map && !levels_.back().at_key)
      without_value_.push_back(at(levels_.back().line) + "\"" + levels_.back().shown +
                               "\" has no value; a list stands in brackets: [/one, /two]");
    scalar(mark, "~");
  }
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override { end_node(); }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                const std::string& value) override {
    scalar(mark, value);
  }
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    enter(false);
  }
  void OnSequenceEnd() override { leave(); }
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    enter(true);
  }
  void OnMapEnd() override { leave(); }

 private:
  struct Level {
    bool is_map = false;
    bool at_key = false;  // in a map: the next node is a key
    std::string name;     // of the map itself
    std::string key;      // in a map: the whole name of its present key
    std::string shown;    // the key as it is written there
    int line = 0;         // where it is
  };

  void scalar(const YAML::Mark& mark, const std::string& text) {
    if (!levels_.empty() && levels_.back().at_key) note_key(levels_.back(), mark, text);
    end_node();
  }

  void note_key(Level& level, const YAML::Mark& mark, const std::string& text) {
    level.key = level.name.empty() ? text : level.name + "." + text;
    level.shown = to_text(text, kKeyShown);
    level.line = mark.line + 1;
    const auto [first, is_new] = lines_.try_emplace(level.key, level.line);
    if (is_new) return;
    twice_given_.push_back(at(level.line) + "\"" + level.shown +
                           "\" is given twice, first in line " + std::to_string(first->second));
    level.key = unnamed();  // its own keys were told with it
  }

  [[nodiscard]] std::string at(int line) const { return file_ + ":" + std::to_string(line) + ": "; }

  // What has no key of its own, an entry of a list, gets a name that no other has.
  void enter(bool is_map) {
    const bool has_key = !levels_.empty() && levels_.back().is_map && !levels_.back().at_key;
    std::string name = has_key ? levels_.back().key : "";
    if (!has_key && !levels_.empty()) name = unnamed();
    levels_.push_back({is_map, is_map, std::move(name), {}, {}, 0});
  }

  std::string unnamed() { return "#" + std::to_string(++unnamed_); }

  void leave() {
    levels_.pop_back();
    end_node();
  }

  // In a map keys and values take turns.
  void end_node() {
    if (!levels_.empty() && levels_.back().is_map) levels_.back().at_key = !levels_.back().at_key;
  }

  const std::string file_;
  std::vector<std::string> twice_given_, without_value_;
  std::vector<Level> levels_;
  std::map<std::string, int> lines_;  // of each key, by its whole name: where it was first given
  int unnamed_ = 0;
};

struct YamlProblems {
  std::vector<std::string> certain;
  std::vector<std::string> without_value;  // what is wrong if rcl refuses the file
};

YamlProblems yaml_problems(const std::string& file) {
  std::ifstream text(file);
  if (!text) return {{file + ": cannot be opened: " + std::strerror(errno)}, {}};
  KeyCheck keys(file);
  std::string problem;
  try {
    YAML::Parser parser(text);
    while (parser.HandleNextDocument(keys)) {
    }
  } catch (const YAML::Exception& error) {
    problem = file + ":" + std::to_string(error.mark.line + 1) + ":" +
              std::to_string(error.mark.column + 1) + ": " + error.msg;
  }
  YamlProblems found{keys.take_twice_given(), keys.take_without_value()};
  if (!problem.empty()) found.certain.push_back(std::move(problem));
  return found;
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
