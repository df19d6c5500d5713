// The file of the audit log.
#pragma once

#include <string>
#include <utility>

namespace connect_bridge {

// Appends lines to a file that only its owner may read (mode 0600). If others have renamed or
// removed the file, a new one is begun. Blocks as long as the disk does. Not thread-safe.
class AuditFile {
 public:
  explicit AuditFile(std::string file) : name_(std::move(file)) {}
  ~AuditFile() { close(); }
  AuditFile(const AuditFile&) = delete;
  AuditFile& operator=(const AuditFile&) = delete;

  // Opens the file if needed. Returns the problem: it is not a regular file, it belongs to somebody
  // else, the folder does not exist ...; empty: none.
  [[nodiscard]] std::string open();
  // Writes all lines or none. Returns the problem, of open() or of the disk (full ...); empty:
  // none.
  [[nodiscard]] std::string write(const std::string& lines);

 private:
  [[nodiscard]] bool is_in_place() const;
  void close();

  const std::string name_;
  int file_ = -1;
};

}  // namespace connect_bridge
