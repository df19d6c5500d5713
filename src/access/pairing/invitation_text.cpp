#include "access/pairing/invitation_text.hpp"

#include "access/login/authenticator.hpp"
#include "access/login/token_file.hpp"

namespace connect_bridge {

std::string invitation_text(Invitation invitation, std::uint16_t port) {
  constexpr std::size_t kBegin = sizeof("wss://") - 1;
  const auto slash = invitation.url.find('/', kBegin);
  const std::string authority = invitation.url.substr(kBegin, slash - kBegin);
  const auto bracket = authority.find(']');
  const auto colon = authority.find(':', bracket == std::string::npos ? 0 : bracket);
  const std::string listening = ":" + std::to_string(port);
  const bool by_relay = authority.find('@') != std::string::npos;
  if (colon == std::string::npos && !by_relay) invitation.url.insert(slash, listening);
  const bool drives = invitation.invites_robot;
  std::string text = std::string{"\nTo pair a "} + (drives ? "robot" : "client") +
                     ", run this on its machine within " + std::to_string(kPairingTime.count()) +
                     " minutes. It works once:\n\n  ros2 run connect_bridge client " +
                     (drives ? "--robot '" : "'") + to_text(invitation) + "'\n\n";
  if (drives)
    text +=
        "Add --operate after --robot, and this end may also publish, call services, send goals "
        "and set parameters there: as much as a shell on the robot.\n\n";
  if (!by_relay && colon != std::string::npos && authority.substr(colon) != listening)
    text += "The " + std::string{drives ? "robot" : "client"} + " connects to " + authority +
            ", and this server listens on port " + std::to_string(port) +
            ": a router or proxy must forward from there to here.\n\n";
  return text;
}

std::string invitation_to_print(const Invitation& invitation, std::uint16_t port, bool terminal,
                                const std::string& file, std::string& problem) {
  std::string wrong;
  std::string text =
      secret_to_print(invitation_text(invitation, port), "The invitation", terminal, file, wrong);
  if (!wrong.empty()) problem = "--pair: the invitation cannot be written: " + wrong;
  return text;
}

}  // namespace connect_bridge
