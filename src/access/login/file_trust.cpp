#include "access/login/file_trust.hpp"

#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <iterator>
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

// Systems that give each user a group of the same name have a umask that lets the group write.
// Another user could have it as the first group, which only a search of all users would show. An
// administrator who gives a user the group of another one's name means it.
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

// Whether an entry of the file's access control list lets a further user or group write. The group
// bits of the mode are the mask of all entries: nobody of the list writes without them.
// The list is a version of 4 bytes, then entries of 8: tag, rights, id (linux/posix_acl_xattr.h).
bool others_may_write(const std::filesystem::path& path, uid_t owner) {
  constexpr std::size_t kHead = 4, kEntry = 8, kListBytes = 16 << 10;
  constexpr std::uint64_t kUser = 2, kGroup = 8, kMayWrite = 2;
  std::array<std::uint8_t, kListBytes> list{};
  const ssize_t size =
      ::getxattr(path.c_str(), "system.posix_acl_access", list.data(), list.size());
  if (size < 0) return errno == ERANGE;  // so many entries that they are not judged
  for (std::size_t at = kHead; at + kEntry <= static_cast<std::size_t>(size); at += kEntry) {
    const auto number = [&](std::size_t from, std::size_t bytes) {
      std::uint64_t value = 0;
      for (std::size_t i = bytes; i-- > 0;) value = value << 8U | list.at(at + from + i);
      return value;
    };
    const std::uint64_t tag = number(0, 2), id = number(4, 4);
    const bool is_ours = tag == kUser && (id == 0 || id == owner || id == ::geteuid());
    if ((tag == kUser || tag == kGroup) && !is_ours && (number(2, 2) & kMayWrite) != 0)
      return true;  // mutant: access_lists
  }
  return false;
}

std::filesystem::path without_first(const std::filesystem::path& path) {
  std::filesystem::path rest;
  for (auto name = std::next(path.begin()); name != path.end(); ++name) rest /= *name;
  return rest;
}

std::string why_not_trusted(const std::filesystem::path& path, const struct stat& facts) {
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
  if ((facts.st_mode & S_IWGRP) != 0 && others_may_write(path, facts.st_uid))
    return fmt::format("an access control list lets others change {} (setfacl -b)", what);
  return {};
}

// Reason why another user may replace a link, as a sentence with the cure; empty: nobody may. The
// mode of a link means nothing.
std::string why_link_not_trusted(const std::filesystem::path& link, const struct stat& facts) {
  const uid_t user = ::geteuid();
  if (facts.st_uid == 0 || facts.st_uid == user) return {};
  return fmt::format("the link {} belongs to the user {} (chown -h it to {})", link.string(),
                     user_name(facts.st_uid), user_name(user));
}

// A link in /proc to a pipe has no target on a path: "pipe:[17]".
bool is_of_handed_pipe(const std::filesystem::path& path) {
  return path.string().starts_with("/proc/") &&
         path.filename().string().find(":[") != std::string::npos;
}

std::string replaced(const std::filesystem::path& path) {
  return path.string() + " is missing: it was replaced while it was read";
}

// The walk goes link by link, as the kernel does: whoever may change one in the middle leads to
// another file.
std::string walk(const std::string& file, bool was_read) {
  constexpr int kLinksMax = 40;  // the kernel's limit
  std::error_code failed;
  std::filesystem::path at;
  std::filesystem::path rest = std::filesystem::absolute(file, failed);
  for (int links = 0; !rest.empty() && links <= kLinksMax;) {
    const std::filesystem::path name = *rest.begin();
    rest = without_first(rest);
    if (name == "." || name.empty()) continue;
    const std::filesystem::path next = name == ".." ? at.parent_path() : at / name;
    struct stat facts {};
    if (::lstat(next.c_str(), &facts) != 0)
      return was_read && !is_of_handed_pipe(next) ? replaced(next) : std::string{};
    const bool is_link = S_ISLNK(facts.st_mode);
    std::string why = is_link ? why_link_not_trusted(next, facts) : why_not_trusted(next, facts);
    if (!why.empty()) return why;
    if (!is_link) {
      at = next;
      continue;
    }
    ++links;
    rest = std::filesystem::read_symlink(next, failed) / rest;
    if (rest.is_absolute()) at.clear();
  }
  return was_read && !rest.empty() ? replaced(file) : std::string{};
}

}  // namespace

std::string who_else_may_change(const std::string& file) {
  return walk(file, false);
}

std::string who_else_may_have_changed(const std::string& file) {
  return walk(file, true);
}

}  // namespace connect_bridge
