#include "auth/file_trust.hpp"

#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <set>
#include <system_error>

namespace connect_bridge {
namespace {

constexpr std::size_t kEntryBytes = 16 << 10;

std::string user_name(uid_t user) {
  std::array<char, kEntryBytes> buffer{};
  passwd entry{};
  passwd* found = nullptr;
  const bool known = ::getpwuid_r(user, &entry, buffer.data(), buffer.size(), &found) == 0 && found;
  return known ? entry.pw_name : std::to_string(user);
}

// Where each user has a group of the same name, a umask lets the group write. Others could have it
// as their first group, which only a look at all users would show: who gives a user the group of
// another one's name means it.
bool is_private_group(gid_t group, uid_t owner) {
  std::array<char, kEntryBytes> buffer{};
  ::group entry{};
  ::group* found = nullptr;
  if (::getgrgid_r(group, &entry, buffer.data(), buffer.size(), &found) != 0 || !found)
    return false;
  const std::string name = user_name(owner);
  if (name != entry.gr_name) return false;
  for (char** member = entry.gr_mem; *member; ++member)
    if (name != *member) return false;
  return true;
}

std::string why_not_trusted(const std::filesystem::path& path) {
  struct stat facts {};
  if (::stat(path.c_str(), &facts) != 0) return {};
  const bool is_folder = S_ISDIR(facts.st_mode);
  const std::string what = (is_folder ? "the folder " : "") + path.string();
  const uid_t user = ::geteuid();
  if (facts.st_uid != 0 && facts.st_uid != user)  // mutant: foreign_owner
    return fmt::format("{} belongs to the user {} (chown it to {})", what, user_name(facts.st_uid),
                       user_name(user));
  if (is_folder && (facts.st_mode & S_ISVTX) != 0) return {};
  if ((facts.st_mode & S_IWOTH) != 0)
    return fmt::format("every user of this machine may change {} (chmod go-w)", what);
  if ((facts.st_mode & S_IWGRP) != 0 && !is_private_group(facts.st_gid, facts.st_uid))
    return fmt::format("a group of users may change {} (chmod g-w)", what);  // mutant: group_writes
  return {};
}

}  // namespace

std::string who_else_may_change(const std::string& file) {
  std::error_code failed;
  const std::filesystem::path given = std::filesystem::absolute(file, failed);
  const std::filesystem::path real = std::filesystem::canonical(given, failed);
  std::set<std::filesystem::path> looked_at;
  for (const auto& path : {given, real}) {
    std::filesystem::path part;
    for (const auto& name : path) {
      part /= name;
      if (!looked_at.insert(part).second) continue;
      if (std::string why = why_not_trusted(part); !why.empty()) return why;
    }
  }
  return {};
}

}  // namespace connect_bridge
