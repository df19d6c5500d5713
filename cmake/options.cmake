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

# Several sources are compiled as one, because most of the time goes into their headers: all of them in less than half of
# the time, one that has changed in three times as much. -DCMAKE_UNITY_BUILD=OFF compiles each by itself. What is declared
# in one file is then known in others: tools/setup/syntax.py shows of src whether each file includes what it needs.
set(CMAKE_UNITY_BUILD ON CACHE BOOL "Compile several sources as one")
set(CMAKE_UNITY_BUILD_BATCH_SIZE 12 CACHE STRING "How many sources are compiled as one")

find_program(CCACHE ccache)
if(CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_C_COMPILER_LAUNCHER ${CCACHE})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()

add_library(connect_options INTERFACE)
target_include_directories(connect_options INTERFACE
  $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/src> $<BUILD_INTERFACE:${CMAKE_CURRENT_BINARY_DIR}/generated>)
# A message names a file by its place in the repository. So to a compiler cache it is the same in every folder.
target_compile_options(connect_options INTERFACE "-fmacro-prefix-map=${CMAKE_CURRENT_SOURCE_DIR}/=")
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

# A program needs the libraries that it uses: the relay has no pictures.
add_link_options(-Wl,--as-needed)
# The libraries of a prefix made from wheels name libraries that only an interpreter loads.
if(DEFINED ENV{CONNECT_BRIDGE_OWN_PREFIX})
  add_link_options(-Wl,--allow-shlib-undefined)
endif()

# version.hpp
set(CONNECT_SOURCE "source" CACHE STRING "What the build is of, as --version tells: a package's version or a commit")
set(CONNECT_BUILD "${CONNECT_SOURCE}, ${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}, ${CMAKE_BUILD_TYPE}")
if(CONNECT_ROS AND DEFINED ENV{ROS_DISTRO})
  string(APPEND CONNECT_BUILD ", ROS 2 $ENV{ROS_DISTRO}")
endif()
configure_file("${CMAKE_CURRENT_LIST_DIR}/version.hpp.in" "${CMAKE_CURRENT_BINARY_DIR}/generated/version.hpp" @ONLY)

# status_page.hpp: the page of src/ops/status/status_page.html as a text in the program
set(page "${CMAKE_CURRENT_SOURCE_DIR}/src/ops/status/status_page.html")
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${page}")
file(READ "${page}" CONNECT_STATUS_PAGE)
configure_file("${CMAKE_CURRENT_LIST_DIR}/status_page.hpp.in" "${CMAKE_CURRENT_BINARY_DIR}/generated/status_page.hpp" @ONLY)
