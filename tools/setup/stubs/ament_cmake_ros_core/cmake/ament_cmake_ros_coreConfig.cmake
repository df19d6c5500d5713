# Debian 12 has no ament_cmake_ros_core; the generators use only this option of it.
option(BUILD_SHARED_LIBS "shared libraries" ON)
