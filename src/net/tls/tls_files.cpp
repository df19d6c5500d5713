#include "net/tls/tls_files.hpp"

#include <openssl/x509.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstdlib>
#include <utility>

namespace connect_bridge {
namespace {

// The file in which OpenSSL finds the authorities that the system trusts.
std::string system_store() {
  const char* const given = std::getenv(X509_get_default_cert_file_env());
  return given != nullptr ? given : X509_get_default_cert_file();
}

std::string who_may_change(const TlsOptions& options) {
  if (!options.distrusted) return {};
  for (const auto& file : {options.private_key_file, options.certificate_file, options.ca_file})
    if (std::string why = file.empty() ? "" : options.distrusted(file); !why.empty()) return why;
  return {};
}

}  // namespace

TlsFiles::TlsFiles(const TlsOptions& options, Role role)
    : files_({options.certificate_file, options.private_key_file, options.ca_file}),
      make_([options, make = role == Role::kServer ? make_server_tls
                                                   : make_client_tls](std::string& problem) {
        problem = who_may_change(options);
        return problem.empty() ? make(options, problem) : nullptr;
      }) {
  if (role == Role::kClient && options.ca_file.empty()) files_.back() = system_store();
  std::erase(files_, "");
}

TlsFiles::Stamp TlsFiles::stamp() const {
  Stamp stamp;
  for (const std::string& file : files_) {
    struct stat facts {};
    if (::stat(file.c_str(), &facts) != 0) {
      stamp.push_back(errno);
      continue;
    }
    for (const auto number :
         {static_cast<std::int64_t>(facts.st_dev), static_cast<std::int64_t>(facts.st_ino),
          static_cast<std::int64_t>(facts.st_size), std::int64_t{facts.st_mtim.tv_sec},
          std::int64_t{facts.st_mtim.tv_nsec}, std::int64_t{facts.st_ctim.tv_sec},
          std::int64_t{facts.st_ctim.tv_nsec}})
      stamp.push_back(number);
  }
  return stamp;
}

TlsContext TlsFiles::get(std::string& problem) {
  if (context_) return context_;
  read_ = found_ = stamp();  // before reading: a change meanwhile is noticed later
  use(make_(problem));
  return context_;
}

void TlsFiles::use(TlsContext context) {
  context_ = std::move(context);
  certificate_ = context_ ? end_of_certificate(*context_) : CertificateEnd{};
}

TlsContext TlsFiles::get_fresh(std::string& problem) {
  if (context_ && stamp() != read_) context_.reset();
  return get(problem);
}

std::optional<TlsFiles::News> TlsFiles::check() {
  if (!context_) return std::nullopt;
  Stamp now = stamp();
  const bool still = now == found_;
  found_ = std::move(now);
  const bool again = found_ == read_;
  if (!still || (again && problem_.empty())) return std::nullopt;
  read_ = found_;
  std::string problem;
  TlsContext made = make_(problem);
  if (problem == std::exchange(problem_, problem) && again) return std::nullopt;
  if (!made)
    return News{false, "TLS: files have changed but cannot be used, the former ones stay in use: " +
                           problem};
  use(std::move(made));
  const std::string own = certificate_text(*context_);
  return News{true,
              "TLS: files have changed and were read again" + (own.empty() ? "" : "; " + own)};
}

}  // namespace connect_bridge
