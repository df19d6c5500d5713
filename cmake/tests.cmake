# Tests: each kind is made when its files and the layers it needs exist.
find_package(GTest REQUIRED)
find_package(Python3 REQUIRED COMPONENTS Interpreter)
set(tests "${CMAKE_CURRENT_SOURCE_DIR}/tests")
# A test that computes takes so many of ctest's places, one that waits for others takes one: make gives three places
# to a processor.
set(slots 3)
set(CONNECT_SIM_SEEDS 1000 CACHE STRING "Scenarios of the simulator in a test run")

# connect_quickly_compiled(<program>): for a program that takes far longer to compile than to run;
# the tested code is optimized nevertheless. Without optimization GCC needs a third less, clang with
# the address sanitizer half.
function(connect_quickly_compiled name)
  target_compile_options(${name} PRIVATE "SHELL:-O0 -U_FORTIFY_SOURCE")
  # Half of what is left are the headers.
  set_target_properties(${name} PROPERTIES UNITY_BUILD_BATCH_SIZE 24)
endfunction()

# connect_gtest(<program> LABEL <label> SHARDS <n> PROCESSORS <places> [FILTER <tests>] [SERIAL] [ENVIRONMENT <variables>]):
# n entries of ctest, each an n-th of the tests in one process: to start a program takes as long as most tests do.
function(connect_gtest name)
  cmake_parse_arguments(PARSE_ARGV 1 of "SERIAL" "LABEL;SHARDS;PROCESSORS;FILTER" "ENVIRONMENT")
  string(MAKE_C_IDENTIFIER "${name}${of_FILTER}" entry)
  if(NOT of_FILTER)
    set(of_FILTER "*")  # an empty filter has no tests
  endif()
  math(EXPR last "${of_SHARDS} - 1")
  foreach(shard RANGE ${last})
    add_test(NAME ${entry}_${shard} COMMAND ${name} --gtest_brief=1 --gtest_filter=${of_FILTER})
    set_tests_properties(${entry}_${shard} PROPERTIES LABELS ${of_LABEL} PROCESSORS ${of_PROCESSORS} RUN_SERIAL ${of_SERIAL}
      TIMEOUT 900 FAIL_REGULAR_EXPRESSION "Running 0 tests|0 tests from 0"
      ENVIRONMENT "GTEST_TOTAL_SHARDS=${of_SHARDS};GTEST_SHARD_INDEX=${shard};${of_ENVIRONMENT}")
  endforeach()
endfunction()

# unit: tests/unit mirrors src; the folders of src/core stand there by themselves. What stands alone has a program of its own:
# flow_tests needs the flow alone, core_tests the core. Neither has threads, so the thread sanitizer has nothing to look for in
# them, and mutants of the core need no other. Mutants of access and net have a tree with the tests of these alone: they come
# first, so that there mostly the same files are compiled as one, and a compiler cache has them. Files without _test in their
# name are shared by the tests.
file(GLOB_RECURSE core_tests CONFIGURE_DEPENDS "${tests}/unit/*.cpp")
set(unit_tests)
foreach(folder access/login net config access/plugins relay ros access/pairing ops run ctl)
  set(of_folder ${core_tests})
  list(FILTER of_folder INCLUDE REGEX "/tests/unit/${folder}/")
  list(FILTER core_tests EXCLUDE REGEX "/tests/unit/${folder}/")
  get_filename_component(layer "${folder}" NAME)
  if(TARGET connect_${layer})
    list(APPEND unit_tests ${of_folder})
  endif()
endforeach()
set(flow_tests ${core_tests})
list(FILTER flow_tests INCLUDE REGEX "/tests/unit/(base|wire|compress|media|video|pacing|flow)/")
list(FILTER core_tests EXCLUDE REGEX "/tests/unit/(base|wire|compress|media|video|pacing|flow)/")
set(shared ${flow_tests})
list(FILTER shared EXCLUDE REGEX "_test\\.cpp$")
list(APPEND core_tests ${shared})
# The only file that knows where the repository is: all others are the same to a compiler cache wherever they are.
set(source_text "${tests}/unit/source_text.cpp")
set_source_files_properties("${source_text}" PROPERTIES COMPILE_DEFINITIONS CONNECT_SOURCE_DIR="${CMAKE_CURRENT_SOURCE_DIR}")
list(APPEND flow_tests "${source_text}")
if(unit_tests)
  list(APPEND unit_tests "${source_text}")
