#include "access/pairing/pairing_folder.hpp"

#include <fcntl.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "access/login/credential.hpp"
#include "access/login/file_trust.hpp"
#include "access/login/token_file.hpp"
#include "core/base/hex.hpp"
#include "core/base/json.hpp"
#include "core/base/sha256.hpp"
#include "ros/parameters/parameter_file.hpp"

namespace connect_bridge {
namespace {

// The folder of "/robot1/connect_client" is "robot1.connect_client".
std::string folder_name(const std::string& node) {
  std::string name = node.substr(node.starts_with('/') ? 1 : 0);
  std::replace(name.begin(), name.end(), '/', '.');
  return name;
}

struct flock whole_file(short kind) {
  struct flock lock {};
  lock.l_type = kind;
  lock.l_whence = SEEK_SET;
  return lock;
}

bool is_rule(const std::string& key) {
  return key == "rules" || key.starts_with("rule.");
}

}  // namespace

std::string ros_home() {
  const char* home = std::getenv("ROS_HOME");
  if (home && *home) return home;
  home = std::getenv("HOME");
  const passwd* const user = home && *home ? nullptr : ::getpwuid(::geteuid());
  return std::string{user ? user->pw_dir : home ? home : ""} + "/.ros";
}

// The kernel releases the lock when the process exits, for whatever reason; the file's content
// stays.
RunningMark::RunningMark(const std::string& file, std::uint16_t port)
    : handle_(::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600)) {
  struct flock lock = whole_file(F_WRLCK);
  if (handle_ < 0 || ::fcntl(handle_, F_OFD_SETLK, &lock) != 0) return;
  std::ofstream(file) << ::getpid() << " " << port << "\n";
}

RunningMark::~RunningMark() {
  if (handle_ >= 0) ::close(handle_);
}

PairingFolder::PairingFolder(const std::string& node, bool strict)
    : path_(ros_home() + "/connect_bridge/" + folder_name(node)), strict_(strict) {}

std::string PairingFolder::distrusted(const std::string& file) const {
  return strict_ ? who_else_may_change(file) : std::string{};
}

bool PairingFolder::has(const std::string& name) const {
  return ::access(file(name).c_str(), F_OK) == 0;
}

std::optional<RunningServer> PairingFolder::running() const {
  const int handle = ::open(running_file().c_str(), O_RDONLY | O_CLOEXEC);
  if (handle < 0) return std::nullopt;
  // The lock is queried, not taken: a server that starts just now would find it taken.
  struct flock lock = whole_file(F_RDLCK);
  const bool held = ::fcntl(handle, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
  ::close(handle);
  RunningServer server;
  if (held && std::ifstream(running_file()) >> server.process >> server.port) return server;
  return std::nullopt;
}

std::string PairingFolder::token_file(const std::string& kind, const std::string& code) const {
  constexpr std::size_t kDigits = 16;
  return file(kind + "-" + to_hex(sha256(view_of(code))).substr(0, kDigits));
}

void PairingFolder::remove_former(const std::string& kind, const std::string& former,
                                  const std::string& now) const {
  if (former.starts_with(file(kind + "-")) && former != now) ::unlink(former.c_str());
}

std::string PairingFolder::other_kind(const ParameterMap& stored, Role robot) const {
  const Role before = string_at(stored, "robot") == "client" ? Role::kClient : Role::kServer;
  if (stored.empty() || before == robot) return {};
  return "the pairing in " + path_ + " is one where the robot is the " +
         (before == Role::kClient ? "client" : "server") + ": " + kOwnName +
         ", or remove that folder";
}

std::string PairingFolder::make() const {
  for (std::size_t end = path_.find('/', 1);; end = path_.find('/', end + 1)) {
    const std::string part = path_.substr(0, end);
    if (::mkdir(part.c_str(), 0700) != 0 && errno != EEXIST)
      return "the folder " + part + " cannot be made: " + std::strerror(errno) +
             " (the pairing needs a folder that stays: set HOME or ROS_HOME to one that this user "
             "may write, in a container a volume)";
    // Another user may have made the folder before.
    if (end == std::string::npos) return distrusted(path_);
  }
}

ParameterMap PairingFolder::parameters(std::string& problem) const {
  if (!has("params.yaml")) return {};
  problem = distrusted(parameter_file());
  if (!problem.empty()) return {};
  ros::ParameterFile read = ros::read_parameter_file(parameter_file());
  problem = read.problem();
  ParameterMap parameters;
  for (const auto& section : read.sections)
    for (const auto& [key, value] : section.parameters) parameters.insert_or_assign(key, value);
  return parameters;
}

std::string PairingFolder::other_client(const std::string& prefix) const {
  std::error_code none;
  const auto all = std::filesystem::path(path_).parent_path();
  for (const auto& entry : std::filesystem::directory_iterator(all, none)) {
    PairingFolder other = *this;
    other.path_ = entry.path();
    std::string unread;
    const ParameterMap its = other.parameters(unread);
    if (other.path_ != path_ && its.contains("url") && string_at(its, "robot") != "client" &&
        string_at(its, "prefix") == prefix)
      return other.path_;
  }
  return {};
}

std::string PairingFolder::write_parameters(const ParameterMap& parameters) const {
  std::string text = "# Made by pairing; yours to change.\n/**:\n  ros__parameters:";
  // JSON is valid YAML, whatever a text contains.
  for (const auto& [key, value] : parameters)
    text += "\n    " + key + ": " +
            std::visit([](const auto& held) { return Json(held).dump(); }, value);
  return write_secret_file(parameter_file(), text + "\n");
}

bool goes_by_pairing(const ParameterMap& given) {
  if (const char* token = std::getenv(kTokenVariable); token && *token) return false;
  return std::none_of(given.begin(), given.end(), [](const auto& entry) {
    return entry.first == "url" || entry.first.starts_with("auth.") ||
           entry.first.starts_with("tls.");
  });
}

ParameterMap filled(const ParameterMap& given, const ParameterMap& stored) {
  ParameterMap all = given;
  const bool has_rules = std::any_of(given.begin(), given.end(),
                                     [](const auto& entry) { return is_rule(entry.first); });
  for (const auto& entry : stored)
    if (!has_rules || !is_rule(entry.first)) all.insert(entry);
  return all;
}

}  // namespace connect_bridge
