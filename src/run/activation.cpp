#include "run/activation.hpp"

#include <charconv>
#include <optional>

namespace connect_bridge {
namespace {

constexpr int kFirstSocket = 3;
constexpr int kSocketsMax = 8;

std::optional<int> number(const std::string& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

PassedSockets passed_sockets(int pid, const std::string& sockets_for, const std::string& count) {
  // Sockets of another process (a parent or ancestor) are not ours.
  if (number(sockets_for) != pid)
    return {{}, "listen.address: systemd has passed no socket to this process (LISTEN_PID)"};
  const int sockets = number(count).value_or(0);
  if (sockets < 1 || sockets > kSocketsMax)
    return {{}, "listen.address: systemd must pass 1 to 8 sockets (LISTEN_FDS)"};
  PassedSockets passed;
  for (int i = 0; i < sockets; ++i) passed.sockets.push_back(kFirstSocket + i);
  return passed;
}

}  // namespace connect_bridge
