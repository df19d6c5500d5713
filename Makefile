# make builds the programs, make test everything, from a fresh clone; make help lists the rest.
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
MAKEFLAGS += --no-print-directory
.DEFAULT_GOAL := build

BUILD ?= build
SEEDS ?= 1000
SECONDS_OF_FUZZ := $(if $(filter command line environment,$(origin SECONDS)),$(SECONDS),60)
CMAKE_ARGS ?=
JOBS ?= $(shell nproc)
TARGETS ?=
export JOBS TARGETS
PREFIX := $(or $(CONNECT_BRIDGE_PREFIX),kilted)

# env.sh reads BUILD and CONNECT_BRIDGE_PREFIX, and is made for shells without -u.
in_env = set +u; BUILD="$(BUILD)" CONNECT_BRIDGE_PREFIX="$(PREFIX)"; export BUILD CONNECT_BRIDGE_PREFIX; . ./env.sh; set -u;
compile = tools/setup/build.sh "$(1)" $(2) $(CMAKE_ARGS)
# Tests that compute take three places, those that wait take one (cmake/tests.cmake).
places = $$((3 * JOBS))
# Tests with real nodes depend on the load of the machine: a second try is allowed, and shown in the output.
ctest = tools/harness/middleware.py ctest --test-dir "$(1)" --output-on-failure --no-tests=error --no-label-summary --repeat until-pass:2 $(2)
clang_tools = -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++
# A comma would end an argument of call.
comma := ,
asan_compile = $(call compile,$(BUILD)-asan,$(clang_tools) -DCONNECT_FUZZ=ON -DCONNECT_SANITIZE=address$(comma)undefined)
# The middleware is not built with the thread sanitizer: what happens only inside it is not reported.
tsan_options = ignore_noninstrumented_modules=1 halt_on_error=1 second_deadlock_stack=1

.PHONY: help setup packages prefix prefix-jazzy rmw-cyclonedds rmw-zenoh build all test sim bench bench-wan fuzz tls-scan deb deb-root container arm64 demo format check asan asan-e2e tsan clang jazzy clean

help: ## this list
	@grep -hE '^[a-z0-9-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 16

packages: ## install all system packages, those of the tests too
	@bash tools/setup/packages.sh

prefix: packages ## make the ROS 2 prefix, if no distribution is sourced
	@bash tools/setup/prefix.sh $(PREFIX)

prefix-jazzy: packages ## make the prefix of the other distribution
	@bash tools/setup/prefix.sh jazzy

setup: prefix

rmw-cyclonedds: setup ## SOURCES=dir: build rmw_cyclonedds_cpp from checkouts; then CONNECT_BRIDGE_RMW=rmw_cyclonedds_cpp make test
	@$(in_env) tools/setup/rmw_cyclonedds.sh "$(SOURCES)"

rmw-zenoh: setup ## SOURCES=dir: the same for rmw_zenoh_cpp (needs cargo)
	@$(in_env) tools/setup/rmw_zenoh.sh "$(SOURCES)"

programs = server client ctl relay auth_jwt auth_service
build: ## set up what server, client, ctl, relay and the login plugins need, and build these into build/ (BUILD=dir for another folder)
	@bash tools/setup/packages.sh programs
	@bash tools/setup/prefix.sh $(PREFIX) programs
	@$(in_env) TESTS= TARGETS="$(programs)" $(call compile,$(BUILD))

all: setup ## build everything, the tests too (TARGETS="sim ..." for a part, CMAKE_ARGS=-DCMAKE_UNITY_BUILD=OFF: each source by itself)
	@$(in_env) $(call compile,$(BUILD),-DCONNECT_SIM_SEEDS=$(SEEDS))

test: all ## set up, build, and run all tests
	@bash tools/setup/proxies.sh
	@bash tools/setup/scanner.sh
	@$(in_env) $(call ctest,$(BUILD),-j $(places))

sim: all ## SEEDS=n scenarios of the simulator
	@"$(BUILD)/sim" --seeds $(SEEDS)

bench: all ## the benchmark, about 10 minutes; QUICK=1: 2 minutes
	@$(in_env) tools/bench/run $(if $(QUICK),--quick)

bench-wan: all ## the same over a slow, lossy, unstable network (as root), some 30 minutes; QUICK=1: about 3 minutes
	@$(in_env) tools/bench/wan $(if $(QUICK),--quick)

fuzz: setup ## SECONDS=n of fuzzing, split over the targets; in the folder of make asan
	@$(in_env) TARGETS=fuzz_targets $(asan_compile)
	@tools/setup/fuzz.sh "$(BUILD)-asan" $(SECONDS_OF_FUZZ)

