# Jazzy's name for what ament_cmake_ros_core is in Kilted; Debian has the package, but it needs more than is used here.
option(BUILD_SHARED_LIBS "shared libraries" ON)
