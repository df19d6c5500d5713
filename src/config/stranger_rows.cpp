#include "config/stranger_rows.hpp"

#include <string>
#include <utility>

namespace connect_bridge {

// All of these are counted in the status, and told to the log when they are reached.
void add_stranger_rows(std::vector<KeySpec>& rows, const SideOptions& core) {
  constexpr Duration minute = std::chrono::minutes(1);
  const auto add_row = section_adder(rows, "Limits before login");
  const auto add = [&](std::string key, std::int64_t fallback, double min, double max,
                       std::string help) {
    add_row({.key = std::move(key),
             .fallback = fallback,
             .range = NumberRange{min, max},
             .used_by = UsedBy::kServer,
             .help = std::move(help)});
  };
  add("limits.strangers_max", core.strangers_max, 8, 1000,
      "Connections without a login. The oldest gives way to one more. When half of them are there "
      "a login must be shown within a second.");
  add("limits.address_strangers_max", 16, 1, 10'000,
      "The same of one address. An address of the loopback, where a proxy mostly is, has 8 times "
      "as many, and 8 times what the other limits here give to an address.");
  add("limits.handshakes_per_second", 50, 1, 100'000,
      "TLS handshakes that begin. What 3 seconds allow begins at once, what is beyond waits, and "
      "those who wait take turns.");
  add("limits.address_handshakes_per_second", 10, 1, 100'000,
      "The same of one address, and twice that of the first 56 bits of an IPv6 address; what is "
      "beyond is dropped. What 3 seconds allow begins at once.");
  add("limits.wrong_logins_per_minute", core.wrong_logins_at_once, 1, 1'000'000,
      "Wrong logins that are answered at once; what is beyond is answered 3 seconds later. A right "
      "login is never counted, and let in at once.");
  add("limits.address_wrong_logins_per_minute", core.address_wrong_logins_at_once, 1, 1'000'000,
      "The same of one address.");
  add("limits.offences_per_minute", minute / core.account.offence_period, 1, 1'000'000,
      "Links of one identity that are ended for what no peer may do (4002, 4006, 4009, 4010). " +
          std::to_string(core.account.offences_at_once) +
          " at once; then its next login waits, or is refused, for a minute at the most. A link "
          "that has not offended goes on after a break all the same.");
}

}  // namespace connect_bridge
