#include "run/audit_log.hpp"

#include <algorithm>
#include <utility>

#include "net/steady_now.hpp"

namespace connect_bridge {
namespace {

constexpr auto kLookPeriod = std::chrono::seconds(1);
// Largest write, so that a file does not exceed its size by much.
constexpr std::size_t kPieceBytes = 64 << 10;

}  // namespace

AuditLog::AuditLog(AuditFileOptions options,
                   std::function<void(bool works, const std::string&)> tell)
    : file_(std::move(options)), tell_(std::move(tell)), thread_([this] { run(); }) {}

AuditLog::~AuditLog() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void AuditLog::add(Audit audit) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= kWaitingMax) {
      ++not_kept_;
      return;
    }
    waiting_.push_back({std::move(audit), std::chrono::system_clock::now(), steady_now()});
  }
  changed_.notify_one();
}

AuditLog::Counts AuditLog::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void AuditLog::run() {
  for (bool ending = false; !ending;) {
    std::vector<AuditBook::Entry> entries;
    {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, kLookPeriod, [this] { return ending_ || !waiting_.empty(); });
      entries = std::exchange(waiting_, {});
      ending = ending_;
    }
    std::string text;
    for (const auto& entry : entries) {
      text += book_.add(entry);
      if (text.size() >= kPieceBytes) write(std::exchange(text, {}));
    }
    write(text + book_.take_due(steady_now(), ending));
    const std::lock_guard lock(mutex_);
    counts_.lost = book_.lost() + not_kept_;
  }
}

void AuditLog::write(const std::string& lines) {
  if (lines.empty()) return;
  const auto [whole, problem] = file_.write(lines);
  const auto count = static_cast<std::uint64_t>(std::count(lines.begin(), lines.end(), '\n'));
  bool changed = false;
  {
    const std::lock_guard lock(mutex_);
    (whole ? counts_.lines : not_kept_) += count;
    changed = problem != counts_.problem;
    counts_.problem = problem;
  }
  if (!changed) return;
  const char* const what = whole ? "no older files can be made, it grows: "
                                 : "it cannot be written, its lines are lost: ";
  tell_(problem.empty(), problem.empty() ? "" : what + problem);
}

}  // namespace connect_bridge
