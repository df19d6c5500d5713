#include "access/pairing/pairing_rules.hpp"

#include <string>
#include <vector>

namespace connect_bridge {

ParameterMap robot_rules(bool operates) {
  using Texts = std::vector<std::string>;
  ParameterMap all{{"rules", Texts{"look"}},
                   {"rule.look.export_topics", Texts{"/**"}},
                   {"rule.look.deny", Texts{"/rosout"}}};
  if (!operates) return all;
  all["rules"] = Texts{"look", "operate"};
  for (const char* right :
       {"import_topics", "export_services", "export_actions", "export_parameters"})
    all[std::string{"rule.operate."} + right] = Texts{"/**"};
  return all;
}

ParameterMap rules_of(ParameterMap parameters) {
  std::erase_if(parameters, [](const auto& entry) { return !entry.first.starts_with("rule"); });
  return parameters;
}

bool has_own_rules(const ParameterMap& stored) {
  const ParameterMap rules = rules_of(stored);
  return !rules.empty() && rules != robot_rules(false) && rules != robot_rules(true);
}

}  // namespace connect_bridge
