# Most of the compile time goes into the headers: compiled as one unit, these sources take a third less time. The two
# kinds of sources that are not listed define the same names twice, or use names that a later source defines.
foreach(kind generator_py typesupport_c typesupport_cpp typesupport_fastrtps_c typesupport_fastrtps_cpp
    typesupport_introspection_c)
  set(target ${PROJECT_NAME}__rosidl_${kind})
  if(TARGET ${target})
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 0)
    target_compile_options(${target} PRIVATE -Wno-redundant-decls)
  endif()
endforeach()

# The sources of introspection_cpp cannot be combined; the headers that they share are precompiled once.
if(TARGET ${PROJECT_NAME}__rosidl_typesupport_introspection_cpp)
  target_precompile_headers(${PROJECT_NAME}__rosidl_typesupport_introspection_cpp PRIVATE
    <algorithm> <array> <cstddef> <memory> <string> <vector>
    <rosidl_runtime_cpp/bounded_vector.hpp>
    <rosidl_runtime_cpp/message_initialization.hpp>
    <rosidl_typesupport_cpp/message_type_support.hpp>
    <rosidl_typesupport_introspection_cpp/field_types.hpp>
    <rosidl_typesupport_introspection_cpp/message_introspection.hpp>
    <rosidl_typesupport_introspection_cpp/message_type_support_decl.hpp>)
endif()
