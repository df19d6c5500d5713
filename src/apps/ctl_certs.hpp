// `ctl certs`: a private authority, and what it signs.
#pragma once

#include <CLI/CLI.hpp>

#include "net/authority.hpp"

namespace connect_bridge {

// Its arguments go to `order`, which must outlive the parsing.
CLI::App* add_certs_command(CLI::App& app, CertificateOrder& order);

// The exit code; says what was made and which lines use it.
int run_certs(const CertificateOrder& order);

}  // namespace connect_bridge
