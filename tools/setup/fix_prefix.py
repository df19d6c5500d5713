#!/usr/bin/env python3
"""Makes a venv that holds ROS 2 wheels into a prefix that C++ can build and run against.

Usage: <prefix>/bin/python3 fix_prefix.py <prefix>. Every step may run twice.
"""

import pathlib
import shutil
import subprocess
import sys
import sysconfig

import numpy

DEBIAN_PYTHON = pathlib.Path('/usr/lib/python3/dist-packages')
# What ament_cmake's scripts import: two packages that are on no index, and what those need.
AMENT_MODULES = ['ament_package', 'catkin_pkg',
                 'docutils', 'roman.py', 'dateutil', 'six.py', 'pyparsing']


def rewrite(path, replacements):
    old = path.read_text()
    new = old
    for wrong, right in replacements:
        new = new.replace(wrong, right)
    if new != old:
        path.write_text(new)


def fix_cmake_paths(prefix):
    """The CMake files name folders of the machine that built the wheels."""
    wheel_python = '/opt/python/cp{0}{1}-cp{0}{1}'.format(*sys.version_info[:2])
    version = 'python{}.{}'.format(*sys.version_info[:2])
    replacements = [
        (f'{wheel_python}/include/{version}', sysconfig.get_path('include')),
        (f'{wheel_python}/lib/{version}/site-packages/numpy/_core/include',
         numpy.get_include()),
        ('/usr/lib64/libtinyxml2.so;', ''),
    ]
    for path in (prefix / 'share').rglob('*.cmake'):
        rewrite(path, replacements)


def drop_python_from_c_libraries(prefix):
    """Three C libraries list Python extension code as needed; that only loads in Python."""
    for name in ['librcl.so', 'librcl_action.so', 'librcl_lifecycle.so']:
        library = prefix / 'lib' / name
        needed = subprocess.run(['patchelf', '--print-needed', library],
                                check=True, text=True, capture_output=True).stdout
        wrong = [n for n in needed.split() if n.endswith('__rosidl_generator_py.so')]
        for entry in wrong:
            subprocess.run(['patchelf', '--remove-needed', entry, library], check=True)


def link_ament_python(site_packages):
    for name in AMENT_MODULES:
        source, target = DEBIAN_PYTHON / name, site_packages / name
        if source.exists() and not target.exists():
            target.symlink_to(source)


def main():
    prefix = pathlib.Path(sys.argv[1]).resolve()
    site_packages = pathlib.Path(sysconfig.get_path('purelib'))
    fix_cmake_paths(prefix)
    drop_python_from_c_libraries(prefix)
    link_ament_python(site_packages)
    stubs = pathlib.Path(__file__).parent / 'stubs'
    shutil.copytree(stubs, prefix / 'share', dirs_exist_ok=True)
    # It starts each Python twice, with library folders in random order; env.sh sets them once.
    (site_packages / 'ros_wheels_bootstrapper.pth').unlink(missing_ok=True)


if __name__ == '__main__':
    main()
