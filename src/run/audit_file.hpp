// The files of the audit log.
#pragma once

#include <cstdint>
#include <string>

#include "core/ports/audit.hpp"

namespace connect_bridge {

// Appends lines; when the file is full it becomes the first of the older ones, and the oldest is
// deleted. Where that is not possible, the file grows to the size that all of them may have.
// Readable for its owner only (mode 0600). A file that was renamed or deleted by others is created
// again. Blocks as long as the disk does. Not thread-safe.
class AuditFile {
 public:
  explicit AuditFile(AuditFileOptions options) : options_(std::move(options)) {}
  ~AuditFile() { close(); }
  AuditFile(const AuditFile&) = delete;
  AuditFile& operator=(const AuditFile&) = delete;

  // Opens it if needed. Returns what is wrong: not a regular file, it belongs to somebody else, the
  // folder does not exist ...; empty: nothing.
  [[nodiscard]] std::string open();
  struct Written {
    bool whole = false;   // otherwise none of the lines is in the file
    std::string problem;  // as open(); also that older files cannot be made
  };
  [[nodiscard]] Written write(const std::string& lines);

 private:
  // Whether the open file has its name still. Others may have written to it, or cut it: takes its
  // length.
  [[nodiscard]] bool is_current();
  [[nodiscard]] bool has_room(const std::string& lines, std::uint64_t bytes_max) const {
    return bytes_ == 0 || bytes_ + lines.size() <= bytes_max;
  }
  [[nodiscard]] std::string rotate();
  [[nodiscard]] std::string append(const std::string& lines);
  void close();

  const AuditFileOptions options_;
  int file_ = -1;
  std::uint64_t bytes_ = 0;  // before what is being written
};

}  // namespace connect_bridge
