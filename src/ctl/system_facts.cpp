#include "ctl/system_facts.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <thread>
#include <vector>

#include "ops/doctor/diagnosis.hpp"

namespace connect_bridge {
namespace {

constexpr const char* kSettings[] = {
    "net/core/rmem_max",
    "net/core/rmem_default",
    "net/core/wmem_max",
    "net/core/default_qdisc",
    "net/core/netdev_max_backlog",
    "net/ipv4/ipfrag_high_thresh",
    "net/ipv4/ipfrag_time",
    "net/ipv4/tcp_rmem",
    "net/ipv4/tcp_wmem",
    "net/ipv4/tcp_congestion_control",
    "net/ipv4/tcp_available_congestion_control",
    "net/ipv4/tcp_mtu_probing",
    "net/ipv4/tcp_slow_start_after_idle",
    "kernel/shmmax",
    "vm/overcommit_memory",
};

// The variable with the token (CONNECT_BRIDGE_TOKEN) is not in this list.
constexpr const char* kVariables[] = {
    "ROS_DISTRO",
    "ROS_VERSION",
    "RMW_IMPLEMENTATION",
    "ROS_DOMAIN_ID",
    "ROS_LOCALHOST_ONLY",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_STATIC_PEERS",
    "ROS_DISCOVERY_SERVER",
    "FASTRTPS_DEFAULT_PROFILES_FILE",
    "FASTDDS_DEFAULT_PROFILES_FILE",
    "FASTDDS_BUILTIN_TRANSPORTS",
    "RMW_FASTRTPS_USE_QOS_FROM_XML",
    "CYCLONEDDS_URI",
    "ZENOH_ROUTER_CONFIG_URI",
    "ZENOH_SESSION_CONFIG_URI",
};

std::string first_line(const std::filesystem::path& file, std::string_view that_begins = "") {
  std::ifstream in(file);
  std::string line;
  while (std::getline(in, line))
    if (line.starts_with(that_begins))
      return line.substr(std::min(line.find_first_not_of(" \t", that_begins.size()), line.size()));
  return {};
}

std::string fact(std::string_view name, std::string_view value) {
  return fmt::format("{}: {}\n", name, value.empty() ? "(not known)" : value);
}

// The line of a variable; "(set, inline)" in place of a configuration.
std::string of_variable(const std::string& name) {
  const char* const given = std::getenv(name.c_str());
  const std::string_view value = given != nullptr ? given : "(not set)";
  return fact(name, holds_configuration(value) ? "(set, inline)" : value);
}

std::string of_limit(const char* name, int which) {
  rlimit limit{};
  if (::getrlimit(static_cast<__rlimit_resource>(which), &limit) != 0) return fact(name, "");
  return fact(name, limit.rlim_cur == RLIM_INFINITY ? "unlimited" : std::to_string(limit.rlim_cur));
}

std::string of_interfaces() {
  std::vector<std::filesystem::path> folders;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator("/sys/class/net", none))
    folders.push_back(entry.path());
  std::sort(folders.begin(), folders.end());
  std::string text;
  for (const auto& folder : folders)
    text += fact(
        "interface " + folder.filename().string(),
        fmt::format("mtu {}, {}{}", first_line(folder / "mtu"), first_line(folder / "operstate"),
                    std::filesystem::exists(folder / "wireless", none) ? ", wireless" : ""));
  return text;
}

std::string of_shared_memory() {
  struct statvfs shm {};
  if (::statvfs("/dev/shm", &shm) != 0) return fact("/dev/shm", "");
  return fact("/dev/shm", fmt::format("{} MB, {} MB free", shm.f_blocks * shm.f_frsize >> 20,
                                      shm.f_bavail * shm.f_frsize >> 20));
}

std::string of_clock() {
  timex clock{};
  const int state = ::adjtimex(&clock);
  return fact("system clock", state == -1                   ? ""
                              : (clock.status & STA_UNSYNC) ? "not synchronized"
                                                            : "synchronized");
}

}  // namespace

std::string system_facts() {
  utsname kernel{};
  ::uname(&kernel);
  std::string text =
      fact("kernel", fmt::format("{} {} {}", kernel.sysname, kernel.release, kernel.machine));
  text += fact("system", first_line("/etc/os-release", "PRETTY_NAME="));
  text += fact("processors", std::to_string(std::thread::hardware_concurrency()));
  text += fact("memory", first_line("/proc/meminfo", "MemTotal:"));
  text += fact("memory available", first_line("/proc/meminfo", "MemAvailable:"));
  text += fact("load", first_line("/proc/loadavg"));
  text += fact("cgroup memory limit", first_line("/sys/fs/cgroup/memory.max"));
  text += of_clock() + of_shared_memory();
  text += of_limit("open files", RLIMIT_NOFILE) + of_limit("locked memory", RLIMIT_MEMLOCK);
  text += fact("user", ::geteuid() == 0 ? "root" : "not root");
  for (const char* setting : kSettings)
    text += fact(setting, first_line(std::filesystem::path("/proc/sys") / setting));
  text += of_interfaces();
  for (const char* name : kVariables) text += of_variable(name);
  return text;
}

}  // namespace connect_bridge
