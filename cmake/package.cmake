# Installation, as an ament package where ament is there.
connect_available(programs server client ctl)
if(programs)
  install(TARGETS ${programs} RUNTIME DESTINATION lib/${PROJECT_NAME})
endif()
# The header of login plugins.
install(DIRECTORY include/ DESTINATION include)
foreach(folder config launch)
  if(IS_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}/${folder}")
    install(DIRECTORY ${folder} DESTINATION share/${PROJECT_NAME})
  endif()
endforeach()

if(CONNECT_ROS)
  find_package(ament_cmake QUIET)
  if(ament_cmake_FOUND)
    ament_package()
  endif()
endif()
