#include "ops/audit/audit_log.hpp"

#include <memory>
#include <new>
#include <utility>

#include "net/tcp/steady_now.hpp"
#include "ops/audit/audit_json.hpp"

namespace connect_bridge {
namespace {

constexpr auto kLookPeriod = std::chrono::seconds(1);  // also until a failed write is repeated
constexpr std::size_t kBatchMax = 256;                 // lines
constexpr char kLacksMemory[] = "no memory left";      // so short that it needs none
constexpr char kHangs[] = "the disk has not taken a line for two seconds";

// Texts of peers without a login are shortened.
constexpr std::size_t kStrangersNodeMax = 64;     // bytes
constexpr std::size_t kStrangersReasonMax = 128;  // most of these texts are ours

void shorten(std::string& text, std::size_t bytes_max) {
  if (text.size() > bytes_max) text.resize(bytes_max);
}

}  // namespace

AuditLog::AuditLog(std::string file, Tell tell)
    : AuditLog([file = std::make_shared<AuditFile>(std::move(file))](
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

bool AuditLog::add(Audit line, bool surely) {
  if (!line.link) {
    shorten(line.node, kStrangersNodeMax);
    shorten(line.reason, kStrangersReasonMax);
  }
  const TimePoint now = steady_now();
  bool hangs = false;
  bool taken = false;
  {
    const std::lock_guard lock(mutex_);
    if (writing_since_ && now - *writing_since_ > kHangTime && counts_.problem.empty()) {
      counts_.problem = kHangs;
      hangs = true;
    }
    const bool may_wait = !surely || counts_.problem.empty();
    AuditBook::Account* const account = book_.take(line, now, may_wait);
    taken = account != nullptr;
    if (taken) waiting_.push_back({std::move(line), std::chrono::system_clock::now(), account});
    if (!taken) ++counts_.left_out;
  }
  changed_.notify_one();
  if (hangs) tell_(false, kHangs);
  return taken;
}

AuditLog::Counts AuditLog::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void AuditLog::run() {
  for (bool over = false; !over;) {
    {
      std::unique_lock lock(mutex_);
      // A failed write is repeated after a while.
      changed_.wait_for(lock, kLookPeriod, [&] {
        const bool can_go_on = text_.empty() && !lacks_memory_;
        return ending_ || (can_go_on && !waiting_.empty());
      });
      if (text_.empty()) try_batch();
      over = ending_ && waiting_.empty();
      if (text_.empty() && !lacks_memory_) continue;
      writing_since_ = steady_now();
    }
    const std::string problem = text_.empty() ? kLacksMemory : try_write();
    bool changed = false;
    {
      const std::lock_guard lock(mutex_);
      writing_since_.reset();
      changed = std::exchange(counts_.problem, problem) != problem;
      if (problem.empty()) end_batch();
      over = over || (ending_ && !problem.empty());
    }
    if (changed) tell_(problem.empty(), problem);
  }
}

// Lines that were taken before memory lacked are a batch of their own.
void AuditLog::try_batch() {
  lacks_memory_ = false;
  try {
    take_batch();
  } catch (const std::bad_alloc&) {
    lacks_memory_ = text_.empty();
  }
}

std::string AuditLog::try_write() {
  try {
    return write_(text_);
  } catch (const std::bad_alloc&) {
    return kLacksMemory;
  }
}

// Counts of left-out lines follow the lines of the batch, so that they cover everything before.
void AuditLog::take_batch() {
  batch_.reserve(kBatchMax);
  while (!waiting_.empty() && batch_.size() < kBatchMax) {
    const Entry& entry = waiting_.front();
    text_ += to_line(entry.line, entry.time);
    batch_.push_back(entry.account);
    waiting_.pop_front();
  }
  for (const auto& left_out : book_.take_left_out(steady_now(), ending_))
    text_ += to_line(left_out, std::chrono::system_clock::now());
}

void AuditLog::end_batch() {
  for (AuditBook::Account* const account : batch_) book_.written(*account);
  counts_.lines += batch_.size();
  batch_.clear();
  text_.clear();
}

}  // namespace connect_bridge
