// The program of the side that listens.
#include "run/program.hpp"

int main(int argc, char** argv) {
  return connect_bridge::run_program(connect_bridge::Role::kServer, argc, argv);
}
