// The files of a pairing, from which a program can start without a parameter file.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/parameter.hpp"
#include "core/ports/net_options.hpp"

namespace connect_bridge {

// The cure where a folder has other uses.
inline constexpr char kOwnName[] = "give this one a name: --ros-args -r __node:=NAME";

// $ROS_HOME, or ~/.ros.
[[nodiscard]] std::string ros_home();

// The server that runs with a folder.
struct RunningServer {
  pid_t process = 0;
  std::uint16_t port = 0;  // where it listens
};

// From its construction until its end, other processes find this server by running().
class RunningMark {
 public:
  RunningMark(const std::string& file, std::uint16_t port);
  ~RunningMark();
  RunningMark(const RunningMark&) = delete;
  RunningMark& operator=(const RunningMark&) = delete;

 private:
  int handle_;
};

// The folder of one node: $ROS_HOME/connect_bridge/NODE, or ~/.ros/connect_bridge/NODE. It holds
// params.yaml, which is a ROS parameter file like any other, and the files that it names.
class PairingFolder {
 public:
  // `strict`: not used if somebody else may change it or its files (`strict_modes`).
  explicit PairingFolder(const std::string& node, bool strict = true);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::string file(const std::string& name) const { return path_ + "/" + name; }
  [[nodiscard]] std::string parameter_file() const { return file("params.yaml"); }
  // Where a server that runs is asked to let one client in (PairingOptions).
  [[nodiscard]] std::string invited_file() const { return file("invited"); }
  // An invitation's text for a person, where that is not printed.
  [[nodiscard]] std::string invitation_file() const { return file("invitation"); }
  // What a RunningMark is made with.
  [[nodiscard]] std::string running_file() const { return file("running"); }
  [[nodiscard]] std::optional<RunningServer> running() const;
  [[nodiscard]] bool has(const std::string& name) const;
  // The file for the token of an invitation with this code. The same invitation, used again, finds
  // the same file. `kind`: the beginning of the file's name.
  [[nodiscard]] std::string token_file(const std::string& kind, const std::string& code) const;
  // Removes the file of a token that was in use before, if it is one of these and not in use now.
  void remove_former(const std::string& kind, const std::string& former,
                     const std::string& now) const;

  // Creates it, with the folders above it, for its owner alone. Returns what is wrong, also with
  // one that is there: another user's, or one that others may change (strict); empty: nothing.
  [[nodiscard]] std::string make() const;
  // params.yaml; empty if there is none. `problem` is set if it cannot be read, or if somebody else
  // may change it (strict).
  [[nodiscard]] ParameterMap parameters(std::string& problem) const;
  // A folder holds the rights of one kind of pairing. Why the rights of a pairing in which `robot`
  // is the robot's end cannot be kept beside the stored parameters; empty: they can.
  [[nodiscard]] std::string other_kind(const ParameterMap& stored, Role robot) const;
  // The folder of another client that has paired with a robot and has its names below the same
  // prefix; empty: there is none.
  [[nodiscard]] std::string other_client(const std::string& prefix) const;
  [[nodiscard]] std::string write_parameters(const ParameterMap& parameters) const;

 private:
  [[nodiscard]] std::string distrusted(const std::string& file) const;

  std::string path_;
  bool strict_;
};

// Whether the pairing's parameters are used: not if the given ones have an address, a login or a
// certificate.
[[nodiscard]] bool goes_by_pairing(const ParameterMap& given);

// The given parameters, and those of `stored` that were not given. Rules count as one: if any is
// given, none is taken from `stored`.
[[nodiscard]] ParameterMap filled(const ParameterMap& given, const ParameterMap& stored);

}  // namespace connect_bridge
