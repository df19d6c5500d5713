# Static libraries from the folders of src, which may use each other as the README of each folder says (tools/tidy checks it).

# connect_layer(<target> <folders> [<library>...]): connect_<target> from src/<folder> and the folders in it, for each of the
# folders (a list in one argument); it may use the given libraries. A layer without files is left out.
function(connect_layer target folders)
  set(sources)
  foreach(folder ${folders})
    file(GLOB found CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/src/${folder}/*.cpp"
      "${CMAKE_CURRENT_SOURCE_DIR}/src/${folder}/*/*.cpp")
    list(APPEND sources ${found})
  endforeach()
  if(sources)
    # Those that include Boost.Beast are compiled as one: it takes longer than all else in them.
    set(with_beast ${sources})
    list(FILTER with_beast INCLUDE REGEX "/net/[a-z]+/(accept|dial|network|socket|status_door|way)\\.cpp$")
    list(REMOVE_ITEM sources ${with_beast} "")
    add_library(connect_${target} STATIC ${with_beast} ${sources})
    target_link_libraries(connect_${target} PUBLIC connect_options ${ARGN})
    # With the address sanitizer, code that is not optimized takes half the time to compile, but runs several times as long:
    # too long for what the simulator and the fuzzers run most.
    if(CONNECT_SANITIZE MATCHES "address" AND target MATCHES "^(net|ros|run|ops|pairing|ctl)$")
      target_compile_options(connect_${target} PRIVATE -O0)
    endif()
  endif()
endfunction()

# connect_available(<result> <target>...): those of the targets that exist.
function(connect_available result)
  set(found)
  foreach(target ${ARGN})
    if(TARGET ${target})
      list(APPEND found ${target})
    endif()
  endforeach()
  set(${result} ${found} PARENT_SCOPE)
endfunction()

find_package(Threads REQUIRED)
find_package(OpenSSL REQUIRED)
find_package(Boost 1.74 REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(fmt REQUIRED)
find_package(yaml-cpp REQUIRED)
find_path(LZ4_INCLUDE lz4.h REQUIRED)
find_library(LZ4_LIBRARY lz4 REQUIRED)
find_path(ZSTD_INCLUDE zstd.h REQUIRED)
find_library(ZSTD_LIBRARY zstd REQUIRED)
if(CONNECT_VIDEO)
  find_package(PkgConfig REQUIRED)
  pkg_check_modules(VPX IMPORTED_TARGET vpx>=1.8)
  if(NOT VPX_FOUND)
    message(FATAL_ERROR "libvpx is missing: install libvpx-dev, or leave pictures out: -DCONNECT_VIDEO=OFF")
  endif()
  pkg_check_modules(TURBOJPEG IMPORTED_TARGET libturbojpeg>=2.1)
  if(NOT TURBOJPEG_FOUND)
    message(FATAL_ERROR "libturbojpeg is missing: install libturbojpeg0-dev, or leave pictures out: -DCONNECT_VIDEO=OFF")
  endif()
endif()

add_library(connect_boost INTERFACE)
target_include_directories(connect_boost SYSTEM INTERFACE ${Boost_INCLUDE_DIRS})
# Boost.System is header-only since 1.69; Asio's old interfaces stay out.
target_compile_definitions(connect_boost INTERFACE BOOST_ERROR_CODE_HEADER_ONLY BOOST_ASIO_NO_DEPRECATED)

# It wants another view of OpenSSL's headers.
set_source_files_properties("${CMAKE_CURRENT_SOURCE_DIR}/src/core/base/sha256.cpp" PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
# The flow of messages over one byte stream stands alone: it knows neither links nor ROS.
connect_layer(flow "core/base;core/wire;core/compress;core/media;core/pacing;core/flow" ${LZ4_LIBRARY} ${ZSTD_LIBRARY} nlohmann_json::nlohmann_json
  fmt::fmt OpenSSL::Crypto)
# Its loops over colours are what it does apart from libvpx: the compiler makes several pixels at once of them.
set_source_files_properties("${CMAKE_CURRENT_SOURCE_DIR}/src/core/video/yuv.cpp" PROPERTIES COMPILE_OPTIONS -O3
  SKIP_UNITY_BUILD_INCLUSION ON)
connect_layer(video core/video connect_flow)
if(CONNECT_VIDEO)
  target_compile_definitions(connect_video PRIVATE CONNECT_VIDEO)
  target_link_libraries(connect_video PRIVATE PkgConfig::VPX PkgConfig::TURBOJPEG)
endif()
connect_layer(core "core/policy;core/ports;core/jobs;core/connection;core/link;core/graph;core/offers;core/topics;core/mirrors;core/services;core/side;core/driving"
  connect_video connect_flow)
connect_layer(config config connect_core yaml-cpp)
connect_layer(login access/login connect_core connect_boost OpenSSL::SSL OpenSSL::Crypto Threads::Threads yaml-cpp
  ${CMAKE_DL_LIBS})
if(TARGET connect_login)
  target_include_directories(connect_login PUBLIC "${CMAKE_CURRENT_SOURCE_DIR}/include")
endif()
# It includes <linux/tcp.h>, which does not go with the C library's header of that name.
set_source_files_properties("${CMAKE_CURRENT_SOURCE_DIR}/src/net/tcp/traffic.cpp" PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
connect_layer(net net connect_core connect_boost OpenSSL::SSL OpenSSL::Crypto Threads::Threads)
set(without_ros connect_net connect_login connect_config connect_core connect_video connect_flow)
connect_available(below ${without_ros})
connect_layer(plugins access/plugins ${below} connect_boost)
connect_layer(relay relay ${below} connect_boost)

# A login plugin is src/apps/auth_<method>.cpp: a library beside the programs, with its own copy of what it needs.
set(plugins)
foreach(method jwt service)
  set(plugin auth_${method})
  list(APPEND plugins ${plugin})
  add_library(${plugin} MODULE "src/apps/${plugin}.cpp")
  target_link_libraries(${plugin} PRIVATE connect_plugins)
  target_link_options(${plugin} PRIVATE LINKER:--exclude-libs,ALL)
  set_target_properties(${plugin} PROPERTIES PREFIX "" LIBRARY_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}" VISIBILITY_INLINES_HIDDEN ON)
endforeach()

# The relay is without ROS.
if(TARGET connect_relay AND EXISTS "${CMAKE_CURRENT_SOURCE_DIR}/src/apps/relay.cpp")
  add_executable(relay "src/apps/relay.cpp")
  target_link_libraries(relay PRIVATE connect_relay ${below} connect_options)
endif()

if(CONNECT_ROS)
  include(ros)
  connect_layer(ros ros connect_core connect_ros_packages Threads::Threads yaml-cpp ${CMAKE_DL_LIBS})
  connect_available(below connect_ros ${without_ros})
  connect_layer(pairing access/pairing ${below})
  connect_layer(ops ops ${below} connect_boost Threads::Threads)
  connect_available(below connect_ops connect_pairing ${below})
  connect_layer(run run ${below} connect_boost Threads::Threads)
  connect_layer(ctl ctl connect_run ${below})

  foreach(app server client ctl)
    if(EXISTS "${CMAKE_CURRENT_SOURCE_DIR}/src/apps/${app}.cpp")
      set(own connect_run)
      if(app STREQUAL "ctl")
        set(own connect_ctl connect_run)
      endif()
      add_executable(${app} "src/apps/${app}.cpp")
      connect_available(parts ${own} ${below})
      target_link_libraries(${app} PRIVATE ${parts} connect_options)
    endif()
  endforeach()
endif()
