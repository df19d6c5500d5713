// The program of the side that connects.
#include "run/program.hpp"

int main(int argc, char** argv) {
  return connect_bridge::run_program(connect_bridge::Role::kClient, argc, argv);
}
