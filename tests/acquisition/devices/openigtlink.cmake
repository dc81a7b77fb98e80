# The library of OpenIGTLink packs and reads messages in one test. Its own USE file would change every target's flags.
find_package(OpenIGTLink HINTS /usr/lib/openigtlink)
if(OpenIGTLink_FOUND)
  add_library(fieldtrue_test_openigtlink INTERFACE)
  target_include_directories(fieldtrue_test_openigtlink SYSTEM INTERFACE ${OpenIGTLink_INCLUDE_DIRS})
  target_link_libraries(fieldtrue_test_openigtlink INTERFACE ${OpenIGTLink_LIBRARIES})
  target_compile_definitions(acquisition_devices_tests PRIVATE FIELDTRUE_OPENIGTLINK)
  target_link_libraries(acquisition_devices_tests PRIVATE fieldtrue_test_openigtlink)
endif()
# Its headers define what nobody else's should meet.
set_source_files_properties(${CMAKE_CURRENT_SOURCE_DIR}/acquisition/devices/openigtlink_library_test.cpp PROPERTIES
  SKIP_UNITY_BUILD_INCLUSION ON)
