# The packages of ROS 2 that the gateway uses, as one target connect_ros_packages.
# What a distribution may lack is optional.
set(required rcl rcutils rcpputils rmw rmw_implementation rosidl_runtime_c rosidl_runtime_cpp rosidl_typesupport_c rosidl_typesupport_introspection_c
  rosidl_typesupport_fastrtps_cpp ament_index_cpp builtin_interfaces rcl_interfaces rosgraph_msgs action_msgs)
set(optional type_description_interfaces service_msgs rosidl_typesupport_introspection_cpp)

add_library(connect_ros_packages INTERFACE)
foreach(package ${required} ${optional})
  if(package IN_LIST required)
    find_package(${package} REQUIRED)
  else()
    find_package(${package} QUIET)
    if(NOT ${package}_FOUND)
      continue()
    endif()
  endif()
  if(TARGET ${package}::${package})
    target_link_libraries(connect_ros_packages INTERFACE ${package}::${package})
  else()
    # Messages: the structs and their type support.
    foreach(part rosidl_generator_c rosidl_typesupport_c rosidl_typesupport_introspection_c rosidl_generator_cpp rosidl_typesupport_cpp)
      if(TARGET ${package}::${package}__${part})
        target_link_libraries(connect_ros_packages INTERFACE ${package}::${package}__${part})
      endif()
    endforeach()
    # Older distributions export plain variables.
    target_include_directories(connect_ros_packages SYSTEM INTERFACE ${${package}_INCLUDE_DIRS})
  endif()
endforeach()

if(DEFINED ENV{ROS_DISTRO})
  message(STATUS "ROS distribution: $ENV{ROS_DISTRO}")
endif()
