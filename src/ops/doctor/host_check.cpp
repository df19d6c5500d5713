#include "ops/doctor/host_check.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <pwd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <utility>

#include "access/login/file_trust.hpp"
#include "access/login/secret.hpp"
#include "net/tcp/system_now.hpp"
#include "net/tls/certificate_end.hpp"
#include "net/tls/tls.hpp"

namespace connect_bridge {
namespace {

bool is_readable(const std::string& file) {
  return !file.empty() && ::access(file.c_str(), R_OK) == 0;
}

std::string name_of_user(uid_t user) {
  const passwd* const entry = ::getpwuid(user);
  return entry == nullptr ? std::to_string(user) : entry->pw_name;
}

// The first part of the path that this user may not use.
std::string why_not_permitted(const std::filesystem::path& path) {
  std::filesystem::path part;
  for (auto name = path.begin(); name != path.end(); ++name) {
    part /= *name;
    const bool is_last = std::next(name) == path.end();
    if (::access(part.c_str(), is_last ? R_OK : X_OK) == 0) continue;
    std::string text = (is_last ? "" : "the folder ") + part.string() +
                       " is not permitted for user " + name_of_user(::getuid());
    struct stat found {};
    if (::stat(part.c_str(), &found) != 0) return text;
    return fmt::format("{}: it belongs to {} (mode {:04o})", text, name_of_user(found.st_uid),
                       found.st_mode & 07777U);
  }
  return {};
}

// In the words of a program's log.
void check_end(asio::ssl::context& own, const std::string& file, HostFindings& findings) {
  Now now;
  now.system = system_now();
  CertificateEnd end = end_of_certificate(own);
  const auto line = end.take_line(now);
  if (!line) return;
  std::string text = "tls.certificate " + file + ": " + *line;
  if (end.is_over(now.system))
    findings.ended.push_back({Cause::kCertificateExpired, std::move(text)});
  else
    findings.warnings.push_back({Cause::kOther, std::move(text)});
}

// The certificate and the authorities one after the other, so that both are reported.
void check_tls(const ParameterMap& given, HostFindings& findings) {
  const std::string certificate = string_at(given, "tls.certificate");
  const std::string key = string_at(given, "tls.private_key");
  const std::string authorities = string_at(given, "tls.ca");
  std::string problem;
  if (is_readable(certificate) && is_readable(key)) {
    if (const TlsContext own = make_server_tls({certificate, key}, problem))
      check_end(*own, certificate, findings);
    else
      findings.problems.push_back({Cause::kCertificateFiles, "tls: " + problem});
  }
  if (is_readable(authorities) && !make_client_tls({.ca_file = authorities}, problem))
    findings.problems.push_back({Cause::kCertificateFiles, "tls: " + problem});
}

// A server's token file may hold hashes alone, and says so itself.
void check_secrets(const ParameterMap& given, HostFindings& findings) {
  std::vector<const char*> keys{"tls.private_key"};
  if (given.contains("url")) keys.push_back("auth.token_file");
  for (const char* key : keys)
    if (const std::string file = string_at(given, key); is_readable(file))
      if (const std::string readers = who_else_may_read(file); !readers.empty())
        findings.hints.push_back({Cause::kFileReadable, std::string(key) + " " + readers});
}

// An error number of bind(); 0: it would succeed.
int bind_error(const std::string& host, std::uint16_t port) {
  sockaddr_storage at{};
  socklen_t size = 0;
  auto* const v4 = reinterpret_cast<sockaddr_in*>(&at);
  auto* const v6 = reinterpret_cast<sockaddr_in6*>(&at);
  if (::inet_pton(AF_INET, host.c_str(), &v4->sin_addr) == 1) {
    at.ss_family = AF_INET;
    v4->sin_port = htons(port);
    size = sizeof *v4;
  } else if (::inet_pton(AF_INET6, host.c_str(), &v6->sin6_addr) == 1) {
    at.ss_family = AF_INET6;
    v6->sin6_port = htons(port);
    size = sizeof *v6;
  } else {
    return 0;  // an address with a zone, or another spelling
  }
  const int tried = ::socket(at.ss_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (tried < 0) return 0;
  const int on = 1;
  ::setsockopt(tried, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  const int error = ::bind(tried, reinterpret_cast<const sockaddr*>(&at), size) == 0 ? 0 : errno;
  ::close(tried);
  return error;
}

// Why no file can be made in the folder of this one; empty: one can.
std::string folder_problem(const std::string& file) {
  const auto slash = file.rfind('/');
  std::string folder = slash == std::string::npos ? "." : file.substr(0, slash);
  if (folder.empty()) folder = "/";
  struct stat found {};
  if (::stat(folder.c_str(), &found) != 0)
    return "the folder " + folder + ": " + std::strerror(errno);
  if (!S_ISDIR(found.st_mode)) return folder + " is not a folder";
  if (::access(folder.c_str(), W_OK | X_OK) != 0)
    return "the folder " + folder + ": " + std::strerror(errno);
  return {};
}

// The problem that AuditFile::open() would have, found without making the file.
std::string audit_problem(const std::string& file) {
  struct stat found {};
  if (::lstat(file.c_str(), &found) != 0) return folder_problem(file);
  if (!S_ISREG(found.st_mode)) return "it is not a regular file";
  if (::access(file.c_str(), W_OK) != 0) return std::strerror(errno);
  const uid_t user = ::geteuid();
  return user != 0 && user != found.st_uid ? "it belongs to another user" : "";
}

// Empty: it can be written.
std::string unwritable(const char* key, const std::string& file, const std::string& why) {
  return why.empty() ? "" : std::string(key) + ": cannot write " + file + ": " + why;
}

}  // namespace

Failure why_not_listening(const ListenOptions& listen) {
  if (!listen.sockets.empty() || listen.port == 0) return {};
  for (const std::string& address : listen.addresses) {
    const std::string host = address == "*" ? "0.0.0.0" : address;
    const int error = bind_error(host, listen.port);
    const std::string where = host_and_port(address, listen.port) + ": " + std::strerror(error);
    if (error == EADDRINUSE) return {Cause::kPortTaken, where};
    if (error == EACCES) return {Cause::kPortNotPermitted, where};
    if (error == EADDRNOTAVAIL) return {Cause::kAddressNotHere, where};
  }
  return {};
}

Failure why_not_reached(const std::string& address) {
  const bool is_absent = bind_error(address, 0) == EADDRNOTAVAIL;
  return is_absent ? Failure{Cause::kAddressNotHere, address} : Failure{};
}

std::optional<std::uint32_t> listener_at(std::uint16_t port,
                                         const std::vector<std::string>& tables) {
  constexpr const char* kListens = "0A";
  const std::string end = fmt::format(":{:04X}", port);
  for (const std::string& table : tables) {
    std::ifstream in(table);
    for (std::string line; std::getline(in, line);) {
      std::istringstream words(line);
      std::string number, local, remote, state, skipped;
      std::uint32_t user = 0;
      words >> number >> local >> remote >> state >> skipped >> skipped >> skipped >> user;
      if (words && local.ends_with(end) && state == kListens) return user;
    }
  }
  return std::nullopt;
}

Failure why_unreadable(const std::string& file) {
  if (is_readable(file)) return {};
  const int error = errno;
  const std::filesystem::path path = std::filesystem::absolute(file);
  if (error == EACCES) return {Cause::kFileNotPermitted, why_not_permitted(path)};
  if (error != ENOENT && error != ENOTDIR)
    return {Cause::kFileUnreadable, path.string() + ": " + std::strerror(error)};
  const bool is_relative = std::filesystem::path(file).is_relative();
  return {Cause::kFileMissing,
          path.string() + " is missing" +
              (is_relative ? " (a relative path begins in the folder where the program was started)"
                           : "")};
}

std::string who_may_change_rules(const Config& config, const std::vector<std::string>& files) {
  if (!config.auth.strict_modes) return {};
  for (const auto& file : files)
    if (const std::string why = who_else_may_have_changed(file); !why.empty())
      return "the parameter file " + file + ": " + why + "; or strict_modes: false";
  return {};
}

std::string no_longer_regular(const Config& config, const std::vector<std::string>& files) {
  std::error_code failed;
  if (!config.auth.strict_modes) return {};
  for (const auto& file : files)
    if (std::filesystem::exists(file, failed) && !std::filesystem::is_regular_file(file, failed))
      return "the parameter file " + file + " is no regular file any longer";
  return {};
}

HostFindings check_host(const ParameterMap& given) {
  HostFindings findings;
  check_tls(given, findings);
  check_secrets(given, findings);
  if (const std::string file = string_at(given, "audit.file"); !file.empty())
    if (std::string wrong = unwritable("audit.file", file, audit_problem(file)); !wrong.empty())
      findings.problems.push_back({Cause::kFileUnwritable, std::move(wrong)});
  // A new file replaces the status file, so that its folder decides. The bridge runs on without it.
  if (const std::string file = string_at(given, "status_file"); !file.empty())
    if (std::string wrong = unwritable("status_file", file, folder_problem(file)); !wrong.empty())
      findings.warnings.push_back({Cause::kFileUnwritable, std::move(wrong)});
  return findings;
}

}  // namespace connect_bridge
