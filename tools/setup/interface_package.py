#!/usr/bin/env python3
"""Makes an ament source package from the definitions in a wheel.

Usage: interface_package.py <folder of wheels> <package> <target folder>
"""

import pathlib
import re
import sys
import zipfile

CMAKE = '''cmake_minimum_required(VERSION 3.16)
project({name})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
{finds}
# rclpy and the bridge use the type support of C.
list(FILTER AMENT_EXTENSIONS_rosidl_generate_idl_interfaces EXCLUDE REGEX "_cpp:")
rosidl_generate_interfaces(${{PROJECT_NAME}}
  {files}
  DEPENDENCIES {dependencies})
ament_export_dependencies(rosidl_runtime_c rosidl_runtime_cpp)
ament_package()
'''

PACKAGE = '''<?xml version="1.0"?>
<package format="3">
  <name>{name}</name>
  <version>{version}</version>
  <description>{name}, generated from the definitions of its release.</description>
  <maintainer email="maintainers@example.com">ROS2 Connect</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  {depends}
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>
</package>
'''


def dependencies_of(name, definitions):
    """The packages whose types the definitions use; every service needs service_msgs."""
    used = set()
    for path, text in definitions.items():
        lines = (line.split('#')[0] for line in text.splitlines())
        matches = (re.match(r'\s*([a-z][a-z0-9_]*)/[A-Z]', line) for line in lines)
        used |= {match.group(1) for match in matches if match}
        if re.search(r'^\s*Header\s', text, re.M):
            used.add('std_msgs')
        if path.startswith('srv/'):
            used.add('service_msgs')
    return sorted((used | {'builtin_interfaces'}) - {name})


def main():
    wheels, name, target = pathlib.Path(sys.argv[1]), sys.argv[2], pathlib.Path(sys.argv[3])
    wheel = next(wheels.glob(f'ros_{name}-*.whl'))
    with zipfile.ZipFile(wheel) as archive:
        pattern = re.compile(rf'(?:^|/)share/{name}/((msg|srv|action)/\w+\.(msg|srv|action))$')
        found = ((pattern.search(entry), entry) for entry in sorted(archive.namelist()))
        definitions = {m.group(1): archive.read(entry).decode() for m, entry in found if m}
    # A service is split into request and response files in its folder; those follow from it.
    split = re.compile(r'_(Request|Response)\.msg$')
    definitions = {path: text for path, text in definitions.items() if not split.search(path)}
    dependencies = dependencies_of(name, definitions)
    for path, text in definitions.items():
        (target / path).parent.mkdir(parents=True, exist_ok=True)
        (target / path).write_text(text)
    version = wheel.name.split('-')[1]
    (target / 'CMakeLists.txt').write_text(CMAKE.format(
        name=name,
        finds='\n'.join(f'find_package({d} REQUIRED)' for d in dependencies),
        files='\n  '.join(f'"{path}"' for path in definitions),
        dependencies=' '.join(dependencies)))
    (target / 'package.xml').write_text(PACKAGE.format(
        name=name, version=version,
        depends='\n  '.join(f'<depend>{d}</depend>' for d in dependencies)))


if __name__ == '__main__':
    main()
