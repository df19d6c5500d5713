#include "access/login/token_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>
#include <string_view>
#include <utility>

#include "access/login/token_table.hpp"
#include "core/base/hex.hpp"

namespace connect_bridge {
namespace {

// The text as a YAML string; it may have any content.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
}

// Names the process that holds a folder's lock, as a sentence with the cure. Processes of another
// namespace have the number 0 and get no name.
std::string holder_of_lock(int folder) {
  struct stat facts {};
  ::fstat(folder, &facts);
  const std::string inode = ":" + std::to_string(facts.st_ino);
  std::string text = "another program";
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    std::istringstream words(line);
    std::string number, kind, mode, access, process, place;
    words >> number >> kind >> mode >> access >> process >> place;
    if (kind == "FLOCK" && place.ends_with(inode) && process != "0")
      text += " (process " + process + ")";
  }
  return text + " holds its folder locked: it is being changed, or end that program";
}

// The folder of a file. If it cannot be opened, the write fails, too.
class Folder {
 public:
  explicit Folder(const std::string& file) {
    const auto slash = file.rfind('/');
    const std::string folder = slash == std::string::npos ? "." : file.substr(0, slash + 1);
    handle_ = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  }
  ~Folder() {
    if (handle_ >= 0) ::close(handle_);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  // Takes the folder's lock, so that one writer follows the other while this object lives. Anybody
  // who may open the folder can hold the lock without end. So the wait is at most `patience`, and
  // after a second a line on stderr names the holder. Returns the problem; empty: none.
  [[nodiscard]] std::string lock_soon(std::chrono::seconds patience) const {
    const auto begin = std::chrono::steady_clock::now();
    bool logged = false;
    while (handle_ >= 0 && ::flock(handle_, LOCK_EX | LOCK_NB) != 0) {
      if (errno != EWOULDBLOCK && errno != EINTR) break;  // a file system without locks
      const auto waited = std::chrono::steady_clock::now() - begin;
      if (waited >= patience) return holder_of_lock(handle_);
      if (waited >= kSilence && !std::exchange(logged, true))
        std::fprintf(stderr, "waiting: %s\n", holder_of_lock(handle_).c_str());
      ::poll(nullptr, 0, kLockStepMs);  // no event reports that a lock is free
    }
    return {};
  }
  // Makes renames in the folder survive a loss of power. A file system that cannot promise this
  // returns EINVAL, which is no failure.
  [[nodiscard]] bool keep() const {
    return handle_ < 0 || ::fsync(handle_) == 0 || errno == EINVAL;
  }

 private:
  static constexpr std::chrono::seconds kSilence{1};
  static constexpr int kLockStepMs = 1;  // short, so that one of many writers finds a gap

  int handle_ = -1;
};

// A disk that becomes full lets one call write a part; the next call returns the error.
bool write_all(int out, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(out, text.data(), text.size());
    if (written < 0 && errno != EINTR) return false;
    text.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(written, 0)));
  }
  return true;
}

// The target of a link is replaced, not the link: it may lead to a place that outlasts an update.
std::string target_of(const std::string& file) {
  const std::unique_ptr<char, decltype(&std::free)> target(::realpath(file.c_str(), nullptr),
                                                           &std::free);
  return target ? target.get() : file;
}

// Replaces the file itself, also where it is a link, by a new one. The new one has the permissions
// of `former`; null: it is its owner's alone. Returns the problem; empty: none.
std::string replace_file(const std::string& file, const std::string& text,
                         const struct stat* former) {
  const mode_t mode = former ? former->st_mode & 0777 : 0600;  // mutant: token_file_mode
  const std::string part = file + ".part";
  const auto problem = [&] { return part + ": " + std::strerror(errno); };
  ::unlink(part.c_str());
  const int out = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (out < 0) return problem();
  // Written by root (sudo ctl token), it stays the server's.
  if (former) static_cast<void>(!::fchown(out, former->st_uid, former->st_gid));
  const bool whole = write_all(out, text) && ::fchmod(out, mode) == 0 && ::fsync(out) == 0;
  std::string wrong = whole ? "" : problem();
  ::close(out);
  if (whole && ::rename(part.c_str(), file.c_str()) != 0) wrong = problem();
  if (!wrong.empty()) {
    ::unlink(part.c_str());
    return wrong;
  }
  return Folder(file).keep() ? "" : "the folder of " + file + ": " + std::strerror(errno);
}

// A comment above an entry belongs to that entry, not to the one before.
bool is_between_entries(std::string_view line) {
  line = trim(line);
  return line.empty() || line.front() == '#';
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size() - 1) + 1;
    lines.push_back(text.substr(begin, end - begin));
    begin = end;
  }
  return lines;
}

// The text of a valid file without the lines of an identity's entries.
std::string without(const std::string& text, const std::string& identity) {
  std::vector<std::string> lines = lines_of(text);
  const YAML::Node entries = YAML::Load(text);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (entries[i]["identity"].Scalar() != identity) continue;
    const auto line_of = [&](std::size_t entry) {
      return static_cast<std::size_t>(entries[entry].Mark().line);
    };
    const std::size_t begin = line_of(i);
    std::size_t end = i + 1 < entries.size() ? line_of(i + 1) : lines.size();
    while (end > begin + 1 && is_between_entries(lines[end - 1])) --end;
    for (std::size_t line = begin; line < end; ++line) lines[line].clear();
  }
  return fmt::format("{}", fmt::join(lines, ""));
}

