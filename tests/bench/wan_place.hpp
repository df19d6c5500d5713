// A place at one end of the network: a network namespace with a loopback device, a TAP device whose
// frames this process carries, and a /dev/shm of its own, because two machines share no memory.
#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <net/route.h>
#include <sched.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <string>

namespace bench {

inline void must(bool done, const char* what) {
  if (!done) throw std::runtime_error(std::string(what) + ": " + std::strerror(errno));
}

inline void name_device(ifreq& request, const char* device) {
  std::snprintf(request.ifr_name, sizeof request.ifr_name, "%s", device);
}

inline void up(int socket, const char* device) {
  ifreq request{};
  name_device(request, device);
  must(ioctl(socket, SIOCGIFFLAGS, &request) == 0, "flags of the device");
  request.ifr_flags = static_cast<short>(request.ifr_flags | IFF_UP | IFF_MULTICAST);
  must(ioctl(socket, SIOCSIFFLAGS, &request) == 0, "device up");
}

inline sockaddr address_of(const char* text) {
  sockaddr_in in{};
  in.sin_family = AF_INET;
  inet_pton(AF_INET, text, &in.sin_addr);
  sockaddr any{};
  std::memcpy(&any, &in, sizeof any);
  return any;
}

inline void address(int socket, const char* device, const char* text) {
  ifreq request{};
  name_device(request, device);
  request.ifr_addr = address_of(text);
  must(ioctl(socket, SIOCSIFADDR, &request) == 0, "address");
  request.ifr_netmask = address_of("255.255.255.0");
  must(ioctl(socket, SIOCSIFNETMASK, &request) == 0, "netmask");
}

// ROS discovers the nodes of its machine by multicast over the loopback device.
inline void multicast_by_loopback(int socket) {
  rtentry route{};
  char device[] = "lo";
  route.rt_dst = address_of("224.0.0.0");
  route.rt_genmask = address_of("240.0.0.0");
  route.rt_flags = RTF_UP;
  route.rt_dev = device;
  must(ioctl(socket, SIOCADDRT, &route) == 0, "route for multicast");
}

// In the new namespaces; gives the TAP device.
inline int furnish(const char* address_text) {
  must(unshare(CLONE_NEWNET | CLONE_NEWNS) == 0, "a network namespace");
  must(mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0, "mounts of its own");
  must(mount("none", "/dev/shm", "tmpfs", 0, nullptr) == 0, "a /dev/shm of its own");
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  must(socket >= 0, "socket");
  const int tap = open("/dev/net/tun", O_RDWR | O_NONBLOCK | O_CLOEXEC);
  must(tap >= 0, "/dev/net/tun");
  ifreq request{};
  name_device(request, "wan0");
  request.ifr_flags = IFF_TAP | IFF_NO_PI;
  must(ioctl(tap, TUNSETIFF, &request) == 0, "TAP device");
  up(socket, "lo");
  multicast_by_loopback(socket);
  address(socket, "wan0", address_text);
  up(socket, "wan0");
  close(socket);
  return tap;
}

// One message between the processes: bytes, and room for a device.
struct Letter {
  explicit Letter(std::size_t bytes) : text(bytes, '\0'), data{text.data(), text.size()} {
    message.msg_iov = &data;
    message.msg_iovlen = 1;
    message.msg_control = room;
    message.msg_controllen = sizeof room;
  }
  std::string text;
  iovec data;
  alignas(cmsghdr) char room[CMSG_SPACE(sizeof(int))] = {};
  msghdr message{};
};

inline void send_device(int to, int device) {
  Letter letter(1);
  cmsghdr* header = CMSG_FIRSTHDR(&letter.message);
  header->cmsg_level = SOL_SOCKET;
  header->cmsg_type = SCM_RIGHTS;
  header->cmsg_len = CMSG_LEN(sizeof(int));
  std::memcpy(CMSG_DATA(header), &device, sizeof device);
  must(sendmsg(to, &letter.message, 0) == 1, "to send the device");
}

// Without a device the message says why.
inline int receive_device(int from) {
  Letter letter(256);
  const auto n = recvmsg(from, &letter.message, MSG_CMSG_CLOEXEC);
  const cmsghdr* header = CMSG_FIRSTHDR(&letter.message);
  if (n <= 0 || header == nullptr)
    throw std::runtime_error(n > 0 ? letter.text.c_str() : "no answer");
  int device = -1;
  std::memcpy(&device, CMSG_DATA(header), sizeof device);
  return device;
}

// The namespaces live as long as the process that made them, which ends with this one.
class Place {
 public:
  // Throws if the machine forbids namespaces or has no TAP devices.
  explicit Place(const char* address) {
    int pair[2];
    must(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair) == 0, "socket pair");
    pid_ = fork();
    must(pid_ >= 0, "fork");
    if (pid_ == 0) hold(pair[1], address);
    close(pair[1]);
    try {
      device_ = receive_device(pair[0]);
    } catch (...) {
      close(pair[0]);
      end();
      throw;
    }
    close(pair[0]);
  }
  ~Place() {
    if (device_ >= 0) close(device_);
    end();
  }
  Place(const Place&) = delete;
  Place& operator=(const Place&) = delete;

  [[nodiscard]] int device() const { return device_; }
  [[nodiscard]] pid_t pid() const { return pid_; }

 private:
  [[noreturn]] static void hold(int to, const char* address) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    try {
      send_device(to, furnish(address));
    } catch (const std::exception& e) {
      (void)!write(to, e.what(), std::strlen(e.what()));
      _exit(1);
    }
    for (;;) pause();
  }
  void end() {
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }

  pid_t pid_ = -1;
  int device_ = -1;
};

}  // namespace bench
