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
#include <fstream>
#include <string_view>
#include <utility>

#include "access/login/file_trust.hpp"

namespace connect_bridge {
namespace {

constexpr char kSocketEnd[] = ".status";
constexpr std::size_t kShownMax = 4;  // of sockets elsewhere

std::vector<std::string> possible_runtime_folders() {
  const std::string user = std::to_string(::geteuid());
  std::vector<std::string> folders;
  if (const char* const given = std::getenv("RUNTIME_DIRECTORY"); given && *given)
    folders.push_back(std::string{given}.substr(0, std::string_view{given}.find(':')));
  const std::string usual = "/run/user/" + user;
  if (const char* const given = std::getenv("XDG_RUNTIME_DIR"); given && *given && usual != given)
    folders.push_back(std::string{given} + "/connect_bridge");
  folders.push_back(usual + "/connect_bridge");
  folders.push_back("/tmp/connect_bridge-" + user);
  return folders;
}

// "FOLDER/connect_server-17.status", as status_socket() names it.
bool is_status_socket(std::string_view file) {
  if (!file.ends_with(kSocketEnd)) return false;
  file.remove_suffix(sizeof kSocketEnd - 1);
  const std::size_t dash = file.rfind('-');
  return dash != std::string_view::npos && dash + 1 < file.size() &&
         file.find_first_not_of("0123456789", dash + 1) == std::string_view::npos;
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

std::vector<std::string> folders_of_units(const std::string& run) {
  std::error_code none;
  std::vector<std::string> folders;
  for (const auto& entry : std::filesystem::directory_iterator(run, none)) {
    struct stat found {};
    const std::string folder = entry.path();
    if (::lstat(folder.c_str(), &found) == 0 && S_ISDIR(found.st_mode) &&
        (found.st_mode & S_IWOTH) == 0)
      folders.push_back(folder);
  }
  return folders;
}

std::vector<std::string> status_sockets(const std::string& run) {
  std::error_code none;
  std::vector<std::string> folders;
  // Another user could answer in a folder that he may change.
  for (const std::string& folder : possible_runtime_folders())
    if (who_else_may_change(folder).empty()) folders.push_back(folder);
  const std::size_t own = folders.size();
  for (std::string& folder : folders_of_units(run)) folders.push_back(std::move(folder));
  std::vector<std::string> found;
  for (std::size_t i = 0; i < folders.size(); ++i) {
    for (const auto& entry : std::filesystem::directory_iterator(folders[i], none)) {
      const std::string file = entry.path();
      if (!is_status_socket(file) ||
          entry.symlink_status(none).type() != std::filesystem::file_type::socket)
        continue;
      // A unit of another user says nothing here, however well it runs.
      if (i >= own && ::access(file.c_str(), W_OK) != 0) continue;
      if (is_left_over(file)) {
        if (i < own) ::unlink(file.c_str());  // the others are the system's
      } else if (std::find(found.begin(), found.end(), file) == found.end()) {
        found.push_back(file);
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::string where_sockets_are(const std::string& bound) {
  const std::vector<std::string> folders = possible_runtime_folders();
  std::string looked, elsewhere;
  for (const std::string& folder : folders) looked += folder + ", ";
  std::ifstream table(bound);
  std::size_t count = 0;
  for (std::string line; std::getline(table, line);) {
    const std::string file = line.substr(std::min(line.find('/'), line.size()));
    const std::string folder = file.substr(0, file.rfind('/'));
    if (!is_status_socket(file) ||
        std::find(folders.begin(), folders.end(), folder) != folders.end())
      continue;
    if (++count <= kShownMax) elsewhere += (count > 1 ? ", " : "") + file;
  }
  return "looked in " + looked + "and in those of units below /run" +
         (count > 0 ? "; elsewhere there " + std::string(count > 1 ? "are " : "is ") + elsewhere +
                          (count > kShownMax ? ", ..." : "")
                    : "");
}

}  // namespace connect_bridge