// The text of this file without an identity's entries. `removed` gets their number. `problem` is
// set if they cannot be removed, or if none of them has this token.
std::string text_without(const std::string& file, const std::string& identity,
                         const std::optional<Digest>& token, std::size_t& removed,
                         std::string& problem) {
  const auto text = read_secret_file(file, problem);
  if (!text) return {};
  std::vector<std::string> problems, warnings;
  TokenTable before, after;
  before.read(*text, file, Stamp{0}, problems, warnings);
  problem = fmt::format("{}", fmt::join(problems, "\n"));
  removed = before.has_plain() ? 0 : before.of_identity(identity).count;
  if (problem.empty() && token) {
    const Judgement whose = before.find(*token, Stamp{0});
    if (!whose.identity || whose.identity->name != identity)  // mutant: line_once
      problem = file + ": the entry of " + identity + " that is to be replaced is there no more";
  }
  if (!problem.empty() || removed == 0) return *text;
  std::string rest = without(*text, identity);
  after.read(trim(rest).empty() ? "# No entries.\n" : rest, file, Stamp{0}, problems, warnings);
  if (!problems.empty() || after.of_identity(identity).count != 0 ||
      after.size() + removed != before.size())
    problem = file + ": the entry of " + identity +
              " does not stand on lines of its own: remove it by hand";
  return rest;
}

}  // namespace

std::string write_secret_file(const std::string& named, const std::string& text) {
  const std::string file = target_of(named);
  struct stat status {};
  const bool replaces = ::stat(file.c_str(), &status) == 0;
  return replace_file(file, text, replaces ? &status : nullptr);
}

std::string secret_to_print(const std::string& text, const std::string& name, bool terminal,
                            const std::string& file, std::string& problem) {
  if (terminal) return text;
  // A user who may read an existing file may not read this, nor lead it elsewhere by a link.
  problem = replace_file(file, text, nullptr);
  if (!problem.empty()) return {};
  return name + " is in '" + file + "', since this output may be a log that others read\n";
}

std::string to_text(const TokenEntry& entry) {
  std::string text = "- identity: " + quoted(entry.identity) + "\n";
  std::string groups;
  for (const auto& group : entry.groups) groups += (groups.empty() ? "" : ", ") + quoted(group);
  if (!groups.empty()) text += "  groups: [" + groups + "]\n";
  if (!entry.expires.empty()) text += "  expires: " + entry.expires + "\n";
  if (!entry.comment.empty()) text += "  comment: " + quoted(entry.comment) + "\n";
  return text + "  token_sha256: " + to_hex(entry.digest) + "\n";
}

std::string token_entries_problem(const std::string& text, const std::string& name) {
  TokenTable table;
  std::vector<std::string> problems, warnings;
  table.read(text, name, Stamp{0}, problems, warnings);
  if (problems.empty() && table.has_plain())
    problems.push_back(name + ": holds one token; take another file for a list of entries");
  return fmt::format("{}", fmt::join(problems, "\n"));
}

std::string append_token_entry(const std::string& named, const TokenEntry& entry,
                               std::chrono::seconds patience) {
  const std::string file = target_of(named);
  const Folder folder(file);
  if (const std::string held = folder.lock_soon(patience); !held.empty()) return file + ": " + held;
  std::string text, problem;
  if (::access(file.c_str(), F_OK) == 0) {
    auto before = read_secret_file(file, problem);
    if (!before) return problem;
    text = *before;
    const bool empty = text.find_first_not_of(" \t\r\n") == std::string::npos;
    if (!empty) problem = token_entries_problem(text, file);
    if (!problem.empty()) return problem;
  }
  if (!text.empty() && text.back() != '\n') text += '\n';
  text += to_text(entry);
  problem = token_entries_problem(text, file);
  return problem.empty() ? write_secret_file(file, text) : problem;
}

std::string replace_token_entries(const std::string& named, const TokenEntry& entry,
                                  const Digest& former) {
  const std::string file = target_of(named);
  const Folder folder(file);
  if (const std::string held = folder.lock_soon(kLockSoon); !held.empty())
    return file + ": " + held;
  std::size_t removed = 0;
  std::string problem;
  std::string text = text_without(file, entry.identity, former, removed, problem);
  if (!problem.empty()) return problem;
  if (!text.empty() && text.back() != '\n') text += '\n';
  text += to_text(entry);
  problem = token_entries_problem(text, file);
  return problem.empty() ? write_secret_file(file, text) : problem;
}

std::string remove_token_entries(const std::string& named, const std::string& identity,
                                 std::size_t& removed) {
  const std::string file = target_of(named);
  const Folder folder(file);
  if (const std::string held = folder.lock_soon(kLockPatience); !held.empty())
    return file + ": " + held;
  std::string problem;
  std::string rest = text_without(file, identity, std::nullopt, removed, problem);
  if (!problem.empty()) return problem;
  if (removed == 0) return file + ": has no entry of " + identity;
  if (trim(rest).empty()) rest = "# No entries.\n";
  return write_secret_file(file, rest);
}

}  // namespace connect_bridge
