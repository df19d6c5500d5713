// A process that has no file descriptors left, which passes.
#pragma once

#include <sys/resource.h>

namespace connect_bridge::test {

// While this lives nothing can be opened; what is open stays.
class NoDescriptors {
 public:
  // The sanitizer of undefined behaviour opens pipes for its checks of types, and takes its own
  // failure for the program's.
#if defined(__has_feature)
#if __has_feature(undefined_behavior_sanitizer)
  static constexpr bool kPossible = false;
#else
  static constexpr bool kPossible = true;
#endif
#else
  static constexpr bool kPossible = true;
#endif

  NoDescriptors() {
    ::getrlimit(RLIMIT_NOFILE, &before_);
    const rlimit none{0, before_.rlim_max};
    ::setrlimit(RLIMIT_NOFILE, &none);
  }
  ~NoDescriptors() {
    ::setrlimit(RLIMIT_NOFILE, &before_);
  }
  NoDescriptors(const NoDescriptors&) = delete;
  NoDescriptors& operator=(const NoDescriptors&) = delete;

 private:
  rlimit before_{};
};

}  // namespace connect_bridge::test
