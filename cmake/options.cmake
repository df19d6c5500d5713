# Compiler and linker options of every target.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE RelWithDebInfo CACHE STRING "" FORCE)
endif()
# Lines in a backtrace are enough; full debug information doubles build time and size.
set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O2 -g1 -DNDEBUG")

find_program(CCACHE ccache)
if(CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_C_COMPILER_LAUNCHER ${CCACHE})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()

add_library(connect_options INTERFACE)
target_include_directories(connect_options INTERFACE
  $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/src> $<BUILD_INTERFACE:${CMAKE_CURRENT_BINARY_DIR}/generated>)
target_compile_options(connect_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual
  -Wextra-semi -Wimplicit-fallthrough)
if(CONNECT_WERROR)
  target_compile_options(connect_options INTERFACE -Werror)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # These depend on the optimizer, and GCC 11 and 12 report them inside their own std::string and std::variant.
    target_compile_options(connect_options INTERFACE -Wno-restrict -Wno-stringop-overflow -Wno-stringop-overread
      -Wno-array-bounds -Wno-maybe-uninitialized)
  endif()
endif()

if(CONNECT_SANITIZE)
  add_compile_options(-fsanitize=${CONNECT_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer -O1 -g1)
  add_link_options(-fsanitize=${CONNECT_SANITIZE})
  if(CONNECT_SANITIZE MATCHES "thread")
    # The thread sanitizer does not know fences; Asio's handlers are ordered by its mutex as well.
    add_compile_definitions(BOOST_ASIO_DISABLE_FENCED_BLOCK)
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      add_compile_options(-Wno-tsan)
    endif()
  endif()
elseif(NOT CMAKE_BUILD_TYPE STREQUAL "Debug")
  add_compile_options(-fstack-protector-strong -U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=2 -D_GLIBCXX_ASSERTIONS)
  add_link_options(-Wl,-z,relro -Wl,-z,now)
endif()
if(CONNECT_FUZZ)
  if(NOT CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    message(FATAL_ERROR "CONNECT_FUZZ needs clang: -DCMAKE_CXX_COMPILER=clang++")
  endif()
  add_compile_options(-fsanitize=fuzzer-no-link)
endif()

# The libraries of a prefix made from wheels name libraries that only an interpreter loads.
if(DEFINED ENV{CONNECT_BRIDGE_OWN_PREFIX})
  add_link_options(-Wl,--as-needed -Wl,--allow-shlib-undefined)
endif()

# version.hpp
configure_file("${CMAKE_CURRENT_LIST_DIR}/version.hpp.in" "${CMAKE_CURRENT_BINARY_DIR}/generated/version.hpp" @ONLY)

# connect_precompiled(<target> [<header>...]): what its files include most is parsed once. Only in the builds with a
# sanitizer: the plain build shows that each file includes what it needs, and a compiler cache does not keep what is made so.
function(connect_precompiled name)
  if(CONNECT_SANITIZE)
    target_precompile_headers(${name} PRIVATE <chrono> <functional> <map> <memory> <optional> <set> <string> <utility> <variant>
      <vector>
      ${ARGN})
  endif()
endfunction()
