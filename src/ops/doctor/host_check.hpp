// Problems of a configuration that only this machine shows: TLS files that do not fit together, and
// files that cannot be written. `ctl check` asks for them, and so does the start, to report
// everything at once.
#pragma once

#include <cstdint>
#include <optional>
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
  std::vector<Failure> problems;  // a program does not start with these
  std::vector<Failure> ended;     // it starts with certificates that peers refuse by now
  std::vector<Failure> warnings;  // it starts, and lacks something
  std::vector<Failure> hints;     // it starts, and logs a line
};

// By the parameters as they were given, so that it finds the same when others of them are wrong.
// Files that cannot be read are left to parse_config(). Nothing is written or created.
[[nodiscard]] HostFindings check_host(const ParameterMap& given);

// The sentence, with the cure, about who else may change one of these files. The rules of `config`
// were just read from them. Empty: nobody may, or strict_modes is off.
[[nodiscard]] std::string who_may_change_rules(const Config& config,
                                               const std::vector<std::string>& files);

// The sentence about one of these files, all regular ones before, that is none any longer: to read
// a pipe could take without end. Empty: there is none, or strict_modes is off.
[[nodiscard]] std::string no_longer_regular(const Config& config,
                                            const std::vector<std::string>& files);

// Why this program cannot read a file: it is missing, or not permitted, with whom it belongs to;
// always with the whole path that was tried. Nothing: it can.
[[nodiscard]] Failure why_unreadable(const std::string& file);

// Why no server can listen there; nothing: one can. Nobody is accepted, and the port is free again.
[[nodiscard]] Failure why_not_listening(const ListenOptions& listen);

// Why nobody can reach a server that listens at this address; nothing: an interface has it. A
// server may listen at an address that comes later.
[[nodiscard]] Failure why_not_reached(const std::string& address);

// The user of who listens at the port, by tables as /proc/net/tcp; nullopt: nobody does.
[[nodiscard]] std::optional<std::uint32_t> listener_at(std::uint16_t port,
                                                       const std::vector<std::string>& tables = {
                                                           "/proc/net/tcp", "/proc/net/tcp6"});

}  // namespace connect_bridge
