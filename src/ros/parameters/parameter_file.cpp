#include "ros/parameters/parameter_file.hpp"

#include <rcl/allocator.h>
#include <rcl_yaml_param_parser/parser.h>

#include <cerrno>
#include <cstring>
#include <fstream>

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

ParameterFile read_parameter_file(const std::string& file) {
  ParameterFile result;
  if (!std::ifstream(file)) {
    result.problem = file + ": cannot be opened: " + std::strerror(errno);
    return result;
  }
  rcl_params_t* params = rcl_yaml_node_struct_init(rcl_get_default_allocator());
  if (params != nullptr && rcl_parse_yaml_file(file.c_str(), params)) {
    result.sections = take_sections(params);
    return result;
  }
  result.problem = file + ": " + words_of_rcl();
  if (params != nullptr) rcl_yaml_node_struct_fini(params);
  return result;
}

}  // namespace connect_bridge::ros
