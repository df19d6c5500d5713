// What the core's work costs in processor time, without sockets and ROS:
//
//   core_bench control    how long control messages of the worst shapes take to be read
#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>

#include "bench/control_shapes.hpp"
#include "bench/processor_time.hpp"
#include "core/wire/control.hpp"

namespace {

using namespace connect_bridge;

// The shortest of some times: the first one also waits for memory.
double milliseconds_for(std::string_view text) {
  double shortest = 1e9;
  for (int i = 0; i < 5; ++i) {
    const double began = bench::processor_seconds();
    static_cast<void>(decode_control(text));
    shortest = std::min(shortest, 1e3 * (bench::processor_seconds() - began));
  }
  return shortest;
}

int measure_control() {
  std::puts("         ms     bytes  shape                         outcome");
  for (const auto& [name, text] : bench::control_shapes()) {
    const auto message = decode_control(text);
    std::printf("%11.2f %9zu  %-29s %s\n", milliseconds_for(text), text.size(), name.c_str(),
                message.ok() ? "read" : message.error().message.c_str());
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view what = argc == 2 ? argv[1] : "";
  if (what == "control") return measure_control();
  std::fputs("usage: core_bench control\n", stderr);
  return 2;
}
