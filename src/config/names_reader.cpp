#include "config/names_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "config/syntax.hpp"

namespace connect_bridge {

void read_peer_names(const CheckedValues& values, Config& config, std::vector<Problem>& problems) {
  const auto add = [&](const char* key, std::string value, std::string expected) {
    problems.push_back({key, std::move(value), std::move(expected)});
  };
  std::set<std::string> wires;
  std::set<std::string> locals;
  for (const std::string& text : values.list("remap")) {
    const auto pair = syntax::parse_remap(text);
    if (!pair) continue;
    if (!wires.insert(pair->wire).second)
      add("remap", to_text(text), fmt::format("{} to be remapped once only", pair->wire));
    if (!locals.insert(pair->local).second)
      add("remap", to_text(text), fmt::format("{} to be the target once only", pair->local));
    config.remap.push_back(*pair);
  }
  for (const std::string& text : values.list("identity_names")) {
    const auto name = syntax::parse_identity_name(text);
    if (!name) continue;
    const bool taken = std::any_of(config.identity_names.begin(), config.identity_names.end(),
                                   [&](const auto& other) { return other.second == name->second; });
    if (taken || !config.identity_names.insert(*name).second)
      add("identity_names", to_text(text), "each identity, and each name, once only");
  }
  if (config.prefix != syntax::kByIdentity) {
    if (!config.identity_names.empty())
      add("identity_names", "", "prefix: by_identity too, else it has no effect");
    config.names = NameMap(config.prefix, config.remap);
    return;
  }
  if (config.role == Role::kClient) {
    add("prefix", to_text(config.prefix),
        "a prefix, e.g. /robot1: a client has one peer, without an identity");
  } else if (config.auth.method == "none") {
    add("prefix", to_text(config.prefix), "a login (auth.method), else nobody has a name");
  }
  config.names = PeerNames(config.identity_names, config.remap);
}

}  // namespace connect_bridge
