// A small world of its own: one to four operators drive one robot at the same time. They press a
// key, lean on a stick, let go, stream zeros, take over and restart, on paths that stall and break,
// with clocks that are wrong and are set. What the robot's side publishes is judged by the times at
// which operators published, not by what the side knows.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sim/small_world.hpp"

namespace connect_bridge::sim {

struct OperatorPlan {
  Duration clock_offset{};  // of its machine
  bool second_way = false;  // a second client in its graph offers the same publishers
  bool streams_zeros = false;
};

// Drawn from a seed. Graph 0 is the robot's, graph n that of operator n.
struct DrivingPlan {
  std::uint64_t seed = 0;
  bool stamped = true;  // TwistStamped, else Twist
  bool logins = true;
  bool crashes = false;
  bool takes = false;        // operators call ~/drive
  bool withdrawals = false;  // rights end and come back
  Duration max_age = kForever;
  Duration halt_after = kForever;
  bool clock_steps = false;
  PathPlan path;
  std::vector<OperatorPlan> operators;

  [[nodiscard]] std::string text() const;
};
DrivingPlan make_driving(std::uint64_t seed);

class Driving final : public SmallWorld, DrivingListener {
 public:
  Driving(const DrivingPlan& plan, bool verbose);

  // Throws a Violation.
  void run();
  // Commands that moved the robot; zeros that nobody sent; calls of ~/drive that took a wheel.
  [[nodiscard]] std::uint64_t moved() const { return moved_; }
  [[nodiscard]] std::uint64_t halts() const { return halts_; }
  [[nodiscard]] std::uint64_t takes() const { return takes_; }
  [[nodiscard]] std::uint64_t takes_asked() const { return takes_asked_; }

 private:
  // One command as its operator published it.
  struct Said {
    TimePoint at;
    bool moves = false;
  };
  // A publisher of an operator.
  struct Source {
    int writer = 0;
    int by = 0;  // the operator
    TimePoint made{};
    std::vector<Said> said;
  };
  // The behaviour of an operator until a time.
  enum class Mood : std::uint8_t { kRest, kLean, kTap, kZeros };
  struct Operator {
    std::size_t source = 0;
    Mood mood = Mood::kRest;
    bool has_let_go = true;  // its last command was neutral
  };
  struct Heard {
    TimePoint at;
    std::size_t source = 0;
    std::size_t index = 0;  // in Source::said
  };

  void build(bool verbose);
  void add_source(int by);
  void change_mood(int by);
  void tick(int by);
  void say(int by, bool moves);
  void disturb();
  void withdraw();
  void crash_robot(Duration takes);
  [[nodiscard]] Policy policy() const;
  void check_calm();
  void check_time() const;
  void check_age(const Said& said) const;
  void check_stamp(const Said& said, const Source& source, ByteView message, Stamp here) const;
  void check_holder(std::size_t source, TimePoint now) const;
  void check_let_go(std::size_t source, std::size_t index) const;
  [[nodiscard]] bool clocks_rest() const;

  void on_command(const Host& host, ByteView message) override;
  void on_audit(const Audit& line) override;
  void on_heard(const Reader&, const Label&) override {}
  void on_answer(RequestKey) override {}

  DrivingPlan plan_;
  std::vector<int> paths_;
  std::vector<Source> sources_;
  std::vector<Operator> operators_;
  std::optional<Heard> last_;  // the last command that moved the robot
  TimePoint stopped_{};        // when the last zero or neutral was published
  bool withdrawn_ = false;     // nobody may drive now
  struct Taken {
    int by = 0;
    TimePoint at;
  };
  std::optional<Taken> taken_;       // by a call, and not left since
  std::map<int, TimePoint> halted_;  // operators that have to let go, since when
  TimePoint clock_set_{TimePoint::min()};
  TimePoint cut_{};  // the last time at which a link may have ended
  bool calm_ = false;
  std::uint64_t moved_ = 0, halts_ = 0;
  std::uint64_t takes_ = 0, takes_asked_ = 0;
  std::uint64_t audited_ = 0;  // commands by the audit log
};

}  // namespace connect_bridge::sim
