# Installation, as an ament package where ament is there.
connect_available(programs server client ctl relay)
if(programs)
  install(TARGETS ${programs} RUNTIME DESTINATION lib/${PROJECT_NAME})
endif()
install(TARGETS ${plugins} LIBRARY DESTINATION lib/${PROJECT_NAME})
# The header of login plugins.
install(DIRECTORY include/ DESTINATION include)
foreach(folder config examples launch)
  if(IS_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}/${folder}")
    install(DIRECTORY ${folder} DESTINATION share/${PROJECT_NAME})
  endif()
endforeach()

if(CONNECT_ROS)
  find_package(ament_cmake QUIET)
  # `ros2 connect`: the ROS 2 CLI finds its commands by entry points of installed distributions.
  if(ament_cmake_FOUND)
    ament_python_install_module("${CMAKE_CURRENT_SOURCE_DIR}/packaging/ros2connect/ros2connect.py" SKIP_COMPILE)
    set(distribution "${PYTHON_INSTALL_DIR}/${PROJECT_NAME}-${PROJECT_VERSION}.dist-info")
    configure_file(packaging/ros2connect/METADATA.in METADATA @ONLY)
    install(FILES packaging/ros2connect/entry_points.txt "${CMAKE_CURRENT_BINARY_DIR}/METADATA"
      DESTINATION "${distribution}")
    ament_package()
  endif()
endif()
