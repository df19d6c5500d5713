#include "run/audit_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

namespace connect_bridge {
namespace {

constexpr mode_t kOwnerOnly = S_IRUSR | S_IWUSR;

std::string cannot(const char* what, const std::string& file) {
  return std::string("cannot ") + what + " " + file + ": " + std::strerror(errno);
}

}  // namespace

std::string AuditFile::open() {
  if (file_ >= 0) return {};
  // Does not follow a link that others put there, and does not wait for a pipe.
  const int flags = O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
  file_ = ::open(options_.file.c_str(), flags, kOwnerOnly);
  if (file_ < 0) return cannot("open", options_.file);
  struct stat found {};
  if (::fstat(file_, &found) != 0 || !S_ISREG(found.st_mode)) {
    close();
    return "cannot write " + options_.file + ": it is not a regular file";
  }
  if (::fchmod(file_, kOwnerOnly) != 0) {
    std::string problem = cannot("keep others out of", options_.file);
    close();
    return problem;
  }
  bytes_ = static_cast<std::uint64_t>(found.st_size);
  return {};
}

AuditFile::Written AuditFile::write(const std::string& lines) {
  if (file_ >= 0 && !is_current()) close();
  if (std::string problem = open(); !problem.empty()) return {false, std::move(problem)};
  std::string not_rotated;
  if (!has_room(lines, options_.bytes_max)) {
    not_rotated = rotate();
    if (std::string problem = open(); !problem.empty()) return {false, std::move(problem)};
    const std::uint64_t of_all = options_.bytes_max * (options_.files_kept + std::uint64_t{1});
    if (!has_room(lines, of_all)) return {false, std::move(not_rotated)};
  }
  std::string problem = append(lines);
  const bool whole = problem.empty();
  return {whole, whole ? std::move(not_rotated) : std::move(problem)};
}

std::string AuditFile::append(const std::string& lines) {
  std::size_t written = 0;
  while (written < lines.size()) {
    const ssize_t n = ::write(file_, lines.data() + written, lines.size() - written);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      std::string problem = cannot("write", options_.file);
      // A half-written line would damage the next one.
      if (written > 0 && ::ftruncate(file_, static_cast<off_t>(bytes_)) != 0) close();
      return problem;
    }
    written += static_cast<std::size_t>(n);
  }
  return {};
}

bool AuditFile::is_current() {
  struct stat named {};
  struct stat opened {};
  if (::stat(options_.file.c_str(), &named) != 0 || ::fstat(file_, &opened) != 0) return false;
  bytes_ = static_cast<std::uint64_t>(opened.st_size);
  return named.st_ino == opened.st_ino && named.st_dev == opened.st_dev;
}

std::string AuditFile::rotate() {
  close();
  const auto older = [&](std::uint32_t n) { return options_.file + "." + std::to_string(n); };
  if (options_.files_kept == 0 && ::unlink(options_.file.c_str()) != 0)
    return cannot("delete", options_.file);
  for (std::uint32_t n = options_.files_kept; n > 0; --n) {
    const std::string from = n == 1 ? options_.file : older(n - 1);
    if (std::rename(from.c_str(), older(n).c_str()) != 0 && errno != ENOENT)
      return cannot("rename", from);
  }
  return {};
}

void AuditFile::close() {
  if (file_ >= 0) ::close(file_);
  file_ = -1;
}

}  // namespace connect_bridge