endif()

# A path in virtual time: without optimization two thirds of what the core's tests compute.
set_source_files_properties("${tests}/unit/flow/path_bed.cpp" PROPERTIES COMPILE_OPTIONS -O2 SKIP_UNITY_BUILD_INCLUSION ON)
# The same for pictures, which are drawn.
set_source_files_properties("${tests}/unit/video/moving_scene.cpp" PROPERTIES COMPILE_OPTIONS -O2 SKIP_UNITY_BUILD_INCLUSION ON)

# connect_unit_tests(<program> <shards> <places> <layer>...): from the sources in the variable of that name.
function(connect_unit_tests name shards places)
  connect_available(layers ${ARGN})
  add_executable(${name} ${${name}})
  target_link_libraries(${name} PRIVATE ${layers} connect_options GTest::gmock GTest::gtest_main)
  target_include_directories(${name} PRIVATE "${tests}")
  connect_quickly_compiled(${name})
  connect_gtest(${name} LABEL unit SHARDS ${shards} PROCESSORS ${places})
endfunction()

# Login plugins: the example, one that misbehaves, one of another version of the interface, one that has no thread, and one
# that shows that it was loaded.
function(connect_test_plugin name source)
  add_library(${name} MODULE "${CMAKE_CURRENT_SOURCE_DIR}/${source}")
  target_include_directories(${name} PRIVATE "${CMAKE_CURRENT_SOURCE_DIR}/include")
  target_compile_options(${name} PRIVATE -Wall -Wextra)
  set_target_properties(${name} PROPERTIES PREFIX "" LIBRARY_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/plugins")
endfunction()

if(TARGET connect_core)
  connect_unit_tests(flow_tests 2 ${slots} connect_video connect_flow)
  if(CONNECT_VIDEO)
    target_link_libraries(flow_tests PRIVATE PkgConfig::TURBOJPEG)
    set_source_files_properties("${tests}/unit/video/jpeg_test.cpp" PROPERTIES COMPILE_DEFINITIONS CONNECT_VIDEO SKIP_UNITY_BUILD_INCLUSION ON)
  endif()
  connect_unit_tests(core_tests 3 ${slots} connect_core)
endif()
if(unit_tests)
  connect_test_plugin(auth_plugin examples/auth_plugin.c)
  connect_test_plugin(odd_plugin tests/plugins/odd_plugin.cpp)
  connect_test_plugin(late_plugin tests/plugins/odd_plugin.cpp)
  target_compile_definitions(late_plugin PRIVATE ODD_ABI=3)
  connect_test_plugin(idle_plugin tests/plugins/odd_plugin.cpp)
  target_compile_definitions(idle_plugin PRIVATE ODD_THREADS=0)
  connect_test_plugin(marking_plugin tests/plugins/odd_plugin.cpp)
  target_compile_definitions(marking_plugin PRIVATE ODD_MARKS)
  set_source_files_properties("${tests}/unit/access/login/plugin_login_test.cpp" "${tests}/unit/ctl/check_test.cpp" PROPERTIES
    COMPILE_DEFINITIONS CONNECT_PLUGINS="${CMAKE_BINARY_DIR}/plugins/")
  # They wait for sockets, files and threads: 75 s with 5 s of processor time. With a sanitizer they compute.
  set(places 1)
  if(CONNECT_SANITIZE)
    set(places ${slots})
  endif()
  connect_unit_tests(unit_tests 6 ${places} connect_ctl connect_run connect_ops connect_pairing connect_ros connect_plugins connect_relay ${without_ros})
  add_dependencies(unit_tests ${plugins} auth_plugin odd_plugin late_plugin idle_plugin marking_plugin)
endif()

# rule_tuples: the rules against the simulator's second implementation of them.
set(second_opinion "${tests}/model/rule_opinions.cpp" "${tests}/sim/rights.cpp")
set(CONNECT_RULE_TUPLES 300000 CACHE STRING "Random tuples that the rules are tested with")
if(TARGET connect_core AND EXISTS "${tests}/model/rule_tuples.cpp")
  add_executable(rule_tuples "${tests}/model/rule_tuples.cpp" ${second_opinion})
  target_link_libraries(rule_tuples PRIVATE connect_core connect_options)
  target_include_directories(rule_tuples PRIVATE "${tests}")
  add_test(NAME rule_tuples COMMAND rule_tuples --tuples ${CONNECT_RULE_TUPLES})
  set_tests_properties(rule_tuples PROPERTIES LABELS model TIMEOUT 1800)
endif()

# sim: a program of its own that takes seeds, and every processor.
file(GLOB sim_sources CONFIGURE_DEPENDS "${tests}/sim/*.cpp")
if(sim_sources AND TARGET connect_core)
  add_executable(sim ${sim_sources})
  target_link_libraries(sim PRIVATE connect_core connect_options Threads::Threads)
  target_include_directories(sim PRIVATE "${tests}")
  add_test(NAME sim COMMAND sim --seeds ${CONNECT_SIM_SEEDS})
  add_test(NAME sim_twins COMMAND sim --twins --seeds ${CONNECT_SIM_SEEDS})
  add_test(NAME sim_uses COMMAND sim --uses)
  # Always the same: of drawn ones some three in a hundred miss a bound by little (docs/simulator.md).
  add_test(NAME sim_driving COMMAND sim --driving --seeds 300)
  add_test(NAME sim_thin COMMAND sim --thin --seeds 245..340)
  # It weighs the heap, which is another one under a sanitizer.
  if(NOT CONNECT_SANITIZE)
    add_test(NAME sim_day COMMAND sim --day --seed 1)
    set_tests_properties(sim_day PROPERTIES LABELS sim TIMEOUT 1800)
  endif()
  set_tests_properties(sim sim_twins sim_uses sim_thin sim_driving PROPERTIES LABELS sim TIMEOUT 1800 RUN_SERIAL ON)
endif()

# fuzz: one libFuzzer program per file.
if(CONNECT_FUZZ)
  file(GLOB fuzz_sources CONFIGURE_DEPENDS "${tests}/fuzz/fuzz_*.cpp")
  connect_available(layers connect_plugins connect_relay ${without_ros})
  add_custom_target(fuzz_targets)
  foreach(source ${fuzz_sources})
    get_filename_component(name "${source}" NAME_WE)
    add_executable(${name} "${source}")
    target_link_libraries(${name} PRIVATE ${layers} connect_options -fsanitize=fuzzer)
    target_include_directories(${name} PRIVATE "${tests}")
    set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/fuzz")
    add_dependencies(fuzz_targets ${name})
  endforeach()
  target_sources(fuzz_rules PRIVATE ${second_opinion})
endif()

# ros: the gateway with real rcl. Files without _test in their name are shared by the tests.
file(GLOB ros_sources CONFIGURE_DEPENDS "${tests}/ros/*.cpp")
if(ros_sources AND TARGET connect_ros)
  add_executable(ros_tests ${ros_sources} "${source_text}")
  target_link_libraries(ros_tests PRIVATE connect_ros connect_core connect_options GTest::gmock GTest::gtest_main)
  target_include_directories(ros_tests PRIVATE "${tests}")
  connect_quickly_compiled(ros_tests)
  # Those that measure what something costs run by themselves.
  set(measure "*Cost*:*Cheap*")
  set(local ENVIRONMENT "ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST")
  connect_gtest(ros_tests LABEL ros SHARDS 3 PROCESSORS 1 FILTER "-${measure}" ${local})
  connect_gtest(ros_tests LABEL ros SHARDS 1 PROCESSORS 1 FILTER "${measure}" SERIAL ${local})
endif()

# bench: one program per file; core_bench needs no ROS.
if(TARGET connect_core AND EXISTS "${tests}/bench/core_bench.cpp")
  add_executable(core_bench "${tests}/bench/core_bench.cpp" "${tests}/unit/video/moving_scene.cpp")
  target_link_libraries(core_bench PRIVATE connect_core connect_options)
  target_include_directories(core_bench PRIVATE "${tests}")
  set_target_properties(core_bench PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/bench")
endif()
set(bench_sources)
if(CONNECT_ROS)
  file(GLOB bench_sources CONFIGURE_DEPENDS "${tests}/bench/*.cpp")
  list(REMOVE_ITEM bench_sources "${tests}/bench/core_bench.cpp")
  if(NOT CONNECT_VIDEO)
    list(REMOVE_ITEM bench_sources "${tests}/bench/pictures.cpp")
  endif()
endif()
connect_available(layers connect_ros_packages connect_ctl connect_run connect_ops connect_pairing connect_ros ${without_ros})
foreach(source ${bench_sources})
  get_filename_component(name "${source}" NAME_WE)
  add_executable(${name} "${source}")
  target_link_libraries(${name} PRIVATE ${layers} connect_options connect_boost Threads::Threads)
  target_include_directories(${name} PRIVATE "${tests}")
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/bench")
endforeach()
if(TARGET pictures)
  target_link_libraries(pictures PRIVATE PkgConfig::TURBOJPEG)
endif()

# Python tests: the programs with real nodes, and a peer written from the specification alone. A ctest entry per file. A file
# that says "PARTS = n" is divided into so many; what is marked "alone" is an entry of its own: these come last, no
# more of them at a time than there are processors (-1: after all whose time is known; -2: the short ones last).
function(connect_python_test name file)
  cmake_parse_arguments(PARSE_ARGV 2 test "" "COST;PROCESSORS" "ARGS;ENV")
  add_test(NAME ${name} COMMAND ${Python3_EXECUTABLE} -B -m pytest "${file}" ${test_ARGS}
    WORKING_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}")
  set(environment CONNECT_BUILD_DIR=${CMAKE_BINARY_DIR} CONNECT_SANITIZE=${CONNECT_SANITIZE}
    ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST ${test_ENV})
  set_tests_properties(${name} PROPERTIES LABELS e2e TIMEOUT 600 COST ${test_COST} PROCESSORS ${test_PROCESSORS}
    ENVIRONMENT "${environment}")
endfunction()

if(TARGET server AND TARGET client)
  file(GLOB e2e CONFIGURE_DEPENDS "${tests}/e2e/test_*.py" "${tests}/peer/test_*.py")
  foreach(file ${e2e})
    string(REGEX REPLACE ".*/([a-z0-9]+)/test_([a-z0-9_]+)\\.py$" "\\1_\\2" name "${file}")
    file(READ "${file}" text)
    if(text MATCHES "\npytestmark = pytest.mark.alone\n")
      connect_python_test(${name} "${file}" PROCESSORS ${slots} COST -1)
      continue()
    endif()
    set(others)
    if(text MATCHES "\n@pytest.mark.alone\n")
      connect_python_test(${name}_alone "${file}" PROCESSORS ${slots} COST -2 ARGS -m alone)
      set(others -m "not alone")
    endif()
    # The long ones first; later ctest knows how long each took.
    set(cost 20)
    if(text MATCHES "\n@pytest.mark.slow\n")
      set(cost 60)
    endif()
    set(parts 1)
    if(text MATCHES "\nPARTS = ([0-9]+)")
      set(parts ${CMAKE_MATCH_1})
    endif()
    foreach(part RANGE 1 ${parts})
      set(suffix)
      if(parts GREATER 1)
        set(suffix _${part})
      endif()
      connect_python_test(${name}${suffix} "${file}" PROCESSORS 1 COST ${cost} ARGS ${others} --part ${part}/${parts})
    endforeach()
  endforeach()
  # Once more with a bridge that lacks the packages of the messages (tests/e2e/lacking.py). Not what the type of a message
  # makes no difference to: parameters (rcl_interfaces is always there), two_clients (which of them feeds goes by ids), cut
  # (latched has mirrors that are made anew), and of the others what concerns links and processes alone.
  set(lacking_of_actions "not killed")
  set(lacking_of_latched "not short_cut")
  set(lacking_of_listeners "it_has_a_type")
  set(lacking_of_call_churn "server_restarted")
  foreach(name topics services actions latched nodes listeners call_churn)
    set(of_these)
    if(lacking_of_${name})
      set(of_these -k "${lacking_of_${name}}")
    endif()
    connect_python_test(e2e_${name}_lacking "${tests}/e2e/test_${name}.py" PROCESSORS 1 COST 60 ENV CONNECT_LACKING=all
      ARGS -m "not alone" ${of_these})
  endforeach()
endif()
