# One static library per layer, from every source file in its folder; a layer without files is left out.
# Arrows: apps -> run -> {ros, net, auth, config} -> core; apps -> {plugins, relay} -> {net, auth, config}.

# connect_layer(<name> [<library>...]): connect_<name> from src/<name>, which may use the given libraries.
function(connect_layer name)
  file(GLOB sources CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/src/${name}/*.cpp"
    "${CMAKE_CURRENT_SOURCE_DIR}/src/${name}/*/*.cpp")
  if(sources)
    # Those that include Boost.Beast are compiled as one: it takes longer than all else in them.
    set(with_beast ${sources})
    list(FILTER with_beast INCLUDE REGEX "/net/(accept|dial|network|socket|status_door|way)\\.cpp$")
    list(REMOVE_ITEM sources ${with_beast} "")
    add_library(connect_${name} STATIC ${with_beast} ${sources})
    target_link_libraries(connect_${name} PUBLIC connect_options ${ARGN})
    # With the address sanitizer, code that is not optimized takes half the time to compile, but runs several times as long:
    # too long for what the simulator and the fuzzers run most.
    if(CONNECT_SANITIZE MATCHES "address" AND name MATCHES "^(net|ros|run)$")
      target_compile_options(connect_${name} PRIVATE -O0)
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

add_library(connect_boost INTERFACE)
target_include_directories(connect_boost SYSTEM INTERFACE ${Boost_INCLUDE_DIRS})
# Boost.System is header-only since 1.69; Asio's old interfaces stay out.
target_compile_definitions(connect_boost INTERFACE BOOST_ERROR_CODE_HEADER_ONLY BOOST_ASIO_NO_DEPRECATED)

# It wants another view of OpenSSL's headers.
set_source_files_properties("${CMAKE_CURRENT_SOURCE_DIR}/src/core/base/sha256.cpp" PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
connect_layer(core ${LZ4_LIBRARY} ${ZSTD_LIBRARY} nlohmann_json::nlohmann_json fmt::fmt OpenSSL::Crypto)
connect_layer(config connect_core yaml-cpp)
connect_layer(auth connect_core connect_boost OpenSSL::SSL OpenSSL::Crypto Threads::Threads yaml-cpp ${CMAKE_DL_LIBS})
if(TARGET connect_auth)
  target_include_directories(connect_auth PUBLIC "${CMAKE_CURRENT_SOURCE_DIR}/include")
endif()
# It includes <linux/tcp.h>, which does not go with the C library's header of that name.
set_source_files_properties("${CMAKE_CURRENT_SOURCE_DIR}/src/net/traffic.cpp" PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
connect_layer(net connect_core connect_boost OpenSSL::SSL OpenSSL::Crypto Threads::Threads)
connect_available(below connect_net connect_auth connect_config connect_core)
connect_layer(plugins ${below} connect_boost)
connect_layer(relay ${below} connect_boost)

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
  connect_layer(ros connect_core connect_ros_packages Threads::Threads yaml-cpp ${CMAKE_DL_LIBS})
  connect_available(below connect_ros connect_net connect_auth connect_config connect_core)
  connect_layer(run ${below} connect_boost Threads::Threads)
  connect_available(below connect_run ${below})

  # A program is src/apps/<name>.cpp with all src/apps/<name>_*.cpp.
  foreach(app server client ctl)
    if(EXISTS "${CMAKE_CURRENT_SOURCE_DIR}/src/apps/${app}.cpp")
      file(GLOB parts CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/src/apps/${app}_*.cpp")
      add_executable(${app} "src/apps/${app}.cpp" ${parts})
      target_link_libraries(${app} PRIVATE ${below} connect_options)
    endif()
  endforeach()
endif()
