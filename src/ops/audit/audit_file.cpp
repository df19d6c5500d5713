#include "ops/audit/audit_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace connect_bridge {
namespace {

constexpr mode_t kOwnerOnly = S_IRUSR | S_IWUSR;

std::string cannot(const char* what, const std::string& file) {
  return std::string("cannot ") + what + " " + file + ": " + std::strerror(errno);
}

}  // namespace

// Whether the name leads to the file that is open.
bool AuditFile::is_in_place() const {
  struct stat opened {};
  struct stat named {};
  return file_ >= 0 && ::fstat(file_, &opened) == 0 && ::lstat(name_.c_str(), &named) == 0 &&
         opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

std::string AuditFile::open() {
  if (is_in_place()) return {};
  close();
  // These flags do not follow a link that others put there, and do not wait for a pipe.
  const int flags = O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
  file_ = ::open(name_.c_str(), flags, kOwnerOnly);
  if (file_ < 0) return cannot("open", name_);
  struct stat found {};
  std::string problem;
  if (::fstat(file_, &found) != 0 || !S_ISREG(found.st_mode)) {
    problem = "cannot write " + name_ + ": it is not a regular file";
  } else if (::fchmod(file_, kOwnerOnly) != 0) {
    problem = cannot("keep others out of", name_);
  }
  if (!problem.empty()) close();
  return problem;
}

std::string AuditFile::write(const std::string& lines) {
  if (std::string problem = open(); !problem.empty()) return problem;
  struct stat before {};
  if (::fstat(file_, &before) != 0) return cannot("write", name_);
  std::size_t written = 0;
  while (written < lines.size()) {
    const ssize_t n = ::write(file_, lines.data() + written, lines.size() - written);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      std::string problem = cannot("write", name_);
      // A half-written line would damage the next one.
      if (written > 0 && ::ftruncate(file_, before.st_size) != 0) close();
      return problem;
    }
    written += static_cast<std::size_t>(n);
  }
  return {};
}

void AuditFile::close() {
  if (file_ >= 0) ::close(std::exchange(file_, -1));
}

}  // namespace connect_bridge
