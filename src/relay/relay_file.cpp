#include "relay/relay_file.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <string_view>

namespace connect_bridge {
namespace {

constexpr std::array<std::string_view, 8> kKeys{
    "strict_modes",           "auth.token_file", "listen.address",  "listen.port",
    "listen.trusted_proxies", "status.listen",   "tls.certificate", "tls.private_key"};
constexpr std::string_view kProxies = "listen.trusted_proxies";
constexpr char kExpected[] =
    "expected a map of listen (address, port, trusted_proxies), tls (certificate, private_key), "
    "auth "
    "(token_file) and status (listen)";

ParameterValue value_of_scalar(const YAML::Node& node) {
  std::int64_t whole = 0;
  bool flag = false;
  if (node.Tag() != "!" && YAML::convert<std::int64_t>::decode(node, whole)) return whole;
  if (node.Tag() != "!" && YAML::convert<bool>::decode(node, flag)) return flag;
  return node.Scalar();
}

bool is_list(const YAML::Node& node) {
  return node.IsSequence() && std::all_of(node.begin(), node.end(),
                                          [](const YAML::Node& entry) { return entry.IsScalar(); });
}

std::vector<std::string> list_of_texts(const YAML::Node& list) {
  std::vector<std::string> texts;
  for (const YAML::Node& entry : list) texts.push_back(entry.Scalar());
  return texts;
}

// Two levels: further ones are no keys of a relay.
void read_map(const YAML::Node& map, const std::string& above, ParameterMap& parameters,
              std::vector<std::string>& problems) {
  for (const auto& entry : map) {
    const std::string key = above + (entry.first.IsScalar() ? entry.first.Scalar() : "?");
    if (entry.second.IsMap() && above.empty()) {
      read_map(entry.second, key + ".", parameters, problems);
    } else if (std::find(kKeys.begin(), kKeys.end(), key) == kKeys.end() ||
               !(key == kProxies ? is_list(entry.second) : entry.second.IsScalar())) {
      problems.push_back("line " + std::to_string(entry.first.Mark().line + 1) + ": " + key +
                         " is wrong, " + kExpected);
    } else if (!parameters
                    .emplace(key, key == kProxies ? ParameterValue{list_of_texts(entry.second)}
                                                  : value_of_scalar(entry.second))
                    .second) {
      problems.push_back(key + " is given twice");
    }
  }
}

}  // namespace

RelayFile read_relay_file(const std::string& text, const Surroundings& surroundings) {
  RelayFile file;
  ParameterMap parameters;
  try {
    const YAML::Node root = YAML::Load(text);
    if (!root.IsMap()) return {std::nullopt, {kExpected}};
    read_map(root, "", parameters, file.problems);
  } catch (const YAML::Exception& error) {
    return {std::nullopt, {std::string{"this is no YAML: "} + error.what()}};
  }
  for (const char* key : {"tls.certificate", "tls.private_key", "auth.token_file"})
    if (!parameters.contains(key)) file.problems.push_back(std::string{key} + " is missing");
  if (!file.problems.empty()) return file;
  if (parameters.contains(std::string{kProxies}))
    parameters["listen.proxy_header"] = std::string{"proxy_protocol"};
  Parsed parsed = parse_config(parameters, Role::kServer, surroundings);
  if (parsed.config && parsed.config->status.beyond_loopback)
    parsed.problems.push_back({"status.listen", to_text(parameters.at("status.listen")),
                               "an address of the loopback, as 127.0.0.1:9091: a relay has no "
                               "tokens for who may look"});
  for (const Problem& problem : parsed.problems) file.problems.push_back(to_text(problem));
  if (file.problems.empty()) file.config = std::move(parsed.config);
  return file;
}

}  // namespace connect_bridge
