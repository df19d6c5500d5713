"""One process with nodes of two middlewares, for tests whose sides have one each.

rcl is linked to one middleware. In its place comes a library with the same functions, which passes
each call on to the middleware that the call's arguments belong to: nearly all of them carry its
name. What carries none, and a new context, belongs to RMW_IMPLEMENTATION, as it is at that moment.
"""

import hashlib
import os
import pathlib
import re
import subprocess

_BEGIN = """
#include <dlfcn.h>

#include <cstdio>
#include <cstdlib>
#include <string>

namespace {

struct Middleware {
  std::string name, file;
  void* library = nullptr;
};
Middleware all[] = {%s};

template <class T>
const char* name_of(const T& argument) {
  if constexpr (requires { argument->implementation_identifier; })
    return argument ? argument->implementation_identifier : nullptr;
  return nullptr;
}

template <class Function, class... Arguments>
auto call(const char* function, Arguments... arguments) {
  const char* name = nullptr;
  ((name = name ? name : name_of(arguments)), ...);
  if (!name) name = std::getenv("RMW_IMPLEMENTATION");
  for (auto& of : all) {
    if (of.name != (name ? name : "")) continue;
    if (!of.library) of.library = dlopen(of.file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (void* found = of.library ? dlsym(of.library, function) : nullptr)
      return reinterpret_cast<Function>(found)(arguments...);
  }
  std::fprintf(stderr, "no %%s of %%s: %%s\\n", function, name ? name : "any", dlerror());
  std::abort();
}

}  // namespace

extern "C" {
"""
_DECLARED = re.compile(
    r"RMW_PUBLIC\s+(?:RMW_WARN_UNUSED\s+)?([^;{}()]*?)\b(rmw_\w+)\s*\(([^;{}()]*)\)\s*;"
)


def _functions(headers, library):
    """The result, name and parameters of all functions that a middleware has."""
    symbols = subprocess.run(
        ["nm", "-D", "--defined-only", library], check=True, capture_output=True, text=True
    ).stdout
    defined = {line.split()[-1] for line in symbols.splitlines()}
    for header in headers:
        text = re.sub(r"//[^\n]*|/\*.*?\*/", "", header.read_text("utf-8"), flags=re.S)
        for result, name, parameters in _DECLARED.findall(text):
            if name in defined:
                yield result, name, parameters


def _source(headers, libraries):
    made = [f"#include <rmw/{header.name}>\n" for header in headers]
    made.append(_BEGIN % ", ".join(f'{{"{n}", "{file}"}}' for n, file in libraries.items()))
    for result, name, parameters in _functions(headers, next(iter(libraries.values()))):
        words = [] if parameters.strip() == "void" else re.findall(r"(\w+)\s*(?:,|$)", parameters)
        passed = ", ".join([f'"{name}"', *words])
        made.append(
            f"{result} {name}({parameters}) {{ return call<decltype(&{name})>({passed}); }}\n"
        )
    return "".join([*made, "}\n"])


def two_middlewares(prefix, libraries, folder):
    """Makes the library, for middlewares by name (the first is that of the prefix), and returns the
    folder in which it has that one's place."""
    prefix = pathlib.Path(prefix)
    source = _source(sorted((prefix / "include/rmw/rmw").glob("*.h")), libraries)
    at = pathlib.Path(folder) / hashlib.sha256(source.encode()).hexdigest()[:16]
    library = at / f"lib{next(iter(libraries))}.so"
    if not library.exists():
        at.mkdir(parents=True, exist_ok=True)
        (at / "two.cpp").write_text(source, encoding="utf-8")
        made = at / f"made-{os.getpid()}.so"
        includes = [f"-I{path}" for path in (prefix / "include").iterdir() if path.is_dir()]
        build = ["c++", "-std=c++20", "-O1", "-fPIC", "-shared", *includes, at / "two.cpp"]
        subprocess.run([*build, "-o", made, "-ldl"], check=True)
        made.rename(library)
    return str(at)
