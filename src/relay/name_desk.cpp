#include "relay/name_desk.hpp"

#include <boost/asio/post.hpp>
#include <exception>
#include <utility>

namespace connect_bridge {

NameDesk::NameDesk(boost::asio::io_context& io, RobotNames::HandOver hand_over)
    : io_(io), hand_over_(std::move(hand_over)) {}

void NameDesk::give(RobotNames::Taking taking, Done done) {
  if (!thread_) thread_.emplace(1);
  boost::asio::post(*thread_, [this, taking = std::move(taking), done = std::move(done)]() mutable {
    std::unique_ptr<Authenticator> robots;
    std::string problem;
    try {
      robots = hand_over_(taking, problem);
    } catch (const std::exception& error) {
      problem = error.what();
    }
    boost::asio::post(
        io_, [done = std::move(done), robots = std::move(robots),
              problem = std::move(problem)]() mutable { done(std::move(robots), problem); });
  });
}

}  // namespace connect_bridge
