#include "net/tcp/look_up.hpp"

#include <algorithm>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/post.hpp>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

namespace connect_bridge {

struct LookUp::Shared : std::enable_shared_from_this<LookUp::Shared> {
  using Work = asio::executor_work_guard<asio::io_context::executor_type>;

  Shared(asio::io_context& context, Resolve blocking) : io(context), resolve(std::move(blocking)) {}

  // Hands over the addresses or the error. False: nobody has waited for them.
  bool tell(const ErrorCode& error, Endpoints found);

  asio::io_context& io;
  const Resolve resolve;
  std::string host;
  std::uint16_t port = 0;
  std::mutex mutex;
  bool answered = false;
  std::optional<Work> work;  // none: nobody waits, and the io_context may be gone
  Done done;                 // only in the thread of the io_context
};

bool LookUp::Shared::tell(const ErrorCode& error, Endpoints found) {
  const std::lock_guard lock(mutex);
  if (!work) return answered;
  answered = true;
  asio::post(work->get_executor(), [self = shared_from_this(), error, found = std::move(found)] {
    {
      const std::lock_guard again(self->mutex);
      self->work.reset();
    }
    if (const auto tell_it = std::exchange(self->done, nullptr)) tell_it(error, found);
  });
  return true;
}

// All look-ups of the process. Any thread.
class LookUp::All {
 public:
  using Clock = std::chrono::steady_clock;

  // Never destroyed: threads may outlive main().
  static All& instance() {
    static All& all = *new All;
    return all;
  }

  struct Answer {
    ErrorCode error;
    Endpoints found;
  };
  // The answer that is known at once: too many look-ups, or a late answer for the same name. None:
  // one more look-up is counted.
  std::optional<Answer> begin(const std::shared_ptr<Shared>& one) {
    const std::lock_guard lock(mutex_);
    std::erase_if(late_, [](const Late& l) { return Clock::now() - l.at > kLate; });
    const auto same = [&](const Late& l) { return l.host == one->host && l.port == one->port; };
    if (const auto found = std::find_if(late_.begin(), late_.end(), same); found != late_.end()) {
      Answer late{{}, std::move(found->found)};
      std::erase_if(late_, same);
      return late;
    }
    if (under_way_ >= kUnderWayMax) return Answer{asio::error::host_not_found_try_again, {}};
    ++under_way_;
    waiting_.push_back(one);
    return std::nullopt;
  }

  void end(const std::shared_ptr<Shared>& one, const ErrorCode& error, const Endpoints& found) {
    const std::lock_guard lock(mutex_);
    --under_way_;
    bool answered = one->tell(error, found);
    std::erase_if(waiting_, [&](const auto& other) {
      const auto waits = other.lock();
      return !waits || waits == one;
    });
    if (error) return;
    for (const auto& other : waiting_) {
      const auto waits = other.lock();
      if (waits && waits->host == one->host && waits->port == one->port)
        answered = waits->tell(error, found) || answered;
    }
    if (!answered) late_.push_back({one->host, one->port, found, Clock::now()});
  }

 private:
  struct Late {
    std::string host;
    std::uint16_t port;
    Endpoints found;
    Clock::time_point at;
  };
  std::mutex mutex_;  // locked before that of a look-up
  int under_way_ = 0;
  std::vector<std::weak_ptr<Shared>> waiting_;
  std::vector<Late> late_;  // at most the answers within kLate
};

LookUp::Endpoints LookUp::resolve(const std::string& host, std::uint16_t port, ErrorCode& error) {
  asio::io_context own;
  asio::ip::tcp::resolver resolver(own);
  const auto found =
      resolver.resolve(host, std::to_string(port), asio::ip::tcp::resolver::numeric_service, error);
  return {found.begin(), found.end()};
}

LookUp::LookUp(asio::io_context& io, Resolve resolve)
    : shared_(std::make_shared<Shared>(io, std::move(resolve))) {}

void LookUp::start(const std::string& host, std::uint16_t port, Done done) {
  shared_->host = host;
  shared_->port = port;
  shared_->work.emplace(asio::make_work_guard(shared_->io));
  shared_->done = std::move(done);
  if (auto known = All::instance().begin(shared_)) {
    shared_->tell(known->error, std::move(known->found));
    return;
  }
  try {
    std::thread([shared = shared_] {
      ErrorCode error;
      const auto found = shared->resolve(shared->host, shared->port, error);
      All::instance().end(shared, error, found);
    }).detach();
  } catch (const std::system_error&) {
    All::instance().end(shared_, asio::error::no_memory, {});
  }
}

void LookUp::stop() {
  const std::lock_guard lock(shared_->mutex);
  shared_->work.reset();
  shared_->done = nullptr;
}

}  // namespace connect_bridge
