#include "net/tcp/route.hpp"

#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "core/base/bytes.hpp"
#include "core/base/hex.hpp"

namespace connect_bridge {
namespace {

struct Descriptor {
  explicit Descriptor(int descriptor) : fd(descriptor) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
  const int fd;
};

struct Question {
  nlmsghdr header{};
  rtmsg route{};
  rtattr attribute{};
  std::array<unsigned char, 16> to{};
};

Question question_of(const boost::asio::ip::address& to) {
  Question question;
  const std::size_t bytes = to.is_v4() ? 4 : 16;
  if (to.is_v4()) {
    const auto raw = to.to_v4().to_bytes();
    std::copy(raw.begin(), raw.end(), question.to.begin());
  } else {
    const auto raw = to.to_v6().to_bytes();
    std::copy(raw.begin(), raw.end(), question.to.begin());
  }
  question.header.nlmsg_len = static_cast<std::uint32_t>(sizeof question - 16 + bytes);
  question.header.nlmsg_type = RTM_GETROUTE;
  question.header.nlmsg_flags = NLM_F_REQUEST;
  question.route.rtm_family = to.is_v4() ? AF_INET : AF_INET6;
  question.route.rtm_dst_len = static_cast<unsigned char>(8 * bytes);
  question.attribute.rta_type = RTA_DST;
  question.attribute.rta_len = static_cast<unsigned short>(RTA_LENGTH(bytes));
  return question;
}

// An interface's name, and whether packets can leave there: "eth0 up".
std::string state_of(unsigned int index) {
  ifreq request{};
  const Descriptor any(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (any.fd < 0 || if_indextoname(index, request.ifr_name) == nullptr) return "?";
  const std::string name = request.ifr_name;
  if (::ioctl(any.fd, SIOCGIFFLAGS, &request) != 0) return name + " ?";
  const bool up = (request.ifr_flags & IFF_UP) != 0 && (request.ifr_flags & IFF_RUNNING) != 0;
  return name + (up ? " up" : " down");
}

// The text of an attribute that decides where packets go; empty for others, as the age of a cache.
std::string text_of(const rtattr& attribute) {
  const ByteView value(static_cast<const std::uint8_t*>(RTA_DATA(&attribute)),
                       RTA_PAYLOAD(&attribute));
  if (attribute.rta_type == RTA_OIF && value.size() == sizeof(unsigned int)) {
    unsigned int index = 0;
    std::memcpy(&index, value.data(), sizeof index);
    return state_of(index);
  }
  if (attribute.rta_type == RTA_GATEWAY || attribute.rta_type == RTA_VIA)
    return " by " + to_hex(value);
  if (attribute.rta_type == RTA_PREFSRC) return " from " + to_hex(value);
  return {};
}

}  // namespace

std::string route_to(const boost::asio::ip::address& to) {
  const Descriptor netlink(
      ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, NETLINK_ROUTE));
  const Question question = question_of(to);
  if (netlink.fd < 0 || ::send(netlink.fd, &question, question.header.nlmsg_len, 0) < 0) return {};
  // The kernel has answered when send() returns.
  alignas(nlmsghdr) std::array<char, 4096> buffer{};
  const auto size = ::recv(netlink.fd, buffer.data(), buffer.size(), 0);
  const auto* header = reinterpret_cast<const nlmsghdr*>(buffer.data());
  if (size <= 0 || !NLMSG_OK(header, static_cast<std::uint32_t>(size))) return {};
  if (header->nlmsg_type != RTM_NEWROUTE) return {};
  std::string route;
  const auto* message = static_cast<const rtmsg*>(NLMSG_DATA(header));
  auto left = static_cast<int>(RTM_PAYLOAD(header));
  for (const rtattr* one = RTM_RTA(message); RTA_OK(one, left); one = RTA_NEXT(one, left))
    route += text_of(*one);
  return route;
}

}  // namespace connect_bridge
