#include "config/audit_rows.hpp"

#include <string>

#include "config/syntax.hpp"

namespace connect_bridge {

void add_audit_rows(std::vector<KeySpec>& rows) {
  const auto add = section_adder(rows, "Audit log");
  add({.key = "audit.file",
       .syntax = syntax::check_not_empty,
       .help = "File that gets a line of JSON for each login, refusal, lost link, "
               "channel, call, goal and change of rules (docs/security.md). Unset: "
               "there is none."});
  add({.key = "audit.file_bytes_max",
       .fallback = std::int64_t{10 << 20},
       .range = NumberRange{65536, 1024.0 * 1024.0 * 1024.0},
       .unit = "bytes",
       .help = "Then it is renamed, with .1 at its end, and a new one begins."});
  add({.key = "audit.files_kept",
       .fallback = std::int64_t{10},
       .range = NumberRange{0, 1000},
       .unit = "files",
       .help = "Older files that are kept; the oldest goes."});
}

}  // namespace connect_bridge
