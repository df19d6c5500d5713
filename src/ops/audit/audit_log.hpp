// Writes the audit log on a thread of its own (docs/security.md, "The audit log").
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "ops/audit/audit_book.hpp"
#include "ops/audit/audit_file.hpp"

namespace connect_bridge {

// A disk that is slow, full or gone delays nothing: lines wait for it, as many as the book allows.
class AuditLog {
 public:
  // A write that takes longer counts as a problem.
  static constexpr Duration kHangTime = std::chrono::seconds(2);

  struct Counts {
    std::uint64_t lines = 0;     // written
    std::uint64_t left_out = 0;  // too many for their pace, or for the room to wait
    std::string problem;         // why nothing can be written now; empty: none
  };

  using Tell = std::function<void(bool works, const std::string&)>;
  // Writes all lines or none. Returns what is wrong.
  using Write = std::function<std::string(const std::string& lines)>;

  // `tell` is called when writing begins to fail (with what fails, for people) or works again: from
  // the log's thread, or from that of add() when a write hangs.
  AuditLog(std::string file, Tell tell);
  // For tests: `write` instead of a file's.
  AuditLog(Write write, Tell tell);
  // Writes what waits; what cannot be written then is lost.
  ~AuditLog();
  AuditLog(const AuditLog&) = delete;
  AuditLog& operator=(const AuditLog&) = delete;

  // Any thread, as the others; never blocks for the disk. False: the line is left out; `surely`:
  // also while nothing can be written.
  bool add(Audit line, bool surely = false);
  [[nodiscard]] Counts counts() const;

 private:
  struct Entry {
    Audit line;
    std::chrono::system_clock::time_point time;
    AuditBook::Account* account;
  };
  void run();
  void take_batch();
  void end_batch();

  const Write write_;
  const Tell tell_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  AuditBook book_;
  std::deque<Entry> waiting_;
  std::string text_;  // of the thread: being written, or could not be written yet
  std::vector<AuditBook::Account*> batch_;  // whose lines are in it
  std::optional<TimePoint> writing_since_;  // a write is under way
  Counts counts_;
  bool ending_ = false;
  std::thread thread_;  // last: it uses the others
};

}  // namespace connect_bridge
