# Nodes in Python need the generators and type supports of C only, which Fast DDS uses for them. Those of C++ take half
# the time of a build; -DCPP_MESSAGES=OFF leaves them out, where there is no rclcpp for nodes in C++.
option(CPP_MESSAGES "Generate the messages for nodes in C++, too" ON)
if(NOT CPP_MESSAGES)
  list(FILTER AMENT_EXTENSIONS_rosidl_generate_idl_interfaces EXCLUDE REGEX "_cpp")
endif()
