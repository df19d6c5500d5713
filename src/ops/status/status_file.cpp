#include "ops/status/status_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>

namespace connect_bridge {

namespace {

constexpr mode_t kFirstMode = S_IRUSR | S_IWUSR;

// The status names people and addresses: its file is for its owner alone, unless the owner has let
// others read it. The mode of somebody else's file is that user's choice, and does not count.
mode_t mode_of(const std::string& file) {
  struct stat found {};
  const bool replaces =
      ::lstat(file.c_str(), &found) == 0 && S_ISREG(found.st_mode) && found.st_uid == ::geteuid();
  return replaces ? found.st_mode & 0777 : kFirstMode;
}

}  // namespace

std::string write_atomically(const std::string& file, const std::string& text) {
  const std::string part = file + ".part";
  {
    // Created as a new file, so that a link that somebody else put there is not followed.
    std::remove(part.c_str());
    const int made = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kFirstMode);
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> out(
        made < 0 ? nullptr : ::fdopen(made, "w"), &std::fclose);
    if (!out || ::fchmod(made, mode_of(file)) != 0 ||
        std::fprintf(out.get(), "%s\n", text.c_str()) < 0 || std::fflush(out.get()) != 0)
      return "cannot write " + part + ": " + std::strerror(errno);
  }
  if (std::rename(part.c_str(), file.c_str()) != 0)
    return "cannot replace " + file + ": " + std::strerror(errno);
  return {};
}

StatusFile::StatusFile(std::function<void(const std::string&)> tell)
    : tell_(std::move(tell)), thread_([this] { write_all(); }) {}

StatusFile::~StatusFile() {
  static_cast<void>(end());
}

std::string StatusFile::end() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
  return last_problem_;
}

std::string StatusFile::problem() {
  const std::lock_guard lock(mutex_);
  return last_problem_;
}

void StatusFile::write(const std::string& file, std::shared_ptr<const StatusPicture> picture) {
  {
    const std::lock_guard lock(mutex_);
    waits_ = {file, std::move(picture)};
  }
  changed_.notify_one();
}

void StatusFile::write_all() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return ending_ || waits_; });
    if (!waits_) return;
    const auto [file, picture] = *std::exchange(waits_, std::nullopt);
    lock.unlock();
    std::string problem;
    try {
      problem = write_atomically(file, to_json(*picture));
    } catch (const std::bad_alloc&) {
      problem = "no memory left";
    }
    if (!problem.empty() && problem != last_problem_) tell_(problem);
    lock.lock();
    last_problem_ = problem;
  }
}

}  // namespace connect_bridge
