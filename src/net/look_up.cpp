#include "net/look_up.hpp"

#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/post.hpp>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

namespace connect_bridge {
namespace {

std::atomic<int> under_way{0};

}  // namespace

struct LookUp::Shared {
  using Work = asio::executor_work_guard<asio::io_context::executor_type>;

  Shared(asio::io_context& context, Resolve blocking) : io(context), resolve(std::move(blocking)) {}

  asio::io_context& io;
  const Resolve resolve;
  std::mutex mutex;
  std::optional<Work> work;  // none: nobody waits for it, and the io_context may be gone
  Done done;                 // only in the thread of the io_context
};

namespace {

// What the thread found, or why there is no thread.
template <class Shared>
void tell(const std::shared_ptr<Shared>& shared, const ErrorCode& error, LookUp::Endpoints found) {
  const std::lock_guard lock(shared->mutex);
  if (!shared->work) return;
  asio::post(shared->work->get_executor(), [shared, error, found = std::move(found)] {
    {
      const std::lock_guard again(shared->mutex);
      shared->work.reset();
    }
    if (const auto done = std::exchange(shared->done, nullptr)) done(error, found);
  });
}

}  // namespace

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
  shared_->work.emplace(asio::make_work_guard(shared_->io));
  shared_->done = std::move(done);
  if (++under_way > kUnderWayMax) {
    --under_way;
    return tell(shared_, asio::error::host_not_found_try_again, {});
  }
  try {
    std::thread([shared = shared_, host, port] {
      ErrorCode error;
      auto found = shared->resolve(host, port, error);
      --under_way;
      tell(shared, error, std::move(found));
    }).detach();
  } catch (const std::system_error&) {
    --under_way;
    tell(shared_, asio::error::no_memory, {});
  }
}

void LookUp::stop() {
  const std::lock_guard lock(shared_->mutex);
  shared_->work.reset();
  shared_->done = nullptr;
}

}  // namespace connect_bridge
