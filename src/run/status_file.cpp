#include "run/status_file.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>

namespace connect_bridge {

std::string write_atomically(const std::string& file, const std::string& text) {
  const std::string part = file + ".part";
  {
    std::ofstream out(part, std::ios::trunc);
    out << text << '\n';
    if (!out) return "cannot write " + part + ": " + std::strerror(errno);
  }
  if (std::rename(part.c_str(), file.c_str()) != 0)
    return "cannot replace " + file + ": " + std::strerror(errno);
  return {};
}

void StatusFile::write(const std::string& file, const std::string& text) {
  const std::string problem = write_atomically(file, text);
  if (!problem.empty() && problem != problem_) node_.log(LogLevel::kWarn, problem);
  problem_ = problem;
}

}  // namespace connect_bridge
