#include "run/audit_log.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "net/steady_now.hpp"

namespace connect_bridge {
namespace {

constexpr auto kLookPeriod = std::chrono::seconds(1);
// Largest write, so that a file does not exceed its size by much.
constexpr std::size_t kPieceBytes = 64 << 10;

constexpr char kLost[] = "it cannot be written, its lines are lost: ";
constexpr char kHangs[] = "the disk does not keep up";

}  // namespace

AuditLog::AuditLog(AuditFileOptions options, Tell tell)
    : AuditLog([file = std::make_shared<AuditFile>(std::move(options))](
                   const std::string& lines) { return file->write(lines); },
               std::move(tell)) {}

AuditLog::AuditLog(Write write, Tell tell)
    : write_(std::move(write)), tell_(std::move(tell)), thread_([this] { run(); }) {}

AuditLog::~AuditLog() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void AuditLog::add(Audit audit) {
  bool is_news = false;
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() < kWaitingMax) {
      waiting_.push_back({std::move(audit), std::chrono::system_clock::now(), steady_now()});
    } else {
      ++not_kept_;
      is_news = !std::exchange(overflows_, true) && counts_.problem != kHangs;
      if (is_news) counts_.problem = kHangs;  // until the thread writes again
    }
  }
  changed_.notify_one();
  if (is_news) tell_(false, std::string(kLost) + kHangs);
}

AuditLog::Counts AuditLog::counts() const {
  const std::lock_guard lock(mutex_);
  Counts counts = counts_;
  counts.lost += not_kept_;
  return counts;
}

void AuditLog::run() {
  for (bool ending = false; !ending;) {
    std::vector<AuditBook::Entry> entries;
    {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, kLookPeriod, [this] { return ending_ || !waiting_.empty(); });
      entries = std::exchange(waiting_, {});
      overflows_ = false;
      ending = ending_;
    }
    std::string text;
    for (const auto& entry : entries) {
      text += book_.add(entry);
      if (text.size() >= kPieceBytes) write(std::exchange(text, {}));
    }
    write(text + book_.take_due(steady_now(), ending));
    const std::lock_guard lock(mutex_);
    counts_.lost = book_.lost();
  }
}

void AuditLog::write(const std::string& lines) {
  if (lines.empty()) return;
  const auto [whole, problem] = write_(lines);
  const auto count = static_cast<std::uint64_t>(std::count(lines.begin(), lines.end(), '\n'));
  bool changed = false;
  {
    const std::lock_guard lock(mutex_);
    (whole ? counts_.lines : not_kept_) += count;
    changed = problem != counts_.problem;
    counts_.problem = problem;
  }
  if (!changed) return;
  const char* const what = whole ? "no older files can be made, it grows: " : kLost;
  tell_(problem.empty(), problem.empty() ? "" : what + problem);
}

}  // namespace connect_bridge