tls-scan: all ## a public scanner's opinion of the server's TLS, against Mozilla's "intermediate"
	@bash tools/setup/scanner.sh
	@$(in_env) CONNECT_BUILD_DIR="$(abspath $(BUILD))" python3 -B -m pytest -q -rs tests/e2e/test_tls_scan.py

deb: ## Debian packages of the last commit for this ROS 2, and lintian's opinion, into build-deb/ (BUILD=dir: dir-deb/)
	@bash tools/setup/packages.sh deb
	@bash tools/setup/prefix.sh $(PREFIX) programs
	@$(in_env) tools/setup/deb.sh "$(BUILD)-deb"

deb-root: ## install these packages in a clean root and start them there (as root)
	@tools/setup/deb_root.sh "$(BUILD)-deb"

container: ## the container image from these packages, tried with podman (as root, after deb-root)
	@$(in_env) tools/setup/container.sh "$(BUILD)-deb"

arm64: ## core tests and SEEDS= of the simulator (20) for arm64, by a cross compiler and under qemu; the relay only starts there
	@tools/setup/arm64.sh "$(BUILD)-arm64" "1..$(if $(filter file,$(origin SEEDS)),20,$(SEEDS))"

demo: programs = server client
demo: build ## a robot, an operator, and the bridge between them
	@$(in_env) tools/demo/run

format: packages ## rewrite the sources in the project's format (FILES="..." for some)
	@$(if $(FILES),printf '%s\n' $(FILES),git ls-files -co --exclude-standard -- '*.cpp' '*.hpp') | xargs -r clang-format -i

check: packages ## format, arrows between layers, sizes; whether the mutants apply
	@tools/tidy
	@tests/mutants/run --check

# Real nodes and hostile peers around the programs built with a sanitizer.
smoke = -R '^(e2e_topics|peer_peer_(hostile|hostile_topics|hostile_server|refused))$$'
# A report is a file of its own, not lines in a log that only a failed test shows: each is a failure, also that of a program that
# was killed anyway, or of a test that passed at the second try; but not one that is known to be of the middleware alone.
reports = $(abspath $(BUILD))-asan/reports
around_asan = rm -rf "$(reports)"; mkdir "$(reports)"; passed=true; \
  export ASAN_OPTIONS="detect_leaks=0:log_path=$(reports)/report" UBSAN_OPTIONS=print_stacktrace=1; \
  $(call ctest,$(BUILD)-asan,$(1)) || passed=false; \
  tools/setup/asan_reports.sh "$(reports)" || passed=false; $$passed

asan: setup ## everything by clang; unit, sim and an end-to-end smoke under the address and undefined sanitizers; PART=n: only a tenth of the sources one by one
	@$(in_env) TARGETS="$(or $(TARGETS),flow_tests core_tests unit_tests sim server client) $(ALSO)" $(asan_compile) -DCONNECT_SIM_SEEDS=$(SEEDS)
	@tools/setup/syntax.py $(if $(PART),--part $$(($(PART) % 10))/10) "$(BUILD)-asan" src
	@$(in_env) $(call ctest,$(BUILD)-asan,-L 'unit|sim' -j $(places))
	@$(in_env) $(call around_asan,$(smoke) -j $(JOBS))

asan-e2e: setup ## all end-to-end tests under the same sanitizers, about 12 minutes; PART=n: every tenth of them, from the n-th (0 to 9)
	@$(in_env) TARGETS="server client ctl relay auth_jwt auth_service auth_plugin ros_bench wan" $(asan_compile)
	@$(in_env) $(call around_asan,-L e2e $(if $(PART),-I $$(($(PART) % 10 + 1))$(comma)$(comma)10) -j $(places))

# Neither core nor the simulator has threads.
tsan: setup ## what has threads: unit tests but the core's, gateway tests and an end-to-end smoke under the thread sanitizer
	@$(in_env) TARGETS="$(or $(TARGETS),unit_tests ros_tests server client)" $(call compile,$(BUILD)-tsan,-DCONNECT_SANITIZE=thread)
	@$(in_env) export TSAN_OPTIONS="suppressions=$(CURDIR)/tests/tsan.supp $(tsan_options)"; $(call ctest,$(BUILD)-tsan,-L 'unit|ros' -E '^(flow|core)_tests' -j $(places)); $(call ctest,$(BUILD)-tsan,$(smoke) -j $(JOBS))

clang: setup ## build everything with the other compiler
	@$(in_env) $(call compile,$(BUILD)-clang,$(clang_tools))

jazzy: prefix-jazzy ## build everything against the Jazzy prefix
	@$(MAKE) all CONNECT_BRIDGE_PREFIX=jazzy BUILD=$(BUILD)-jazzy

clean: ## remove the build folders; the prefix stays
	rm -rf "$(BUILD)" "$(BUILD)"-*
