# The wheels carry every generator but not the package that names them all.
foreach(generator rosidl_cmake rosidl_generator_type_description rosidl_generator_c rosidl_generator_cpp rosidl_generator_py
    rosidl_typesupport_introspection_c rosidl_typesupport_introspection_cpp
    rosidl_typesupport_fastrtps_c rosidl_typesupport_fastrtps_cpp rosidl_typesupport_c rosidl_typesupport_cpp)
  find_package(${generator} REQUIRED)
endforeach()
