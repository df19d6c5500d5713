#include "access/login/runtime_folder.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "access/login/file_trust.hpp"

namespace connect_bridge {
namespace {

constexpr char kSocketEnd[] = ".status";

std::vector<std::string> possible_runtime_folders() {
  const std::string user = std::to_string(::geteuid());
  std::vector<std::string> folders;
  if (const char* const given = std::getenv("RUNTIME_DIRECTORY"); given && *given)
    folders.push_back(std::string{given}.substr(0, std::string_view{given}.find(':')));
  if (const char* const given = std::getenv("XDG_RUNTIME_DIR"); given && *given)
    folders.push_back(std::string{given} + "/connect_bridge");
  folders.push_back("/run/user/" + user + "/connect_bridge");
  folders.push_back("/tmp/connect_bridge-" + user);
  return folders;
}

// Whether the socket's program has exited: nobody listens.
bool is_left_over(const std::string& socket) {
  boost::asio::io_context io;
  boost::asio::local::stream_protocol::socket asking(io);
  boost::system::error_code error;
  asking.connect({socket}, error);
  return error == boost::asio::error::connection_refused;
}

}  // namespace

std::string make_runtime_folder(std::string& problem) {
  for (const std::string& folder : possible_runtime_folders()) {
    problem.clear();
    if (::mkdir(folder.c_str(), S_IRWXU) != 0 && errno != EEXIST)
      problem = "the folder " + folder + " cannot be made: " + std::strerror(errno);
    else if (::access(folder.c_str(), W_OK) != 0)
      problem = "the folder " + folder + " cannot be written";
    else
      problem = who_else_may_change(folder);
    if (problem.empty()) return folder;
  }
  return {};
}

std::string status_socket(const std::string& folder, const std::string& node) {
  std::string name = node.substr(node.starts_with('/') ? 1 : 0);
  std::replace(name.begin(), name.end(), '/', '.');
  return folder + "/" + name + "-" + std::to_string(::getpid()) + kSocketEnd;
}

std::vector<std::string> status_sockets() {
  std::error_code none;
  std::vector<std::string> folders;
  // Another user could answer in a folder that he may change.
  for (const std::string& folder : possible_runtime_folders())
    if (who_else_may_change(folder).empty()) folders.push_back(folder);
  // Folders of the system's units: root sees all of them, another user sees its own.
  for (const auto& entry : std::filesystem::directory_iterator("/run", none))
    if (entry.path().filename().string().starts_with("connect_bridge"))
      folders.push_back(entry.path());
  std::vector<std::string> found;
  for (const std::string& folder : folders) {
    for (const auto& entry : std::filesystem::directory_iterator(folder, none)) {
      const std::string file = entry.path();
      if (!file.ends_with(kSocketEnd) ||
          entry.symlink_status(none).type() != std::filesystem::file_type::socket)
        continue;
      if (is_left_over(file)) {
        ::unlink(file.c_str());
      } else if (std::find(found.begin(), found.end(), file) == found.end()) {
        found.push_back(file);
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace connect_bridge
