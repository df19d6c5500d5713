// The arguments of main(), where other users of the machine cannot read the secrets among them.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace connect_bridge {

// A copy of argc and argv. The secrets of the original, which every user sees in /proc and ps, are
// overwritten: nothing may come before it.
class OwnArguments {
 public:
  OwnArguments(int argc, char** argv);
  OwnArguments(const OwnArguments&) = delete;
  OwnArguments& operator=(const OwnArguments&) = delete;

  // An invitation (`client -`) or a relay's line (`server --pair --via -`) comes from there. What
  // is wrong, or nothing.
  [[nodiscard]] std::string read_from(std::istream& in);

  [[nodiscard]] int count() const { return static_cast<int>(texts_.size()); }
  // As argv: a null pointer is behind the last one. As long as this lives.
  [[nodiscard]] char** words() { return words_.data(); }

 private:
  void point();

  std::vector<std::string> texts_;
  std::vector<char*> words_;
};

}  // namespace connect_bridge
