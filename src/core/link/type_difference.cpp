#include "core/link/type_difference.hpp"

#include "core/wire/text.hpp"

namespace connect_bridge {
void log_difference(Outputs& outputs, const Link& link, const TypeDifference& difference) {
  const std::string& type = difference.type;
  const std::string key = difference.used ? "type_mismatch_used " : "type_mismatch ";
  if (!link.account->told.first(key + type + " " + difference.hash_there)) return;
  const std::string text = difference.what + ": the definition of " + type + " here (" +
                           shown_hash(difference.hash_here) + ") is not that of " + link.label() +
                           " (" + shown_hash(difference.hash_there) + "). ";
  if (difference.used)
    return outputs.log(LogLevel::kWarn,
                       text + "Messages that do not fit the definition here are dropped");
  outputs.log(LogLevel::kError, "cannot mirror " + text + "Install the same version of " +
                                    type.substr(0, type.find('/')) +
                                    " on both sides, or set allow_type_mismatch in the rule");
}

}  // namespace connect_bridge
