// What only a look at this machine shows of a configuration: TLS files that do not fit together,
// and files that cannot be written. For `ctl check`, and for the start, which then tells everything
// at once.
#pragma once

#include <string>
#include <vector>

#include "config/config.hpp"
#include "core/base/parameter.hpp"
#include "core/ports/failure.hpp"

namespace connect_bridge {

template <class T>
void append(std::vector<T>& to, const std::vector<T>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

struct HostFindings {
  std::vector<Failure> problems;      // a program does not start with these
  std::vector<Failure> ended;         // it starts with certificates that peers refuse by now
  std::vector<std::string> warnings;  // it starts, and lacks something
};

// By the parameters as they were given, so that it finds the same when others of them are wrong.
// Files that cannot be read are left to parse_config(). Nothing is written or created.
[[nodiscard]] HostFindings check_host(const ParameterMap& given);

// Who else may change one of these files, which were just read for the rules of `config`, as a
// sentence with the cure; empty: nobody, or that is not asked (strict_modes).
[[nodiscard]] std::string who_may_change_rules(const Config& config,
                                               const std::vector<std::string>& files);

// Which of these files, all regular ones before, is none any longer: to read a pipe could take
// without end. Empty: none, or that is not asked (strict_modes).
[[nodiscard]] std::string no_longer_regular(const Config& config,
                                            const std::vector<std::string>& files);

// Why this program cannot read a file: it is missing, or not permitted, with whom it belongs to;
// always with the whole path that was tried. Nothing: it can.
[[nodiscard]] Failure why_unreadable(const std::string& file);

}  // namespace connect_bridge
