#include "run/status_file.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

namespace connect_bridge {

namespace {

// A file system that cannot promise it says EINVAL.
bool is_kept(std::FILE* file) {
  return ::fsync(::fileno(file)) == 0 || errno == EINVAL;
}

}  // namespace

std::string write_atomically(const std::string& file, const std::string& text, bool lasting) {
  const std::string part = file + ".part";
  {
    // Created as a new file ("x"), so that a link that somebody else put there is not followed.
    std::remove(part.c_str());
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> out(std::fopen(part.c_str(), "wx"),
                                                              &std::fclose);
    if (!out || std::fprintf(out.get(), "%s\n", text.c_str()) < 0 || std::fflush(out.get()) != 0 ||
        (lasting && !is_kept(out.get())))
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
    const std::string problem = write_atomically(file, to_json(*picture));
    if (!problem.empty() && problem != last_problem_) tell_(problem);
    last_problem_ = problem;
    lock.lock();
  }
}

}  // namespace connect_bridge
