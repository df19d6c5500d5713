#include "access/login/file_watch.hpp"

#include <sys/stat.h>

#include <utility>

namespace connect_bridge {
namespace {

std::int64_t nanoseconds(const timespec& time) {
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

}  // namespace

FileWatch::FileWatch(std::string file) : file_(std::move(file)), known_(look()) {}

FileWatch::Stamps FileWatch::look() const {
  struct stat found {};
  if (::stat(file_.c_str(), &found) != 0) return {};
  return {found.st_dev, found.st_ino, found.st_size, nanoseconds(found.st_mtim),
          nanoseconds(found.st_ctim)};
}

bool FileWatch::settled_change() {
  const Stamps seen = look();
  const bool is_new = seen != known_ || (unusable_ && seen != Stamps{});
  const auto before = std::exchange(changing_, is_new ? std::optional{seen} : std::nullopt);
  if (!before || before != changing_) return false;
  known_ = seen;
  unusable_ = false;
  changing_.reset();
  return true;
}

void FileWatch::read_now() {
  known_ = look();
  changing_.reset();
}

bool FileWatch::failed(const std::string& why) {
  unusable_ = true;
  std::pair failure{known_, why};
  if (failure == failure_) return false;
  failure_ = std::move(failure);
  return true;
}

}  // namespace connect_bridge
