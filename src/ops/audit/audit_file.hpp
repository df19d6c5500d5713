// The file of the audit log.
#pragma once

#include <string>
#include <utility>

namespace connect_bridge {

// Appends lines. Readable for its owner only (mode 0600). Where others have renamed or removed it,
// a new one is begun. Blocks as long as the disk does. Not thread-safe.
class AuditFile {
 public:
  explicit AuditFile(std::string file) : name_(std::move(file)) {}
  ~AuditFile() { close(); }
  AuditFile(const AuditFile&) = delete;
  AuditFile& operator=(const AuditFile&) = delete;

  // Opens it if needed. Returns what is wrong: not a regular file, it belongs to somebody else, the
  // folder does not exist ...; empty: nothing.
  [[nodiscard]] std::string open();
  // As open(), or that the disk is full ...: then none of the lines is in the file.
  [[nodiscard]] std::string write(const std::string& lines);

 private:
  [[nodiscard]] bool is_in_place() const;
  void close();

  const std::string name_;
  int file_ = -1;
};

}  // namespace connect_bridge
