// Writes the audit log on a thread of its own (docs/security.md, "The audit log").
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "run/audit_book.hpp"
#include "run/audit_file.hpp"

namespace connect_bridge {

// A disk that is slow, full or gone delays nothing: lines that cannot be kept are lost and counted.
class AuditLog {
 public:
  static constexpr std::size_t kWaitingMax = 8192;

  struct Counts {
    std::uint64_t lines = 0;  // written
    std::uint64_t lost = 0;   // for any reason
    std::string problem;      // why nothing, or no older file, can be written; empty: none
  };

  using Tell = std::function<void(bool works, const std::string&)>;
  using Write = std::function<AuditFile::Written(const std::string& lines)>;

  // `tell` is called when writing begins to fail (with what fails, for people) or works again: from
  // the log's thread, or from that of add() when the disk hangs and the queue is full.
  AuditLog(AuditFileOptions options, Tell tell);
  // For tests: `write` instead of a file's.
  AuditLog(Write write, Tell tell);
  // Writes what waits.
  ~AuditLog();
  AuditLog(const AuditLog&) = delete;
  AuditLog& operator=(const AuditLog&) = delete;

  // Any thread; never blocks for the disk.
  void add(Audit audit);
  [[nodiscard]] Counts counts() const;

 private:
  void run();
  void write(const std::string& lines);

  const Write write_;
  AuditBook book_;
  const Tell tell_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<AuditBook::Entry> waiting_;
  bool overflows_ = false;      // since the thread last took what waits
  Counts counts_;               // `lost`: by the book alone
  std::uint64_t not_kept_ = 0;  // lost because the queue or the disk was full
  bool ending_ = false;
  std::thread thread_;  // last: it uses the others
};

}  // namespace connect_bridge
