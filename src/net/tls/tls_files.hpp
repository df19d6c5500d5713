// A TLS context made from files, and made again when these change.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/ports/net_options.hpp"
#include "net/tls/certificate_end.hpp"
#include "net/tls/tls.hpp"

namespace connect_bridge {

// Handshakes that are under way and links that are open keep the context they began with. Files
// that do not fit together, or cannot be read, change nothing. Thread: the loop's.
class TlsFiles {
 public:
  struct News {
    bool used = false;  // the new files; else those before stay
    std::string text;   // what to log
  };

  TlsFiles(const TlsOptions& options, Role role);

  // The context; reads the files if that has not succeeded yet. Null with `problem` set: the file
  // and what is wrong with it.
  TlsContext get(std::string& problem);

  // The one that is in use; null: get() has not succeeded yet.
  [[nodiscard]] const TlsContext& context() const { return context_; }

  // A context of the files as they are now: when one has changed they are read again, and while
  // they cannot be used there is no context.
  TlsContext get_fresh(std::string& problem);

  // Looks at the files, which costs a system call for each; call it once a second. What has changed
  // is read at the second look that finds it so: certificate and key are written one after the
  // other. Files that cannot be used are reported once and tried at each look: the reason may pass.
  std::optional<News> check();

  // Why files that have changed are not used; empty: they are.
  [[nodiscard]] const std::string& problem() const { return problem_; }

  // The end of our own certificate, as it is in use.
  [[nodiscard]] CertificateEnd& certificate() { return certificate_; }
  [[nodiscard]] const CertificateEnd& certificate() const { return certificate_; }

 private:
  using Make = std::function<TlsContext(std::string& problem)>;
  // The metadata of the files: it changes when one is written or replaced.
  using Stamp = std::vector<std::int64_t>;

  [[nodiscard]] Stamp stamp() const;
  void use(TlsContext context);

  std::vector<std::string> files_;
  Make make_;
  TlsContext context_;
  CertificateEnd certificate_;
  Stamp read_;           // of the files that were tried last
  Stamp found_;          // of the last check
  std::string problem_;  // why what has changed cannot be used; empty: it is used
};

}  // namespace connect_bridge
