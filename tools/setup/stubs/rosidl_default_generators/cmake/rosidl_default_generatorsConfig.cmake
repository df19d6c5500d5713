# The wheels carry every generator but not the package that names them all. Those for C++ are left out: rclpy and the bridge
# use the type support of C.
foreach(generator rosidl_cmake rosidl_generator_type_description rosidl_generator_c rosidl_generator_py
    rosidl_typesupport_introspection_c rosidl_typesupport_fastrtps_c rosidl_typesupport_c)
  find_package(${generator} REQUIRED)
endforeach()
