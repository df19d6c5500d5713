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

// A slow, full or missing disk delays nothing: lines wait for it, as many as the book allows.
class AuditLog {
 public:
  // A write that takes longer counts as a problem.
  static constexpr Duration kHangTime = std::chrono::seconds(2);

  struct Counts {
    std::uint64_t lines = 0;     // that were written
    std::uint64_t left_out = 0;  // too many for their pace, or for the room to wait
    std::string problem;         // reason why nothing can be written now; empty: none
  };

  using Tell = std::function<void(bool works, const std::string&)>;
  // Writes all lines or none. Returns the problem; empty: none.
  using Write = std::function<std::string(const std::string& lines)>;

  // `tell` is called when writing begins to fail (with the problem, for people) or works again. It
  // runs on the log's thread, or on that of add() when a write hangs.
  AuditLog(std::string file, Tell tell);
  // For tests: `write` replaces the file.
  AuditLog(Write write, Tell tell);
  // Writes waiting lines; those that cannot be written then are lost.
  ~AuditLog();
  AuditLog(const AuditLog&) = delete;
  AuditLog& operator=(const AuditLog&) = delete;

  // Adds a line; never blocks for the disk. Any thread may call this and the other members. False:
  // the line is left out; with `surely`, also while nothing can be written.
  bool add(Audit line, bool surely = false);
  [[nodiscard]] Counts counts() const;

 private:
  struct Entry {
    Audit line;
    std::chrono::system_clock::time_point time;
    AuditBook::Account* account;
  };
  void run();
  void try_batch();
  void take_batch();
  [[nodiscard]] std::string try_write();
  void end_batch();

  const Write write_;
  const Tell tell_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  AuditBook book_;
  std::deque<Entry> waiting_;
  std::string text_;  // of the thread: text that is being written, or could not be written yet
  std::vector<AuditBook::Account*> batch_;  // accounts of its lines
  std::optional<TimePoint> writing_since_;  // a write is under way
  Counts counts_;
  bool lacks_memory_ = false;  // of the thread: for the text of one line
  bool ending_ = false;
  std::thread thread_;  // last: it uses the others
};

}  // namespace connect_bridge
